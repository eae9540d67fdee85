/// The lanes of a flight on real time, and what is seen of them from outside.
#pragma once

#include <atomic>

#include "core/executive/lane_executive.hpp"
#include "platform/flight/flight_system.hpp"
#include "platform/log/log_records.hpp"
#include "platform/mission/lane_logging.hpp"

namespace roborun::live {

/// What the lanes let others see of them.
struct Seen {
  std::atomic<double> distance_m{0.0}, speed_mps{0.0};
  std::atomic<double> x_m{0.0}, y_m{0.0}, z_m{0.0};
  std::atomic<governor::Action> action{governor::Action::kGoOn};
  std::atomic<governor::Phase> phase{governor::Phase::kGround};
  std::atomic<bool> flying{false}, landed{false}, descending{false};
  // Of an autopilot; without one it is ours.
  std::atomic<firmware_if::AutopilotStage> stage{firmware_if::AutopilotStage::kOurs};
  std::atomic<bool> armed{false};
  std::atomic<MonotonicTime> frame{MonotonicTime{}};  ///< The newest.
  // Of the decision lane.
  std::atomic<std::uint64_t> decisions{0};
  std::atomic<bool> no_way{false}, goal_blocked{false};
};

/// The flight lane, what is seen of it, and what it says to the log.
class SeenFlight final : public core::LaneProgram {
 public:
  SeenFlight(flight::FlightSystem& system, flight::Aircraft& aircraft, Seen& seen)
      : system_(system), aircraft_(aircraft), seen_(seen) {}
  /// Before the lanes start. Times of the log count from `start`.
  void log_to(log::LogSink& sink, MonotonicTime start) noexcept { log_.log_to(sink, start); }
  void run(core::SlotId slot, core::LaneExecutive& lane) noexcept override {
    system_.flight_program().run(slot, lane);
    if (slot == core::SlotId::kPublish) see(lane.release());
  }
  /// What it is like at the end of this frame.
  void see(MonotonicTime frame) noexcept {
    flight::FlightControl& control = system_.control();
    seen_.frame.store(frame, std::memory_order_relaxed);
    seen_.action.store(system_.pilot().action(), std::memory_order_relaxed);
    seen_.phase.store(system_.pilot().phase(), std::memory_order_relaxed);
    seen_.landed.store(control.landed(), std::memory_order_relaxed);
    seen_.flying.store(control.flying(), std::memory_order_relaxed);
    seen_.descending.store(control.descending(), std::memory_order_relaxed);
    if (const firmware_if::Autopilot* const autopilot = aircraft_.autopilot()) {
      const firmware_if::AutopilotReport report = autopilot->report();
      seen_.stage.store(report.stage, std::memory_order_relaxed);
      seen_.armed.store(report.armed, std::memory_order_relaxed);
    }
    log_.frame_done(system_, frame, aircraft_.autopilot() == nullptr);
    stages::EstimatedState state;
    if (control.estimator().state(state) != Status::kOk) return;
    if (control.flying()) distance_m_ += (state.p_WB - last_W_).norm();
    last_W_ = state.p_WB;
    const Vector3 p_W = state.p_WB + state.shift_W;
    seen_.distance_m.store(distance_m_, std::memory_order_relaxed);
    seen_.speed_mps.store(state.v_WB.norm(), std::memory_order_relaxed);
    seen_.x_m.store(p_W.x(), std::memory_order_relaxed);
    seen_.y_m.store(p_W.y(), std::memory_order_relaxed);
    seen_.z_m.store(p_W.z(), std::memory_order_relaxed);
  }

 private:
  flight::FlightSystem& system_;
  flight::Aircraft& aircraft_;
  Seen& seen_;
  mission::LaneLog log_;
  double distance_m_{0.0};
  Vector3 last_W_ = Vector3::Zero();
};

/// The decision lane, what is seen of it, and what it says to the log.
class SeenDecisions final : public core::LaneProgram {
 public:
  SeenDecisions(flight::FlightSystem& system, Seen& seen)
      : system_(system), program_(system.decision_program()), seen_(seen) {}
  /// Before the lanes start. Times of the log count from `start`.
  void log_to(log::LogSink& sink, MonotonicTime start, const PrecisionLattice& lattice) noexcept {
    log_.log_to(sink, start, lattice);
  }
  void run(core::SlotId slot, core::LaneExecutive& lane) noexcept override {
    program_.run(slot, lane);
    if (slot == core::SlotId::kGather || slot == core::SlotId::kHandOver) see();
    if (slot == core::SlotId::kHandOver)
      log_.handed_over(system_, lane.release(), {seen_.x_m.load(), seen_.y_m.load(), seen_.z_m.load()},
                       seen_.speed_mps.load());
  }
  void see() noexcept {
    seen_.decisions.store(program_.decisions(), std::memory_order_relaxed);
    seen_.no_way.store(program_.has_no_way(), std::memory_order_relaxed);
    seen_.goal_blocked.store(program_.is_goal_blocked(), std::memory_order_relaxed);
  }

 private:
  flight::FlightSystem& system_;
  flight::DecisionProgram& program_;
  Seen& seen_;
  mission::DecisionLog log_;
};

/// Nothing is rendered here.
class Idle final : public core::LaneProgram {
 public:
  void run(core::SlotId, core::LaneExecutive&) noexcept override {}
};

}  // namespace roborun::live
