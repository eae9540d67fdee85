/// The failsafe of a flight: conditions to one action, once a minor frame, and the action flown.
#pragma once

#include <atomic>
#include <span>

#include "core/geometry/fence.hpp"
#include "core/memory/static_vector.hpp"
#include "core/vehicle_model.hpp"
#include "governor/failsafe/arbiter.hpp"
#include "platform/flight/aircraft.hpp"
#include "platform/flight/failsafe_monitor.hpp"
#include "platform/flight/flight_control.hpp"
#include "platform/flight/lane_mail.hpp"

namespace roborun::flight {

/// What the arbiter decided, and when.
struct FailsafeEvent {
  MonotonicTime time{};
  governor::Action action{};
  governor::ConditionSet conditions{};
  governor::Phase phase{};      ///< In which it was decided.
  std::uint8_t depth_sensor{};  ///< DecisionReport, where Condition::kDepth holds.
  stages::FrameFault depth_fault{};
};

/// Belongs to the flight lane's thread. RT-safe: O(1), no allocation.
class FailsafePilot {
 public:
  struct Config {
    VehicleModel vehicle{};
    core::Fence fence{};
    bool answers{true};  ///< False: conditions are seen and recorded, and nothing is done. For tests alone.
  };
  FailsafePilot(const Config& config, FlightControl& control, Aircraft& aircraft) noexcept;

  /// Judges one minor frame: `decision` is the newest report of the decision lane.
  void guard(MonotonicTime now, const DecisionReport& decision) noexcept;

  /// Down, at the nearest place that is known to be free, as if a condition asked for it; on the ground: stay. For good; any thread.
  void ask_to_land() noexcept { asked_down_.store(true, std::memory_order_relaxed); }

  [[nodiscard]] governor::Phase phase() const noexcept { return phase_; }
  [[nodiscard]] governor::Action action() const noexcept { return action_; }
  /// Of the newest frame: AircraftHealth::battery_ratio.
  [[nodiscard]] double battery_ratio() const noexcept { return battery_ratio_; }
  [[nodiscard]] MonotonicTime action_since() const noexcept { return action_since_; }
  /// One for each change of the action; in the air at most five, because none is taken back.
  [[nodiscard]] std::span<const FailsafeEvent> events() const noexcept {
    return {events_.begin(), events_.size()};
  }
  /// The descent was over space known to be free.
  [[nodiscard]] bool site_was_known() const noexcept { return site_was_known_; }

 private:
  [[nodiscard]] FailsafeMeasures measure(MonotonicTime now, const DecisionReport& decision) noexcept;
  void begin(governor::Action action, MonotonicTime now) noexcept;
  void come_home(MonotonicTime now) noexcept;
  void land(MonotonicTime now, const DecisionReport& decision) noexcept;

  Config config_;
  double lost_tilt_cos_;  ///< Tilted by more, the control loop has lost the vehicle.
  FlightControl& control_;
  Aircraft& aircraft_;
  FailsafeMonitor monitor_;
  governor::Phase phase_{governor::Phase::kGround};
  governor::Action action_{governor::Action::kGoOn};
  governor::ConditionSet conditions_{0};
  double battery_ratio_{0.0};
  std::uint8_t depth_sensor_{0};
  stages::FrameFault depth_fault_{};
  core::StaticVector<FailsafeEvent, 2 * governor::kActionCount> events_;
  MonotonicTime operator_heard_{};
  MonotonicTime action_since_{};
  bool site_was_known_{false};
  bool came_up_here_{false};  ///< It lands out of its climb: what is below it is where it came from.
  std::atomic<bool> asked_down_{false};
};

}  // namespace roborun::flight
