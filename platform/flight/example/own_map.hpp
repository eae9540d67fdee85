/// A map of your own: every cell of 0.3 m in one array, as large as the world. What was seen last counts.
#pragma once

#include <algorithm>
#include <cmath>

#include "platform/board/part_request.hpp"
#include "stages/perception/occupancy_map.hpp"
#include "voxel_array.hpp"

namespace example {
using roborun::Status;

/// Keeps the contract of stages::OccupancyMap (stages/perception/occupancy_map.hpp).
class VoxelMap final : public roborun::stages::OccupancyMap {
 public:
  /// Takes all memory here; no call below allocates.
  explicit VoxelMap(const roborun::board::PartRequest& request) : cells_(request.map_bounds_W) {}

  [[nodiscard]] Status integrate(const roborun::stages::IntegrationRequest& request,
                                 roborun::core::StageBudget& budget,
                                 roborun::stages::IntegrationResult& result) noexcept override {
    // v0 limits the space that is worked on, nearest first: here a ball around each camera.
    const double reach_m = std::cbrt(request.volume_m3 / kUnitBall_m3);
    result = {{0, request.volume_m3, request.level}, 0};
    // First what is free, then the surfaces: no ray of a scan clears what another one hit.
    for (const CellState state : {CellState::kFree, CellState::kOccupied}) {
      for (const roborun::stages::PosedDepthFrame& posed : request.frames) {
        if (!cast(posed, state, reach_m, budget, result.work)) return Status::kBudgetSpent;
      }
    }
    return Status::kOk;
  }
  /// v1 limits what the planner sees: here a cube around the vehicle. Cells stay fine, whatever p1 is.
  [[nodiscard]] Status export_view(const roborun::stages::ExportRequest& request, roborun::core::StageBudget&,
                                   roborun::core::Work& work) noexcept override {
    cells_.show(roborun::Aabb::around(request.center_W, 0.5 * std::cbrt(request.volume_m3)));
    work = {1, std::min(request.volume_m3, known_volume_m3()), request.level};
    return Status::kOk;
  }
  void forget() noexcept override { cells_.forget(); }
  [[nodiscard]] const roborun::stages::MapView& view() const noexcept override { return cells_; }
  [[nodiscard]] double known_volume_m3() const noexcept override { return cells_.known_volume_m3(); }
  [[nodiscard]] std::size_t bytes() const noexcept override { return cells_.bytes(); }
  [[nodiscard]] std::uint64_t digest() const noexcept override { return cells_.digest(); }

 private:
  static constexpr double kUnitBall_m3 = 4.18879;

  /// Every pixel of an image: its ray as free, or its end as a surface. False if the time is used up.
  [[nodiscard]] bool cast(const roborun::stages::PosedDepthFrame& posed, CellState state, double reach_m,
                          roborun::core::StageBudget& budget, roborun::core::Work& work) noexcept {
    const roborun::firmware_if::DepthFrame& image = posed.frame;
    if (image.depth_m.size() != std::size_t{image.width} * image.height) return true;  // of a broken camera
    for (std::size_t i = 0; i < image.depth_m.size(); ++i) {
      if (i % image.width == 0 && budget.spent(work)) return false;
      const double depth_m = static_cast<double>(image.depth_m[i]);
      if (!(depth_m > static_cast<double>(image.range_min_m))) continue;  // NaN too: no information
      // firmware_if/depth_camera.hpp: x along the optical axis, y left, z up.
      const double across = static_cast<double>(image.tan_half_width);
      const double along = static_cast<double>(image.tan_half_height);
      const std::size_t row = i / image.width, column = i % image.width;
      const double u = (static_cast<double>(column) + 0.5) / image.width;
      const double v = (static_cast<double>(row) + 0.5) / image.height;
      const Vector3 ray_W =
          posed.X_WC.R_RT * Vector3(1.0, across - 2.0 * across * u, along - 2.0 * along * v);
      const double end_m = std::min(static_cast<double>(image.range_m), reach_m / ray_W.norm());
      if (state == CellState::kOccupied) {
        if (depth_m <= end_m) cells_.set(posed.X_WC.p_RT + depth_m * ray_W, state);
        continue;
      }
      const double step_m = 0.5 * kCell_m / ray_W.norm();
      for (double at_m = 0.0; at_m < std::min(end_m, depth_m - 2.0 * step_m); at_m += step_m, ++work.units)
        cells_.set(posed.X_WC.p_RT + at_m * ray_W, state);
    }
    return true;
  }

  VoxelArray cells_;
};

}  // namespace example
