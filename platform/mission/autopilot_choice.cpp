#include "platform/mission/autopilot_choice.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "platform/input/input_error.hpp"

namespace roborun::mission {
namespace {

// Of what the autopilot follows at most: the rest is for wind and for what its loops have to correct.
constexpr double kShare = 0.9;
constexpr double kLink_s = 0.03;  // both ways, and half a period of the set-points

/// How far an autopilot's loops are from the reference, on plans of this speed: what six vehicles of 2 to 20 m/s were seen to need
/// with both between two pillars, and a reserve; in a maze two slow ones needed 0.06 m more (README). The errors of a vehicle file are those of our own loops.
double error_m(double speed_mps) noexcept {
  constexpr double kLeast_m = 0.18, kBehind_s = 0.055, kMost_m = 0.6;
  return std::min(kLeast_m + kBehind_s * speed_mps, kMost_m);
}

/// At no speed up to `fastest_mps` shorter than either; both begin with the same constant. Of two such models the one with the
/// smaller mean: more constant on top of the first, or the chord over the larger of both d/v, which is convex in v.
StoppingModel longer_of(const StoppingModel& a, const StoppingModel& b, double fastest_mps) noexcept {
  const auto mean_m = [fastest_mps](const StoppingModel& m) {
    return m.constant_m + m.linear_s * fastest_mps / 2.0 + m.quadratic_s2pm * fastest_mps * fastest_mps / 3.0;
  };
  StoppingModel raised = a;
  const double more_s = b.linear_s - a.linear_s;
  const double more_s2pm = b.quadratic_s2pm - a.quadratic_s2pm;
  const double worst_mps =
      more_s2pm < 0.0 ? std::clamp(-0.5 * more_s / more_s2pm, 0.0, fastest_mps) : fastest_mps;
  raised.constant_m += std::max(more_s * worst_mps + more_s2pm * worst_mps * worst_mps, 0.0);
  StoppingModel chord = a;
  chord.linear_s = std::max(a.linear_s, b.linear_s);
  const double end_s =
      std::max(a.linear_s + a.quadratic_s2pm * fastest_mps, b.linear_s + b.quadratic_s2pm * fastest_mps);
  chord.quadratic_s2pm = (end_s - chord.linear_s) / fastest_mps;
  return mean_m(raised) < mean_m(chord) ? raised : chord;
}

}  // namespace

std::optional<AutopilotKind> autopilot_of(const char* option, const std::string& name) {
  if (name == "none") return std::nullopt;
  for (const AutopilotKind kind : {AutopilotKind::kPx4, AutopilotKind::kArduCopter})
    if (name == to_string(kind)) return kind;
  throw InputError(fmt::format("{}: unknown autopilot '{}': must be px4, arducopter or none", option, name));
}

const char* to_string(AutopilotKind kind) noexcept {
  return kind == AutopilotKind::kPx4 ? "px4" : "arducopter";
}

VehicleModel as_flown_by(const VehicleModel& vehicle, const firmware_if::AutopilotLimits& limits) noexcept {
  VehicleModel flown = vehicle;
  flown.speed_mps = std::min(vehicle.speed_mps, limits.speed_mps);
  flown.acceleration_mps2 = std::min(vehicle.acceleration_mps2, kShare * limits.acceleration_mps2);
  // A larger error is for the autopilot's own loops: trajectories are no harder to follow than without it.
  flown.jerk_mps3 = std::min(followed_limits(vehicle).jerk_mps3, kShare * limits.jerk_mps3);
  flown.climb_mps = std::min(vehicle.climb_mps, limits.climb_mps);
  flown.descent_mps = std::min(vehicle.descent_mps, limits.descent_mps);
  flown.tracking_error_m = std::max(vehicle.tracking_error_m, error_m(flown.speed_mps));
  if (vehicle.slow_error_m > 0.0)
    flown.slow_error_m = std::max(vehicle.slow_error_m, error_m(vehicle.slow_speed_mps));
  flown.measured_stopping.reset();
  const StoppingModel planned = stopping_model(flown);
  const StoppingModel silent{
      0.5 / limits.stop_mps2,
      limits.silence_s + limits.delay_s + kLink_s + 0.5 * limits.stop_mps2 / limits.stop_jerk_mps3,
      planned.constant_m};
  flown.measured_stopping = longer_of(planned, silent, flown.speed_mps);
  return flown;
}

firmware_if::mavlink::Companion::Config companion_config(const AutopilotChoice& choice,
                                                         const VehicleModel& vehicle) noexcept {
  auto config = firmware_if::mavlink::Companion::config_for(choice.kind);
  config.may_arm = true;
  config.may_tune = choice.tuned;
  if (!choice.tuned) return config;
  // Documented ranges: WPNAV_ACCEL to 5 m/s2, PSC_JERK_XY to 20 m/s3; MPC_ACC_HOR to 15, MPC_JERK_AUTO to 80.
  const bool is_px4 = choice.kind == AutopilotKind::kPx4;
  firmware_if::AutopilotLimits& planned = config.planned;
  planned.stop_mps2 = std::clamp(vehicle.acceleration_mps2 / kShare, planned.stop_mps2, is_px4 ? 15.0 : 5.0);
  planned.stop_jerk_mps3 =
      std::clamp(vehicle.jerk_mps3 / kShare, planned.stop_jerk_mps3, is_px4 ? 80.0 : 20.0);
  if (is_px4) return config;
  planned.acceleration_mps2 = planned.stop_mps2;
  planned.jerk_mps3 = planned.stop_jerk_mps3;
  return config;
}

}  // namespace roborun::mission
