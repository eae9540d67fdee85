/// The sensors of a vehicle in its file: tables [[camera]] and [[lidar]].
#pragma once

#include <optional>

#include "core/sensor_rig.hpp"
#include "platform/input/toml_reader.hpp"

namespace roborun::vehicle {

/// Each table has every key of kCameraKeys or kLidarKeys but those of its place (x_m .. roll_deg), which are 0 where
/// they are missing. None if the file has no such table. Throws InputError with file, line, key and range.
[[nodiscard]] std::optional<SensorRig> read_rig(const input::TomlReader& reader, const toml::table& root);

}  // namespace roborun::vehicle
