#include "platform/app/config_command.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "core/sensor_rig.hpp"
#include "platform/app/exit_code.hpp"
#include "platform/input/key_text.hpp"
#include "platform/mission/settings_file.hpp"
#include "platform/sitl/world/world_file.hpp"
#include "platform/vehicle/vehicle_file.hpp"

namespace roborun::app {
namespace {

nlohmann::ordered_json json_of(const std::vector<input::KeyText>& keys) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const input::KeyText& k : keys)
    list.push_back({{"table", k.table},
                    {"key", k.key},
                    {"unit", input::unit_of(k.key)},
                    {"low", k.low},
                    {"high", k.high},
                    {"default", k.value},
                    {"text", k.text}});
  return list;
}

nlohmann::ordered_json json_of(const std::vector<sitl::WorldKey>& keys) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const sitl::WorldKey& k : keys)
    list.push_back({{"table", k.table},
                    {"key", k.key},
                    {"form", k.form},
                    {"default", k.fallback ? nlohmann::ordered_json(*k.fallback) : nullptr},
                    {"text", k.text}});
  return list;
}

std::string reference_of(const std::vector<sitl::WorldKey>& keys) {
  std::string text;
  std::string_view table;
  for (const sitl::WorldKey& k : keys) {
    if (k.table != table) {
      text += k.table == "world" ? std::string("[world]\n") : fmt::format("\n[[{}]]\n", k.table);
      table = k.table;
    }
    const std::string line = fmt::format("  {:<8} {:<28} {:>6}  {}", k.key, k.form,
                                         k.fallback ? fmt::format("{:g}", *k.fallback) : "needed", k.text);
    text += line.substr(0, line.find_last_not_of(' ') + 1) + '\n';
  }
  return text;
}

int config(bool json) {
  const auto settings = mission::settings_keys();
  const auto vehicle = vehicle::vehicle_keys();
  const auto world = sitl::world_keys();
  if (json) {
    nlohmann::ordered_json j = {
        {"settings", json_of(settings)}, {"vehicle", json_of(vehicle)}, {"world", json_of(world)}};
    fmt::print("{}\n", j.dump());
    return kDone;
  }
  fmt::print(
      "# Settings of a simulated mission: --settings FILE. Every key may be left out.\n"
      "# key, unit, range, default, meaning\n\n{}\n"
      "Besides: [wind] mean_mps = [x, y, z], at most 20 m/s (default 1.5, 1, 0); [flight] aim = NAME,\n"
      "time (default) or energy: no faster than what spends least per metre; [fence] altitude_m = [low, "
      "high],\n"
      "keep_in and keep_out = [{{ polygon = [[x, y], ...] }}, {{ circle = [x, y, radius] }}]; the models of "
      "all sensors "
      "of a kind,\n"
      "as below: [camera], [lidar], [imu], [gnss] and [odometry] model = NAME.\n\n",
      input::reference_of(settings));
  fmt::print(
      "# Vehicles: --vehicle FILE. No key may be left out; the numbers shown as defaults are those of "
      "`paper`,\n"
      "# and of a camera and a LiDAR that are not its own. One [[camera]] or [[lidar]] per sensor.\n\n{}\n"
      "Besides: [vehicle] name, about; [stopping] quadratic_s2pm, linear_s, constant_m, where the stop was "
      "measured;\n"
      "[[lidar]] pattern = FILE, a line \"azimuth_deg elevation_deg\" per direction. Which errors the "
      "simulator gives a "
      "sensor:\n"
      "model = NAME, default clean; [[camera]] {}, with invalid_ratio from 0 to {:g} (default {:g});\n"
      "[[lidar]] {}; [imu] {}; [gnss] {}; [odometry] {} (default none).\n",
      input::reference_of(vehicle), fmt::join(kCameraModels, ", "), kMostInvalid, CameraSpec{}.invalid_ratio,
      fmt::join(kLidarModels, ", "), fmt::join(kImuModels, ", "), fmt::join(kGnssModels, ", "),
      fmt::join(kOdometryModels, ", "));
  fmt::print(
      "\n# Worlds: --world FILE.toml (or an OctoMap .bt, .ot: every leaf that it calls occupied is solid; "
      "without "
      "--start and\n"
      "# --goal the mission flies between the roomiest places near its two ends). x east, y north, z up; the "
      "ground is "
      "z = 0.\n"
      "# All numbers at most 20,000. At most 100,000 [[pillar]], 100,000 [[box]] and 1,000 [[body]].\n"
      "# key, how it is written, default, meaning\n\n{}",
      reference_of(world));
  return kDone;
}

}  // namespace

void add_config_command(CLI::App& app, std::function<int()>& run) {
  const auto json = std::make_shared<bool>(false);
  CLI::App* command = app.add_subcommand(
      "config", "Every key of settings, vehicle and world files, with unit, range, default and meaning");
  command->footer("Examples:\n  roborun config\n  roborun config --json\n\nExit code: 0.");
  command->add_flag("--json", *json, "One JSON object on standard output, nothing else");
  command->callback([json, &run] { run = [json] { return config(*json); }; });
}

}  // namespace roborun::app
