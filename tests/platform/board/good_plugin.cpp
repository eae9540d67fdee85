/// A planner and a map in one plugin; both do nothing.
#include "platform/board/plugin.hpp"

namespace roborun::board {
namespace {

class Planner final : public stages::Planner {
 public:
  [[nodiscard]] Status plan(const stages::PlanRequest&, const stages::MapView&, core::StageBudget&,
                            stages::PlanResult&) noexcept override {
    return Status::kNoPath;
  }
};

class Map final : public stages::OccupancyMap, stages::MapView {
 public:
  explicit Map(const PartRequest& request) : side_(request.images.width) {}
  [[nodiscard]] Status integrate(const stages::IntegrationRequest&, core::StageBudget&,
                                 stages::IntegrationResult&) noexcept override {
    return Status::kInvalidArgument;
  }
  [[nodiscard]] Status export_view(const stages::ExportRequest&, core::StageBudget&,
                                   core::Work&) noexcept override {
    return Status::kOk;
  }
  void forget() noexcept override {}
  [[nodiscard]] const MapView& view() const noexcept override { return *this; }
  [[nodiscard]] double known_volume_m3() const noexcept override { return 0.0; }
  [[nodiscard]] std::size_t bytes() const noexcept override { return side_; }
  [[nodiscard]] std::uint64_t digest() const noexcept override { return 0; }

 private:
  [[nodiscard]] bool is_free(const Aabb&, std::uint64_t&) const noexcept override { return false; }
  [[nodiscard]] bool is_free_at_finest(const Aabb&, std::uint64_t&) const noexcept override { return false; }
  [[nodiscard]] stages::CellState at(const Vector3&, std::uint64_t&) const noexcept override {
    return stages::CellState::kUnknown;
  }
  [[nodiscard]] double cell_m() const noexcept override { return kPublishedCell_m; }

  std::size_t side_;
};

}  // namespace
}  // namespace roborun::board

ROBORUN_PLUGIN_PLANNER(roborun::board::Planner)
ROBORUN_PLUGIN_MAP(roborun::board::Map)
