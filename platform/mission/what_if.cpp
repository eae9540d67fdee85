#include "platform/mission/what_if.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "platform/flight/flight_system.hpp"
#include "platform/input/arguments.hpp"
#include "platform/input/input_error.hpp"
#include "platform/mission/replay.hpp"
#include "platform/mission/setting_change.hpp"

namespace roborun::mission {
namespace {

constexpr const char* kFactor = "cpu.slow_down_factor";
constexpr const char* kTimeLimit = "flight.time_limit_s";
constexpr const char* kGoal = "goal";

constexpr std::array<const char*, kRecordKinds> kNames{
    "instant",         "inertial sample",  "satellite fix", "barometer value",
    "odometry sample", "state of health",  "depth image",   "LiDAR sweep",
    "goals",           "giving up",        "motor command", "motors off",
    "decision",        "end of the flight"};

void give_goal(MissionConfig& config, const flight::FlightConfig& logged, double at_s,
               const std::string& text) {
  const std::vector<std::string> parts = input::split(text);
  Vector3 p_W = Vector3::Zero();
  bool ok = parts.size() == 3;
  for (std::size_t i = 0; ok && i < 3; ++i) {
    const auto value = input::number(parts[i]);
    ok = value.has_value();
    if (ok) p_W[static_cast<Eigen::Index>(i)] = *value;
  }
  if (!ok) throw InputError(fmt::format("--what-if: goal: '{}': must be X,Y,Z in metres", text));
  const double room_m = planned_radius_m(logged.vehicle);
  if (!logged.bounds_W.contains(p_W) || !logged.fence.allows(Aabb::around(p_W, room_m)))
    throw InputError(
        fmt::format("--what-if: goal: {}: must be inside the flight's bounds and its fence", text));
  const auto after = std::upper_bound(config.goals.begin(), config.goals.end(), at_s,
                                      [](double t_s, const GivenGoals& given) { return t_s < given.at_s; });
  config.goals.insert(after, GivenGoals{at_s, {p_W}});
}

}  // namespace

std::string keys_in_flight() {
  std::string all;
  for (const GovernorKey& key : kGovernorKeys) all += std::string(key.key) + ", ";
  return all + fmt::format("{}, {}, {}", kFactor, kTimeLimit, kGoal);
}

namespace {

void change_one(MissionConfig& config, const flight::FlightConfig& logged, double at_s,
                const std::string& setting) {
  const std::size_t equals = setting.find('=');
  if (equals == std::string::npos)
    throw InputError(fmt::format("--what-if: '{}': must be KEY=VALUE", setting));
  const std::string key = setting.substr(0, equals);
  const std::string text = setting.substr(equals + 1);
  if (key == kGoal) return give_goal(config, logged, at_s, text);
  if (key == kTimeLimit) {
    config.judge.time_limit_s = input::number_of("--what-if: flight.time_limit_s", text, at_s, 100000.0);
    return;
  }
  if (key == kFactor) {
    if (std::isfinite(config.slow_down.at_s))
      throw InputError(fmt::format(
          "--what-if: {}: must be given once, and not in a flight that was slowed down itself", kFactor));
    config.slow_down = {at_s, input::number_of("--what-if: cpu.slow_down_factor", text, 0.1, 100.0)};
    return;
  }
  if (std::none_of(kGovernorKeys.begin(), kGovernorKeys.end(),
                   [&key](const GovernorKey& known) { return key == known.key; }))
    throw InputError(
        fmt::format("--what-if: '{}' does not change in flight: must be {}", key, keys_in_flight()));
  if (logged.design != governor::Design::kAware)
    throw InputError(fmt::format("--what-if: {}: must be a flight of the design aware: {} decides nothing",
                                 key, governor::to_string(logged.design)));
  for (const auto& [known, value] : config.change.to)
    if (known == key) throw InputError(fmt::format("--what-if: {}: must be given once", key));
  config.change.at_s = at_s;
  config.change.to.emplace_back(key, input::number_of(("--what-if: " + key).c_str(), text, -1e9, 1e9));
}

}  // namespace

void change_in_flight(MissionConfig& config, const flight::FlightConfig& logged, double at_s,
                      const std::vector<std::string>& settings) {
  for (const std::string& setting : settings) change_one(config, logged, at_s, setting);
  if (config.change.empty()) return;
  try {  // all together: each alone may go with none of the logged ones
    (void)changed(flight::governor_config(logged), config.change);
  } catch (const InputError& error) {
    throw InputError(fmt::format("--what-if: {}", error.what()));
  }
}

void fly_as_recorded(MissionConfig& config, const RecordedFlight& recorded) {
  config.seed = recorded.flight.seed;
  config.flight.design = recorded.flight.design;
  config.flight.minor_frame = recorded.flight.minor_frame;
  config.backends.map = recorded.backends.map;
  config.backends.planner = recorded.backends.planner;
}

std::optional<std::string> first_difference(const std::string& logged, const std::string& flown,
                                            double until_s) {
  Recording a(logged);
  Recording b(flown);
  double time_s = 0.0;
  for (std::uint64_t frame = 0; a.kind() != RecordKind::kEnd; a.next(), b.next()) {
    if (a.kind() == RecordKind::kFrame) {
      MonotonicTime now;
      each_field(GetField(a.payload()), now);
      time_s = seconds(now.time_since_epoch());
      if (time_s >= until_s) return std::nullopt;
      ++frame;
    }
    if (a.kind() == b.kind() && a.payload() == b.payload()) continue;
    const auto name = [](const Recording& of) { return kNames[static_cast<std::size_t>(of.kind())]; };
    return fmt::format("first in minor frame {}, at {:.4f} s: {}", frame, time_s,
                       a.kind() == b.kind() ? fmt::format("{}: another one", name(a))
                                            : fmt::format("{} in the place of {}", name(b), name(a)));
  }
  return std::nullopt;
}

}  // namespace roborun::mission
