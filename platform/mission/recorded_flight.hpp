/// The configuration of a flight, as JSON in its log.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware_if/depth_camera.hpp"
#include "firmware_if/lidar.hpp"
#include "platform/board/backends.hpp"
#include "platform/flight/flight_config.hpp"
#include "platform/log/flight_log.hpp"
#include "platform/mission/mission_config.hpp"

namespace roborun::mission {

/// All that a replay needs besides the recorded inputs.
struct RecordedFlight {
  flight::FlightConfig flight{};
  board::BackendNames backends{};
  SlowDown slow_down{};
  SettingChange change{};
  SensorRig sensors{};
  std::vector<firmware_if::CameraMount> mounts{};        ///< One per camera, as the device gave it.
  std::vector<firmware_if::CameraMount> lidar_mounts{};  ///< One per LiDAR.
};

/// Of a flight with these devices.
[[nodiscard]] RecordedFlight recorded_flight_of(const flight::FlightConfig& flight,
                                                const MissionConfig& config,
                                                std::span<firmware_if::DepthCamera* const> cameras,
                                                std::span<firmware_if::Lidar* const> lidars);
[[nodiscard]] std::string to_json(const RecordedFlight& recorded);
/// The first messages of a log: build, configuration. `why_not`: as of why_not_replayed(). `source`: as in MissionConfig.
void begin_log(log::FlightLog& log, const RecordedFlight& recorded, const std::string& why_not,
               const std::string& profile = {}, const std::optional<Vector3>& start_W = {},
               const std::string& source = {});
/// Throws InputError, or another std::exception that says what is wrong.
[[nodiscard]] RecordedFlight recorded_flight_from(std::string_view json);

}  // namespace roborun::mission
