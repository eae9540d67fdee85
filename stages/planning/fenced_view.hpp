/// A map's view with a fence around it: what the fence forbids is occupied, for every planner and smoother.
#pragma once

#include "core/geometry/fence.hpp"
#include "stages/perception/map_view.hpp"

namespace roborun::stages {

/// The contract of MapView holds if it does for `view`. Both must outlive it.
class FencedView final : public MapView {
 public:
  FencedView(const MapView& view, const core::Fence& fence) noexcept : view_(view), fence_(fence) {}

  [[nodiscard]] bool is_free(const Aabb& box_W, std::uint64_t& lookups) const noexcept override {
    return fence_.allows(box_W) && view_.is_free(box_W, lookups);
  }
  [[nodiscard]] bool is_free_at_finest(const Aabb& box_W, std::uint64_t& lookups) const noexcept override {
    return fence_.allows(box_W) && view_.is_free_at_finest(box_W, lookups);
  }
  [[nodiscard]] CellState at(const Vector3& p_W, std::uint64_t& lookups) const noexcept override {
    return fence_.allows(p_W) ? view_.at(p_W, lookups) : CellState::kOccupied;
  }
  [[nodiscard]] double cell_m() const noexcept override { return view_.cell_m(); }
  [[nodiscard]] double finest_m() const noexcept override { return view_.finest_m(); }

 private:
  const MapView& view_;
  const core::Fence& fence_;
};

}  // namespace roborun::stages
