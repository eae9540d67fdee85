/// The configuration of a recorded flight, as JSON at the beginning of its recording.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "firmware_if/depth_camera.hpp"
#include "platform/board/backends.hpp"
#include "platform/flight/flight_config.hpp"
#include "platform/mission/mission_config.hpp"

namespace roborun::mission {

/// All that a replay needs besides the recorded inputs.
struct RecordedFlight {
  flight::FlightConfig flight{};
  board::BackendNames backends{};
  SlowDown slow_down{};
  SensorRig sensors{};
  std::vector<firmware_if::CameraMount> mounts{};        ///< One per camera, as the device gave it.
  std::vector<firmware_if::CameraMount> lidar_mounts{};  ///< One per LiDAR.
};

[[nodiscard]] std::string to_json(const RecordedFlight& recorded);
/// Throws InputError, or another std::exception that says what is wrong.
[[nodiscard]] RecordedFlight recorded_flight_from(std::span<const std::byte> json);

}  // namespace roborun::mission
