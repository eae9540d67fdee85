/// A vehicle in a TOML file: what it is, and what follows from it.
#pragma once

#include <optional>
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
  std::optional<SensorRig> rig{};  ///< None: six cameras, the simulator's.
};

/// Tables [vehicle] name, about; [body], [propulsion], [drag], [power], [limits] with every key of
/// kVehicleKeys: nothing about a vehicle is assumed; [stopping] (quadratic_s2pm, linear_s, constant_m) where
/// it has been measured; [[camera]] and [[lidar]] (rig_tables.hpp). Throws InputError with file, line, key and what would be right, also for a vehicle
/// that cannot fly.
[[nodiscard]] Vehicle vehicle_from_toml(const std::string& path, const std::string& text);
/// A shipped vehicle by its name, or one of a file. Throws InputError.
[[nodiscard]] Vehicle load_vehicle(const std::string& name_or_path);
/// Names of the shipped vehicles, `paper` first.
[[nodiscard]] std::vector<std::string> shipped_vehicles();
/// Every key of a vehicle file.
[[nodiscard]] std::vector<input::KeyText> vehicle_keys();

}  // namespace roborun::vehicle
