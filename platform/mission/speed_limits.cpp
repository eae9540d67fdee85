#include "platform/mission/speed_limits.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "core/geometry/math.hpp"
#include "governor/policy/governor.hpp"
#include "platform/flight/flight_system.hpp"

namespace roborun::mission {
namespace {

/// What the stop follows from, as stopping_model() makes it.
std::string stop_text(const VehicleModel& v) {
  if (v.measured_stopping) return "the stop of [stopping]";
  const FollowedLimits followed = followed_limits(v);
  const bool by_tilt = followed.acceleration_mps2 < v.acceleration_mps2;
  const bool by_lag = followed.jerk_mps3 < v.jerk_mps3;
  return fmt::format("a stop with {:.1f} m/s2 ({}) and {:.0f} m/s3 ({})", followed.acceleration_mps2,
                     by_tilt ? "tilt_rad" : "acceleration_mps2", followed.jerk_mps3,
                     by_lag ? "motor_lag_s" : "jerk_mps3");
}

}  // namespace

const SpeedLimit& SpeedLimits::lowest() const {
  return *std::min_element(always.begin(), always.end(), [](const SpeedLimit& a, const SpeedLimit& b) {
    return a.speed_mps < b.speed_mps;
  });
}

SpeedLimits speed_limits(const flight::FlightConfig& config) {
  const VehicleModel& v = config.vehicle;
  const governor::GovernorConfig g = flight::governor_config(config);
  const governor::Governor governor(g);
  const double shortest_s = seconds(g.policy.shortest), longest_s = seconds(g.policy.longest);
  const double visible_m = config.camera_range_m - planned_radius_m(v);
  SpeedLimits r;
  r.always = {
      {"file", governor.v_max_mps(), "limits.speed_mps"},
      {"sight", governor.safe_speed_mps(visible_m, shortest_s),
       fmt::format("{:.0f} m of range, {}, decisions of {:.1f} s ({:.1f} m/s without)", config.camera_range_m,
                   stop_text(v), shortest_s, governor.safe_speed_mps(visible_m, 0.0))},
      {"drag", level_speed_mps(v),
       fmt::format("[drag] against tilt_rad, {:.0f} degrees", v.tilt_rad * 180.0 / core::kPi)},
  };
  const double open_mps = r.lowest().speed_mps;
  const auto add = [&](const char* name, double speed_mps, const std::string& why) {
    const SpeedLimit limit{name, std::min(speed_mps, open_mps), why};
    r.where.push_back(limit);
  };
  governor::Situation situation;
  situation.distance_to_goal_m = std::numeric_limits<double>::infinity();
  const auto limit_mps = [&](bool governor::Situation::*what) {
    governor::Situation there = situation;
    there.*what = true;
    return governor.speed_limit(there, shortest_s).speed_mps;
  };
  add("slow-decisions", governor.safe_speed_mps(visible_m, longest_s),
      fmt::format("decisions take {:.1f} s", longest_s));
  if (config.pixels_per_tan > 0.0)
    add("thin", limit_mps(&governor::Situation::thin),
        fmt::format("thin things are seen: thinnest_m {:g}, {:.0f} pixels per unit of tangent", v.thinnest_m,
                    config.pixels_per_tan));
  add("motion", limit_mps(&governor::Situation::motion), "something moves nearby");
  situation.distance_to_goal_m = 0.0;
  add("goal", governor.speed_limit(situation, shortest_s).speed_mps,
      fmt::format("the goal is nearer than {:.0f} m", g.policy.near_goal_m));
  return r;
}

}  // namespace roborun::mission
