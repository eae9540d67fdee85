/// What the planner, the smoother and the profilers may ask of a map.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/geometry/vector.hpp"
#include "stages/perception/cell_block.hpp"

namespace roborun::stages {

enum class CellState : std::uint8_t { kUnknown, kFree, kOccupied };

class MapView;
[[nodiscard]] BlockContent read_cell_by_cell(const MapView& view, const Vector3& corner_W, double cell_m,
                                             CellBlock& cells, std::uint64_t& lookups) noexcept;

/// MapView::read_doubled() from eight blocks of the finest.
[[nodiscard]] BlockContent read_eighths(const MapView& view, const Vector3& corner_W, CellBlock& cells,
                                        std::uint64_t& lookups) noexcept;

/// The map at precision p1 inside volume v1. Unknown is not free: whatever was not exported is unknown.
/// Contract: no call blocks or allocates; all are const and give the same answer for the same map.
class MapView {
 public:
  virtual ~MapView() = default;

  /// True if every cell of the view that touches the box is known to be free. False for an empty or
  /// non-finite box. `lookups` grows by the number of cells and nodes visited.
  [[nodiscard]] virtual bool is_free(const Aabb& box_W, std::uint64_t& lookups) const noexcept = 0;
  /// The same of the whole map at its finest, whatever p1 and v1 of the view are: for what is already being
  /// flown, which a coarser view must not call blocked. A backend that knows nothing finer answers as
  /// is_free().
  [[nodiscard]] virtual bool is_free_at_finest(const Aabb& box_W, std::uint64_t& lookups) const noexcept = 0;
  /// The state of the cell of the view that contains the point. Occupied wins over unknown, unknown over
  /// free.
  [[nodiscard]] virtual CellState at(const Vector3& p_W, std::uint64_t& lookups) const noexcept = 0;
  /// Edge of the cells, cell_size_m(p1).
  [[nodiscard]] virtual double cell_m() const noexcept = 0;
  /// Edge of the finest cells, whatever p1 is.
  [[nodiscard]] virtual double finest_m() const noexcept { return cell_m(); }
  /// The 16^3 cells of cell_m, the map's finest, above a corner whose coordinates are multiples of block_m(cell_m), of the
  /// whole map. `cells` is written if the answer is kMixed. A backend that knows nothing finer answers as at().
  [[nodiscard]] virtual BlockContent read(const Vector3& corner_W, double cell_m, CellBlock& cells,
                                          std::uint64_t& lookups) const noexcept {
    return read_cell_by_cell(*this, corner_W, cell_m, cells, lookups);
  }
  /// The same in cells of twice the map's finest: free if all eight in them are, occupied if one is.
  [[nodiscard]] virtual BlockContent read_doubled(const Vector3& corner_W, CellBlock& cells,
                                                  std::uint64_t& lookups) const noexcept {
    return read_eighths(*this, corner_W, cells, lookups);
  }
  /// Of the block that read() tells at its finest: as long as this is the same, so are its cells. 0: not told. O(1).
  [[nodiscard]] virtual std::uint64_t revision(const Vector3& corner_W) const noexcept {
    (void)corner_W;
    return 0;
  }
};

/// read() in cells of finest_m() or of twice that.
[[nodiscard]] inline BlockContent read_blocks(const MapView& view, const Vector3& corner_W, double cell_m,
                                              CellBlock& cells, std::uint64_t& lookups) noexcept {
  return cell_m == 2.0 * view.finest_m() ? view.read_doubled(corner_W, cells, lookups)
                                         : view.read(corner_W, cell_m, cells, lookups);
}
/// Of the eight halves of a cube, in edges of a half.
[[nodiscard]] Vector3 corner_of_eighth(std::size_t eighth) noexcept;
/// revision() of what read_blocks() tells; 0: not told.
[[nodiscard]] std::uint64_t blocks_revision(const MapView& view, const Vector3& corner_W, double cell_m,
                                            std::uint64_t& lookups) noexcept;

/// is_free_at_finest() of another view, which must outlive it, in the place of is_free().
class FinestView final : public MapView {
 public:
  explicit FinestView(const MapView& view) noexcept : view_(view) {}
  [[nodiscard]] bool is_free(const Aabb& box_W, std::uint64_t& lookups) const noexcept override {
    return view_.is_free_at_finest(box_W, lookups);
  }
  [[nodiscard]] bool is_free_at_finest(const Aabb& box_W, std::uint64_t& lookups) const noexcept override {
    return view_.is_free_at_finest(box_W, lookups);
  }
  [[nodiscard]] CellState at(const Vector3& p_W, std::uint64_t& lookups) const noexcept override {
    return view_.at(p_W, lookups);
  }
  [[nodiscard]] double cell_m() const noexcept override { return view_.finest_m(); }

 private:
  const MapView& view_;
};

/// True if a ball of this radius can move straight from a to b through known free space (swept_ball.hpp), both ends included,
/// in pieces of at most max(radius_m, cell / 2). RT-safe: O(length / radius_m) of them.
[[nodiscard]] bool is_segment_free(const MapView& view, const Vector3& a_W, const Vector3& b_W,
                                   double radius_m, std::uint64_t& lookups) noexcept;

/// Distance from `from_W` along `direction_W` (any length, non-zero) that a vehicle of this radius can travel
/// through known free space, at most max_m; 0 if it is not in free space or the direction is not finite or
/// zero.
[[nodiscard]] double free_distance_m(const MapView& view, const Vector3& from_W, const Vector3& direction_W,
                                     double radius_m, double max_m, std::uint64_t& lookups) noexcept;

}  // namespace roborun::stages
