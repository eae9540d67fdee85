/// The lane that watches the other lanes.
#pragma once

#include <cstdint>
#include <optional>

#include "core/executive/frame_table.hpp"
#include "core/executive/lane_executive.hpp"

namespace roborun::flight {

/// Twice in a row, so that a host which stops everything for a while does not count as a hang: a flight lane
/// that is overdue ends the run; while the decision lane is, no new trajectory is taken and the committed one
/// ends in its stop.
class WatchdogProgram final : public core::LaneProgram {
 public:
  /// Before the first frame.
  void watch(const core::LaneExecutive& flight, const core::LaneExecutive& decision) noexcept {
    flight_ = &flight;
    decision_ = &decision;
  }
  void run(core::SlotId slot, core::LaneExecutive& lane) noexcept override;
  /// Times that the decision lane hung; never decreases.
  [[nodiscard]] std::uint64_t stalls() const noexcept { return stalls_; }
  /// The slot in which it hung last.
  [[nodiscard]] std::optional<core::SlotId> stalled() const noexcept { return stalled_; }

 private:
  const core::LaneExecutive* flight_{nullptr};
  const core::LaneExecutive* decision_{nullptr};
  bool flight_late_{false};
  bool decision_late_{false};
  bool braking_{false};
  std::uint64_t stalls_{0};
  std::optional<core::SlotId> stalled_;
};

}  // namespace roborun::flight
