#include <gtest/gtest.h>

#include "platform/mission/flight_records.hpp"
#include "tests/support/box_view.hpp"

namespace roborun::mission {
namespace {

/// Boxes, in finest cells of a size of its own.
class FineView final : public stages::MapView {
 public:
  explicit FineView(double finest_m) : finest_m_(finest_m) {
    boxes_.free_W = {{-10.0, -10.0, 0.0}, {10.0, 10.0, 8.0}};
    boxes_.occupied = {{{2.01, 3.01, 0.0}, {2.09, 3.09, 8.0}}};  // one cell of 0.1 m
  }
  [[nodiscard]] bool is_free(const Aabb& box_W, std::uint64_t& lookups) const noexcept override {
    return boxes_.is_free(box_W, lookups);
  }
  [[nodiscard]] bool is_free_at_finest(const Aabb& box_W, std::uint64_t& lookups) const noexcept override {
    return boxes_.is_free(box_W, lookups);
  }
  [[nodiscard]] stages::CellState at(const Vector3& p_W, std::uint64_t& lookups) const noexcept override {
    return boxes_.at(p_W, lookups);
  }
  [[nodiscard]] double cell_m() const noexcept override { return finest_m_; }

 private:
  test::BoxView boxes_;
  double finest_m_;
};

std::uint8_t at(const log::MapSlice& slice, double x_m, double y_m) {
  const auto column = static_cast<std::size_t>((x_m - slice.x_m) / slice.cell_m);
  const auto row = static_cast<std::size_t>((y_m - slice.y_m) / slice.cell_m);
  return slice.cell.at(row * slice.columns + column);
}

TEST(MapSlice, IsWideEnoughToShowWhatLiesAhead) {
  for (const auto& [finest_m, cell_m] : {std::pair{0.3, 0.3}, {0.15, 0.3}, {0.1, 0.2}, {0.05, 0.2}}) {
    log::MapSlice slice;
    fill_slice(FineView(finest_m), {1.0, 1.0, 4.0}, slice);
    EXPECT_NEAR(slice.cell_m, cell_m, 1e-9) << finest_m;
    const double wide_m = slice.columns * slice.cell_m;
    EXPECT_GE(wide_m, 25.0) << finest_m;
    EXPECT_NEAR(slice.x_m + 0.5 * wide_m, 1.0, 16 * finest_m) << "around the vehicle";
  }
}

TEST(MapSlice, MergesCellsWithoutHidingWhatIsOccupiedOrUnknown) {
  log::MapSlice slice;
  fill_slice(FineView(0.1), {1.0, 1.0, 4.0}, slice);
  ASSERT_NEAR(slice.cell_m, 0.2, 1e-9) << "2 x 2 cells are one";
  EXPECT_EQ(at(slice, 2.05, 3.05), log::MapSlice::kOccupied);
  EXPECT_EQ(at(slice, 2.15, 3.15), log::MapSlice::kOccupied)
      << "the same merged cell: one of four is occupied";
  EXPECT_EQ(at(slice, 2.25, 3.05), log::MapSlice::kFree);
  EXPECT_EQ(at(slice, -5.0, -5.0), log::MapSlice::kFree);
  EXPECT_EQ(at(slice, 10.3, 0.0), log::MapSlice::kUnknown);
}

}  // namespace
}  // namespace roborun::mission
