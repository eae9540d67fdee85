#include "core/vehicle_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/geometry/math.hpp"

namespace roborun {
namespace {

constexpr double kLeastThrust_ratio = 1.2;  // below it there is no thrust left to tilt with in wind
constexpr double kLeastBraking_mps2 = 0.2;

constexpr double kUsable = 0.8;

/// Of the acceleration at the tilt limit, what is left along the motion, against drag.
double left_mps2(const VehicleModel& v, double speed_mps) noexcept {
  return kUsable * (tilt_acceleration_mps2(v) - drag_mps2(v, speed_mps));
}

/// The same across the motion. Drag has no part in it, and brakes with it.
double across_mps2(const VehicleModel& v) noexcept {
  const double tilt_mps2 = tilt_acceleration_mps2(v), drag = drag_mps2(v, v.speed_mps);
  return kUsable * std::sqrt(std::max(tilt_mps2 * tilt_mps2 - drag * drag, 0.0));
}

}  // namespace

FollowedLimits followed_limits(const VehicleModel& v) noexcept {
  constexpr double kBehind_mps2 = 0.6;
  return {std::clamp(across_mps2(v), kLeastBraking_mps2, v.acceleration_mps2),
          std::min(v.jerk_mps3, kBehind_mps2 / v.motor_lag_s)};
}

double level_speed_mps(const VehicleModel& v) noexcept {
  // (linear + quadratic v) v = force; as 2 c / (b + sqrt(...)), which holds without quadratic drag, too.
  const double force_N = v.mass_kg * (tilt_acceleration_mps2(v) - kLeastBraking_mps2 / kUsable);
  if (!(force_N > 0.0)) return 0.0;
  const double linear = v.drag_linear_Nspm;
  const double root = std::sqrt(linear * linear + 4.0 * v.drag_quadratic_Ns2pm2 * force_N);
  return linear + root > 0.0 ? 2.0 * force_N / (linear + root) : std::numeric_limits<double>::infinity();
}

double speeding_up_mps2(const VehicleModel& v, double speed_mps) noexcept {
  return std::clamp(left_mps2(v, speed_mps), kLeastBraking_mps2, v.acceleration_mps2);
}

StoppingModel stopping_model(const VehicleModel& v) noexcept {
  if (v.measured_stopping) return *v.measured_stopping;
  const auto [acceleration_mps2, jerk_mps3] = followed_limits(v);
  return {0.5 / acceleration_mps2, 0.5 * acceleration_mps2 / jerk_mps3 + v.motor_lag_s, v.tracking_error_m};
}

double tilt_acceleration_mps2(const VehicleModel& v) noexcept {
  const core::SinCos tilt = core::sin_cos(v.tilt_rad);
  return core::kGravity_mps2 * tilt.sin / tilt.cos;
}

double thrust_to_weight_ratio(const VehicleModel& v) noexcept {
  return 4.0 * v.max_thrust_N / (v.mass_kg * core::kGravity_mps2);
}

double drag_mps2(const VehicleModel& v, double speed_mps) noexcept {
  return (v.drag_linear_Nspm + v.drag_quadratic_Ns2pm2 * speed_mps) * speed_mps / v.mass_kg;
}

const char* cannot_fly(const VehicleModel& v, double visible_m) noexcept {
  if (thrust_to_weight_ratio(v) < kLeastThrust_ratio)
    return "cannot hover: four times propulsion.max_thrust_N must be at least 1.2 times its weight";
  if (v.acceleration_mps2 > tilt_acceleration_mps2(v))
    return "limits.acceleration_mps2 is more than its tilt gives: must be at most g tan(limits.tilt_rad)";
  const core::SinCos tilt = core::sin_cos(v.tilt_rad);
  if (thrust_to_weight_ratio(v) * tilt.cos < 1.0)
    return "cannot hold its height at limits.tilt_rad: must have thrust-to-weight of at least 1 / cos(tilt)";
  if (v.speed_mps > level_speed_mps(v))
    return "cannot fly as fast as limits.speed_mps: its drag there must be below g tan(limits.tilt_rad)";
  // Not as slowly as the slowest useful flight: as fast as its limit says is a question of the world.
  constexpr double kSlow_mps = 0.5;
  if (stopping_model(v).distance_m(kSlow_mps) + planned_radius_m(v) >= visible_m)
    return "cannot stop within what it sees: at 0.5 m/s its stop and its radius must be below the shortest "
           "range";
  return nullptr;
}

}  // namespace roborun
