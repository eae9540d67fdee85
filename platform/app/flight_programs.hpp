/// What runs in the slots of the flight and the decision lane, and what the two tell each other. Neither
/// knows whether time is real or virtual.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <span>

#include "core/exchange/mailbox.hpp"
#include "core/executive/lane_executive.hpp"
#include "core/memory/static_vector.hpp"
#include "firmware_if/depth_camera.hpp"
#include "platform/app/aircraft.hpp"
#include "platform/app/decision_pipeline.hpp"
#include "platform/app/flight_lane.hpp"

namespace roborun::app {

/// Flight lane to decision lane, every minor frame. What is large is written only where it has changed since
/// this cell of the mailbox was written last.
struct FlightReport {
  stages::EstimatedState state{};
  bool estimated{false};  ///< There is a state.
  stages::PastStates past{Nanos{0}};
  Trajectory committed{};
  std::uint64_t committed_number{0};
  bool airborne{false};
};

/// Decision lane to flight lane, after every decision that found something.
struct Offer {
  Trajectory trajectory{};
  bool is_stop{false};  ///< Taken even while an overrun has the vehicle brake.
};

struct LaneMail {
  core::Mailbox<FlightReport> report;
  core::Mailbox<Offer> offer;
};

class FlightProgram final : public core::LaneProgram {
 public:
  FlightProgram(FlightLane& flight, Aircraft& aircraft, LaneMail& mail)
      : flight_(flight), aircraft_(aircraft), mail_(mail) {}
  /// A frame belongs to the instant of its release, however late it begins.
  void run(core::SlotId slot, core::LaneExecutive& lane) noexcept override;
  /// Offers refused because an overrun has the vehicle brake; never decreases.
  [[nodiscard]] std::uint64_t offers_refused() const noexcept { return offers_refused_; }

 private:
  FlightLane& flight_;
  Aircraft& aircraft_;
  LaneMail& mail_;
  std::uint64_t offers_refused_{0};
};

class DecisionProgram final : public core::LaneProgram {
 public:
  struct Config {
    Vector3 goal_W = Vector3::Zero();
    std::uint64_t seed{1};
  };
  DecisionProgram(const Config& config, DecisionPipeline& pipeline,
                  std::span<firmware_if::DepthCamera* const> cameras, LaneMail& mail)
      : config_(config), pipeline_(pipeline), cameras_(cameras), mail_(mail) {}
  void run(core::SlotId slot, core::LaneExecutive& lane) noexcept override;

  /// No more decisions from here on; any thread.
  void give_up() noexcept { given_up_.store(true, std::memory_order_release); }
  /// The newest decision: complete once the planner's slot has run.
  [[nodiscard]] const DecisionOutput& output() const noexcept { return out_; }
  [[nodiscard]] std::uint64_t decisions() const noexcept { return decisions_; }
  /// Trajectories that came too late for their own start; never decreases.
  [[nodiscard]] std::uint64_t too_late() const noexcept { return too_late_; }

 private:
  void gather(core::LaneExecutive& lane) noexcept;
  void hand_over(const core::LaneExecutive& lane) noexcept;

  Config config_;
  DecisionPipeline& pipeline_;
  std::span<firmware_if::DepthCamera* const> cameras_;
  LaneMail& mail_;
  core::StaticVector<stages::PosedDepthFrame, 8> frames_;
  DecisionInput in_{};
  DecisionOutput out_{};
  std::uint64_t decisions_{0};
  std::uint64_t too_late_{0};
  std::atomic<bool> given_up_{false};
};

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

}  // namespace roborun::app
