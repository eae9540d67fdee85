/// The two meters of the decision lane: the clock in real time, a cost profile in lockstep.
#pragma once

#include "core/executive/lane_executive.hpp"
#include "core/executive/stage_meter.hpp"
#include "core/executive/virtual_clock.hpp"
#include "firmware_if/assert.hpp"

namespace roborun::core {

/// Real time: a stage costs what its slot has spent; a degraded slot gets half. Both meters: attach() before
/// the first frame.
class ClockMeter final : public StageMeter {
 public:
  void attach(LaneExecutive& lane) noexcept { lane_ = &lane; }
  void charge_to(StageId id) noexcept override { lane_->charge_to(slot_of(id)); }
  [[nodiscard]] Nanos cost(StageId id, const Work&) const noexcept override {
    return lane_->spent(slot_of(id));
  }
  Nanos settle(StageId id, const Work& work) noexcept override {
    lane_->describe(slot_of(id), work);
    return lane_->spent(slot_of(id));
  }
  [[nodiscard]] Nanos grant(StageId id, Nanos wanted) noexcept override {
    return lane_->grant(slot_of(id), wanted);
  }

 private:
  LaneExecutive* lane_{nullptr};
};

/// Lockstep: work costs what the profile says, and the lane's clock moves on by it.
class CostProfileMeter final : public StageMeter {
 public:
  /// Precondition, asserted: profile.validate() is kOk.
  CostProfileMeter(const CostProfile& profile, VirtualClock& clock) noexcept
      : profile_(profile), clock_(clock) {
    ROBORUN_ASSERT(profile.validate() == Status::kOk);
  }
  void attach(LaneExecutive& lane) noexcept { lane_ = &lane; }
  void charge_to(StageId id) noexcept override { lane_->charge_to(slot_of(id)); }
  [[nodiscard]] Nanos cost(StageId id, const Work& work) const noexcept override {
    return profile_.cost(id, work);
  }
  Nanos settle(StageId id, const Work& work) noexcept override {
    lane_->describe(slot_of(id), work);
    const Nanos spent = profile_.cost(id, work);
    clock_.advance(spent);
    return spent;
  }
  /// What the governor grants: a simulated board is not degraded by the machine that simulates it.
  [[nodiscard]] Nanos grant(StageId, Nanos wanted) noexcept override { return wanted; }

 private:
  const CostProfile& profile_;
  VirtualClock& clock_;
  LaneExecutive* lane_{nullptr};
};

}  // namespace roborun::core
