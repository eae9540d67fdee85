/// A map view on a budget: whoever asks it polls at a bounded interval, however long its own loops are.
#pragma once

#include "core/executive/stage_budget.hpp"
#include "stages/perception/map_view.hpp"

namespace roborun::stages {

/// Answers for `view` and polls `budget` before the first box and every 1,024 lookups from then on. Once it
/// is spent no box is known to be free any more: whatever was checked until then stays checked, and every
/// loop that asks on ends at its next question. A single cell, at(), is never refused. `lookups` of its calls
/// must be `work.units`. RT-safe as the view itself.
class PolledView final : public MapView {
 public:
  PolledView(const MapView& view, core::StageBudget& budget, const core::Work& work) noexcept
      : view_(view), budget_(budget), work_(work) {}
  [[nodiscard]] bool is_free(const Aabb& box_W, std::uint64_t& lookups) const noexcept override {
    return !spent() && view_.is_free(box_W, lookups);
  }
  [[nodiscard]] bool is_free_at_finest(const Aabb& box_W, std::uint64_t& lookups) const noexcept override {
    return !spent() && view_.is_free_at_finest(box_W, lookups);
  }
  [[nodiscard]] CellState at(const Vector3& p_W, std::uint64_t& lookups) const noexcept override {
    return view_.at(p_W, lookups);
  }
  [[nodiscard]] double cell_m() const noexcept override { return view_.cell_m(); }
  [[nodiscard]] double finest_m() const noexcept override { return view_.finest_m(); }
  [[nodiscard]] bool spent() const noexcept {
    if (!spent_ && work_.units >= next_) {
      spent_ = budget_.spent(work_);
      next_ = work_.units + kEvery;
    }
    return spent_;
  }

 private:
  static constexpr std::uint64_t kEvery = 1024;
  const MapView& view_;
  core::StageBudget& budget_;
  const core::Work& work_;
  mutable std::uint64_t next_{0};
  mutable bool spent_{false};
};

}  // namespace roborun::stages
