#include "platform/mission/recorded_flight.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "platform/flight/flight_system.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/json_reader.hpp"
#include "platform/report/build_identity.hpp"

namespace roborun::mission {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint32_t kVersion = 8;
constexpr double kFarthest_m = 20e3;  // as in world files

Json vector_json(const Vector3& v) { return {v.x(), v.y(), v.z()}; }

Json fence_json(const core::Fence& fence) {
  Json j = {{"areas", Json::array()}};
  if (fence.limits_altitude()) j["altitude_m"] = {fence.lowest_m(), fence.highest_m()};
  for (const core::Fence::Area& area : fence.areas()) {
    Json points = Json::array();
    for (std::size_t i = 0; i < area.count; ++i) points.push_back({area.point[i].x_m, area.point[i].y_m});
    j["areas"].push_back({{"keep_in", area.side == core::FenceSide::kKeepIn},
                          {"radius_m", area.radius_m},
                          {"points", std::move(points)}});
  }
  return j;
}

/// Throws InputError or Json::exception.
double number(const Json& json, const char* key, double least, double most) {
  const double value = json.at(key).get<double>();
  if (!(value >= least && value <= most))
    throw InputError(fmt::format("{}: {} is not within {} and {}", key, value, least, most));
  return value;
}
Vector3 vector(const Json& json, const char* key) {
  const auto v = json.at(key).get<std::array<double, 3>>();
  return {v[0], v[1], v[2]};
}
template <std::size_t N>
void numbers(const Json& json, const char* key, std::array<double, N>& to) {
  to = json.at(key).get<std::array<double, N>>();
  for (const double x : to) {
    if (!(x >= 0.0 && x <= 1e6)) throw InputError(fmt::format("{}: {} is not within 0 and 1e6", key, x));
  }
}

core::Fence read_fence(const Json& json) {
  core::Fence fence;
  const auto check = [](core::FenceFault fault) {
    if (fault != core::FenceFault::kNone) throw InputError(fmt::format("fence: {}", core::to_string(fault)));
  };
  if (json.contains("altitude_m")) {
    const auto v = json.at("altitude_m").get<std::array<double, 2>>();
    check(fence.set_altitude(v[0], v[1]));
  }
  for (const Json& area : json.at("areas")) {
    const core::FenceSide side =
        area.at("keep_in").get<bool>() ? core::FenceSide::kKeepIn : core::FenceSide::kKeepOut;
    std::vector<core::FencePoint> points;
    for (const auto& p : area.at("points").get<std::vector<std::array<double, 2>>>())
      points.push_back({p[0], p[1]});
    const double radius_m = area.at("radius_m").get<double>();
    check(radius_m > 0.0 && points.size() == 1 ? fence.add_circle(side, points.front(), radius_m)
                                               : fence.add_polygon(side, points));
  }
  return fence;
}

Vector3 place(const Json& json, const char* key) {
  Vector3 p_W = vector(json, key);
  if (!is_finite(p_W) || p_W.cwiseAbs().maxCoeff() > kFarthest_m)
    throw InputError(fmt::format("{}: not within {} m", key, kFarthest_m));
  return p_W;
}

VehicleModel read_vehicle(const Json& json) {
  VehicleModel vehicle;
  for (const VehicleKey& key : kVehicleKeys)
    vehicle.*key.value = key.left_out && !json.at(key.table).contains(key.key)
                             ? *key.left_out
                             : number(json.at(key.table), key.key, key.low, key.high);
  vehicle.measured_stopping.reset();
  if (json.contains("stopping")) {
    const Json& stopping = json.at("stopping");
    vehicle.measured_stopping =
        StoppingModel{number(stopping, "quadratic_s2pm", 0, 10), number(stopping, "linear_s", 0, 10),
                      number(stopping, "constant_m", -10, 10)};
  }
  return vehicle;
}

Json vehicle_json(const VehicleModel& vehicle) {
  Json j;
  for (const VehicleKey& key : kVehicleKeys) j[key.table][key.key] = vehicle.*key.value;
  if (const auto& stopping = vehicle.measured_stopping)
    j["stopping"] = {{"quadratic_s2pm", stopping->quadratic_s2pm},
                     {"linear_s", stopping->linear_s},
                     {"constant_m", stopping->constant_m}};
  return j;
}

template <class Sensors>
Json sensors_json(const Sensors& sensors) {
  Json list = Json::array();
  for (const auto& sensor : sensors) {
    Json one;
    for (const auto& key : keys_of(sensor)) one[key.key] = key.get(sensor);
    if (sensor.model != decltype(sensor.model){}) one["model"] = to_string(sensor.model);
    list.push_back(std::move(one));
  }
  return list;
}

template <class Spec, std::size_t N>
void read_sensors(const Json& list, core::StaticVector<Spec, N>& sensors) {
  for (const Json& one : list) {
    Spec spec;
    for (const SensorKey<Spec>& key : keys_of(spec)) key.set(spec, number(one, key.key, key.low, key.high));
    using Model = decltype(spec.model);
    const auto model = model_of<Model>(one.value("model", to_string(Model{})));
    if (!model) throw InputError("model: no name of a sensor model");
    spec.model = *model;
    if (!sensors.push_back(spec)) throw InputError(fmt::format("must be at most {} sensors of a kind", N));
  }
}

Json mounts_json(const std::vector<firmware_if::CameraMount>& mounts) {
  Json list = Json::array();
  for (const firmware_if::CameraMount& mount : mounts)
    list.push_back({{"R_BC", mount.R_BC}, {"p_BC_m", mount.p_BC_m}});
  return list;
}

std::vector<firmware_if::CameraMount> read_mounts(const Json& json, const char* key, std::size_t count) {
  std::vector<firmware_if::CameraMount> mounts;
  for (const Json& mount : json.at(key))
    mounts.push_back(
        {mount.at("R_BC").get<std::array<double, 9>>(), mount.at("p_BC_m").get<std::array<double, 3>>()});
  if (mounts.size() != count) throw InputError(fmt::format("{}: must be {}, one per sensor", key, count));
  return mounts;
}

}  // namespace

RecordedFlight recorded_flight_of(const flight::FlightConfig& flight, const MissionConfig& config,
                                  std::span<firmware_if::DepthCamera* const> cameras,
                                  std::span<firmware_if::Lidar* const> lidars) {
  RecordedFlight recorded{
      flight, config.backends, config.slow_down, config.change, sitl::rig_of(config.simulator), {}, {}};
  for (const firmware_if::DepthCamera* camera : cameras) recorded.mounts.push_back(camera->mount());
  for (const firmware_if::Lidar* lidar : lidars) recorded.lidar_mounts.push_back(lidar->mount());
  return recorded;
}

std::string to_json(const RecordedFlight& recorded) {
  const flight::FlightConfig& flight = recorded.flight;
  Json j;
  j["roborun_recording"] = kVersion;
  j["vehicle"] = vehicle_json(flight.vehicle);
  j["min_W"] = vector_json(flight.bounds_W.min_W);
  j["max_W"] = vector_json(flight.bounds_W.max_W);
  j["goal_W"] = vector_json(flight.goal_W);
  j["cruise_m"] = flight.cruise_m;
  j["design"] = governor::to_string(flight.design);
  if (flight.aim != governor::Aim::kTime) j["aim"] = governor::to_string(flight.aim);
  j["seed"] = flight.seed;
  j["map"] = recorded.backends.map;
  j["planner"] = recorded.backends.planner;
  j["minor_frame_ns"] = flight.minor_frame.count();
  j["cameras"] = sensors_json(recorded.sensors.cameras);
  j["lidars"] = sensors_json(recorded.sensors.lidars);
  for (std::size_t i = 0; i < recorded.sensors.cameras.size(); ++i)
    j["depth_errors"].push_back({flight.depth_error[i].constant_m, flight.depth_error[i].quadratic_per_m});
  const flight::GazeConfig& gaze = flight.gaze;
  j["gaze"] = {{"yaw_rate_radps", gaze.yaw_rate_radps}, {"stuck_s", gaze.stuck_s}, {"lead_s", gaze.lead_s}};
  if (std::isfinite(recorded.slow_down.at_s)) {
    j["slow_down_at_s"] = recorded.slow_down.at_s;
    j["slow_down_factor"] = recorded.slow_down.factor;
  }
  if (!recorded.change.empty()) {
    j["changed_at_s"] = recorded.change.at_s;
    for (const auto& [key, value] : recorded.change.to) j["changed"].push_back({key, value});
  }
  j["answers"] = flight.answers;
  j["fence"] = fence_json(flight.fence);
  j["mounts"] = mounts_json(recorded.mounts);
  j["lidar_mounts"] = mounts_json(recorded.lidar_mounts);
  for (const core::StageCost& c : flight.costs.stage)
    j["costs"].push_back({{"fixed_s", c.fixed_s}, {"per_unit_s", c.per_unit_s}, {"per_m3_s", c.per_m3_s}});
  for (const governor::LatencyModel& m : flight.model)
    j["models"].push_back({{"fixed_s", m.fixed_s}, {"slope_s_per_m3", m.slope_s_per_m3}});
  return j.dump();
}

void begin_log(log::FlightLog& log, const RecordedFlight& recorded, const std::string& why_not,
               const std::string& profile, const std::optional<Vector3>& start_W, const std::string& source) {
  const report::BuildIdentity build = report::build_identity();
  const log::StringMap identity{{"commit", std::string(build.commit)},
                                {"compiler", std::string(build.compiler)},
                                {"flags", std::string(build.flags)}};
  Json json = {{"build", identity}, {"profile", profile}, {"replay", why_not}};
  if (start_W) json["start_m"] = vector_json(*start_W);
  if (!source.empty()) json["source"] = Json::parse(source);
  json["flight"] = Json::parse(to_json(recorded));
  log.configure(json.dump(), identity);
}

RecordedFlight recorded_flight_from(std::string_view json) {
  const Json j = input::parse_json(json);
  if (j.at("roborun_recording") != kVersion) throw InputError("of another version");
  RecordedFlight recorded;
  flight::FlightConfig& flight = recorded.flight;
  flight.vehicle = read_vehicle(j.at("vehicle"));
  flight.bounds_W = {place(j, "min_W"), place(j, "max_W")};
  if (!((flight.bounds_W.size().array() > 0.0).all())) throw InputError("max_W: must be above min_W");
  flight.goal_W = place(j, "goal_W");
  flight.cruise_m = number(j, "cruise_m", -kFarthest_m, kFarthest_m);
  flight.design = design_of("design", j.at("design").get<std::string>());
  flight.aim = aim_of("aim", j.value("aim", governor::to_string(governor::Aim::kTime)));
  flight.seed = j.at("seed").get<std::uint64_t>();
  recorded.backends = {j.at("map").get<std::string>(), j.at("planner").get<std::string>()};
  // A file that came from elsewhere does not choose what code is loaded.
  if (uses_plugin(recorded.backends)) throw InputError("map, planner: must not be plugins");
  flight.minor_frame = Nanos{j.at("minor_frame_ns").get<std::int64_t>()};
  const auto rate_Hz = static_cast<int>(1e9 / number(j, "minor_frame_ns", 1e6, 1e9));
  if (!core::is_flight_rate(rate_Hz) || core::minor_frame_of(rate_Hz) != flight.minor_frame)
    throw InputError("minor_frame_ns: no rate of the flight lane");
  read_sensors(j.at("cameras"), recorded.sensors.cameras);
  read_sensors(j.at("lidars"), recorded.sensors.lidars);
  if (const auto fault = first_fault(recorded.sensors))
    throw InputError(fmt::format("{} {}: {}: {}", fault->sensor, fault->index, fault->key, fault->text));
  describe_sensors(recorded.sensors, flight);
  for (std::size_t i = 0; j.contains("depth_errors") && i < recorded.sensors.cameras.size(); ++i) {
    flight.depth_error[i].constant_m = j.at("depth_errors").at(i).at(0).get<double>();
    flight.depth_error[i].quadratic_per_m = j.at("depth_errors").at(i).at(1).get<double>();
  }
  const Json& gaze = j.at("gaze");
  flight.gaze.yaw_rate_radps = number(gaze, "yaw_rate_radps", 0.01, 3);
  flight.gaze.stuck_s = number(gaze, "stuck_s", 0, 1e6);
  flight.gaze.lead_s = number(gaze, "lead_s", 0, 100);
  if (j.contains("slow_down_at_s"))
    recorded.slow_down = {number(j, "slow_down_at_s", 0, 1e6), number(j, "slow_down_factor", 0.001, 1000)};
  if (j.contains("changed_at_s")) {
    recorded.change.at_s = number(j, "changed_at_s", 0, 1e6);
    recorded.change.to = j.at("changed").get<std::vector<std::pair<std::string, double>>>();
  }
  flight.answers = j.at("answers").get<bool>();
  flight.fence = read_fence(j.at("fence"));
  recorded.mounts = read_mounts(j, "mounts", recorded.sensors.cameras.size());
  recorded.lidar_mounts = read_mounts(j, "lidar_mounts", recorded.sensors.lidars.size());
  for (std::size_t i = 0; i < core::kStageCount; ++i) {
    const Json& c = j.at("costs").at(i);
    numbers(c, "fixed_s", flight.costs.stage[i].fixed_s);
    flight.costs.stage[i].per_unit_s = number(c, "per_unit_s", 0, 1e6);
    numbers(c, "per_m3_s", flight.costs.stage[i].per_m3_s);
  }
  for (std::size_t i = 0; i < flight.model.size(); ++i) {
    numbers(j.at("models").at(i), "fixed_s", flight.model[i].fixed_s);
    numbers(j.at("models").at(i), "slope_s_per_m3", flight.model[i].slope_s_per_m3);
  }
  (void)changed(flight::governor_config(flight), recorded.change);
  return recorded;
}

}  // namespace roborun::mission
