/// From what the flight lane has at hand to the conditions of the failsafe arbiter: one table of thresholds.
#pragma once

#include <array>

#include "firmware_if/time.hpp"
#include "governor/failsafe/arbiter.hpp"

namespace roborun::flight {

/// What is compared. Each grows as things get worse; NaN counts as too large.
struct FailsafeMeasures {
  double battery_used_ratio{};  ///< NaN: the battery's monitor says nothing usable.
  double outside_fence{};       ///< 1 if the estimated position is not permitted.
  double
      position_age_s{};  ///< Of the newest fix, or odometry, that the filter took and that differs from the one before.
  double depth_age_s{};           ///< Of the newest usable image of the camera that is worst off.
  double esc_silence_s{};         ///< Of the ESC that is worst off.
  double link_silence_s{};        ///< Since the operator was last heard.
  double tracking_error_ratio{};  ///< Distance from the reference over what plans keep free.
  double planner_failures{};      ///< Decisions in a row without a usable answer.
  double decision_late_s{};       ///< After the instant when the decision lane wanted to be back.
  double map_refusals{};          ///< Decisions in a row in which the map refused new bricks.
  double control_lost{};          ///< 1: no or stuck IMU samples, or tilted by far more than the limit.
  double killed{};                ///< 1: the kill switch has killed.
};

struct FailsafeThreshold {
  governor::Condition condition;
  double FailsafeMeasures::*measure;
  double limit;  ///< The condition holds above it ...
  double for_s;  ///< ... for so long without a break.
};

// clang-format off
inline constexpr std::array<FailsafeThreshold, 13> kFailsafeThresholds = [] {
  using C = governor::Condition;
  using M = FailsafeMeasures;
  return std::array<FailsafeThreshold, 13>{{
    {C::kBatteryLow,      &M::battery_used_ratio, 0.75, 1.0},   // the way home plus a reserve of 10 %; lost counts as low
    {C::kBatteryCritical, &M::battery_used_ratio, 0.90, 1.0},   // 3 min of hovering: a landing takes 20 s
    {C::kFence,           &M::outside_fence,      0.5,  0.2},   // plans keep radius and tracking error away from it
    {C::kGnss,            &M::position_age_s,     1.0,  0.0},   // ten fixes; inertial drift by then is below 0.2 m
    {C::kDepth,           &M::depth_age_s,        0.5,  0.5},   // ten images, and it stays so
    {C::kCanTelemetry,    &M::esc_silence_s,      0.5,  0.0},   // five of its status messages
    {C::kLink,            &M::link_silence_s,     2.0,  0.0},
    {C::kWind,            &M::tracking_error_ratio, 1.0,  0.5},   // outside of the box that plans keep free
    {C::kPlanner,         &M::planner_failures,   6.0, 16.0},   // six in a row are seen in good flights, fast boards fail five times a second; "no way" is an answer
    {C::kPlanner,         &M::decision_late_s,    5.0,  0.0},   // it stands at the end of its trajectory by then
    {C::kMap,             &M::map_refusals,       2.5,  0.0},
    {C::kWatchdog,        &M::control_lost,       0.5,  0.1},   // beyond what the controller ever asks for
    {C::kKill,            &M::killed,             0.5,  0.0},   // the switch has its own filter of two samples
  }};
}();
// clang-format on

/// RT-safe: O(thresholds), no allocation.
class FailsafeMonitor {
 public:
  /// Once a minor frame. A battery that says nothing is low, not critical.
  [[nodiscard]] governor::ConditionSet step(MonotonicTime now, const FailsafeMeasures& measures) noexcept;

 private:
  std::array<MonotonicTime, kFailsafeThresholds.size()> fine_{};  ///< When it last was not above its limit.
};

}  // namespace roborun::flight
