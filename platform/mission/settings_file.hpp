/// Vehicle, sensors and wind of a simulated mission from a TOML file.
#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "platform/input/key_text.hpp"
#include "platform/input/toml_reader.hpp"
#include "platform/mission/mission.hpp"

namespace roborun::mission {

/// The numbers of settings_keys(); [camera], [lidar], [imu], [gnss] and [odometry] model = NAME (core/sensor_model.hpp), for all of the vehicle; [wind] mean_mps = [x, y, z]; [flight] aim = NAME; [fence] altitude_m = [low, high], keep_in and keep_out, arrays of { polygon = [[x, y], ...] } or { circle = [x, y, radius] }. What is
/// not there keeps its default. Throws InputError with file, line, key and range.
void load_settings(const std::string& path, MissionConfig& config);

/// The same from a file that holds other tables too.
inline const std::set<std::string_view> kSettingsTables{
    "camera", "lidar", "imu", "gnss", "odometry", "wind", "rain", "battery", "flight", "cpu", "fog", "fence"};
void read_settings(const input::TomlReader& reader, const toml::table& root, MissionConfig& config);
/// Every number of a settings file.
[[nodiscard]] std::vector<input::KeyText> settings_keys();

}  // namespace roborun::mission
