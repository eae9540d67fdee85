/// A vehicle in a TOML file: what it is, and what follows from it.
#pragma once

#include <string>
#include <vector>

#include "core/sensor_rig.hpp"
#include "core/vehicle_model.hpp"
#include "platform/input/key_text.hpp"

namespace roborun::vehicle {

struct Vehicle {
  std::string name;
  std::string about;   ///< One line.
  std::string digest;  ///< Of the file's text, 16 hexadecimal digits.
  VehicleModel model{};
  SensorRig rig{};
  /// By LiDAR of the rig: path of the file with its directions, or empty: rings.
  std::vector<std::string> patterns{};
};

/// Tables [vehicle] name, about; [body], [propulsion], [drag], [power], [limits] with every key of
/// kVehicleKeys: nothing about a vehicle is assumed; [stopping] (quadratic_s2pm, linear_s, constant_m) where
/// it has been measured; one [[camera]] or [[lidar]] per sensor, with every key of kCameraKeys or kLidarKeys
/// but those of the mount, which are 0 where they are not there (and `pattern = FILE`: a line "azimuth_deg elevation_deg" per direction, instead of rings).
/// `model` says which errors the simulator gives a sensor (core/sensor_model.hpp), in each [[camera]] and [[lidar]], and in the tables [imu] and
/// [gnss]; without it: `clean`. A camera of another model may have `invalid_ratio`. Throws InputError with file, line, key and what would be right, also for a vehicle
/// that cannot fly.
[[nodiscard]] Vehicle vehicle_from_toml(const std::string& path, const std::string& text);
/// A shipped vehicle by its name, or one of a file. NAME-six is a shipped vehicle that has six cameras of 90 x 90 degrees
/// and 96 x 96 pixels all round in the place of its sensors, which else are as its first camera. NAME-MODEL, with
/// a model besides clean of core/sensor_model.hpp (paper-d455), is one whose cameras have that product's errors; NAME-six-MODEL both. Throws InputError.
[[nodiscard]] Vehicle load_vehicle(const std::string& name_or_path);
/// True if load_vehicle takes it from the program, not from a file.
[[nodiscard]] bool ships(const std::string& name);
/// Names of the shipped vehicles, `paper` first.
[[nodiscard]] std::vector<std::string> shipped_vehicles();
/// Every key of a vehicle file; a sensor's in the tables "[camera]" and "[lidar]".
[[nodiscard]] std::vector<input::KeyText> vehicle_keys();

}  // namespace roborun::vehicle
