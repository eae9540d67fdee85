/// World, physics and sensors as a process of its own, on real time. What flies in it is another process, at the far end of sensor ports.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>

#include "platform/live/physics_link.hpp"
#include "platform/live/plant_side.hpp"
#include "platform/mission/mission_config.hpp"
#include "platform/sensor_port/port_navigation.hpp"

namespace roborun::live {

struct PlantConfig {
  mission::MissionConfig mission{};                            ///< Vehicle, sensors, wind, seed.
  std::string port;                                            ///< As of sensor_port::VehiclePorts.
  sensor_port::EarthPlace origin{47.397742, 8.545594, 488.0};  ///< Of the world's (0, 0, 0).
  std::optional<PlantAutopilot> autopilot{};                   ///< None: the runtime has sensors and motors.
  std::optional<PlantBus> on_bus{};                            ///< None: its sensors are ports.
  std::optional<PlantPhysics>
      physics{};  ///< A real autopilot flies it, and steps the world; without `autopilot`.
  bool pictures{
      true};  ///< False: depth images and clouds are made by another process (live::feed_pictures()).
  double seconds{std::numeric_limits<double>::infinity()};
  std::function<bool()> stop{};  ///< Asked forty times a second; may be empty.
};

struct PlantReport {
  /// From the first word of the runtime on the bus (under a real autopilot: from leaving the ground) to the goal, or to the end;
  /// without it: from the start to the end.
  double time_s{};
  double distance_m{};  ///< Flown.
  bool collided{};
  std::optional<double>
      least_clearance_m{};      ///< Of the vehicle's centre, once it had taken off; at most kClearanceCap_m.
  bool reached_goal{};          ///< Within 1 m and slower than 0.5 m/s, in truth.
  std::uint64_t frames_sent{};  ///< Depth images and clouds.
  /// How often the plant itself was wrong: it stood still for more than 100 ms because it was not let run, pictures or bus frames
  /// were lost.
  std::uint64_t faults{};
  double stood_still_s{};
  std::uint64_t commands{};  ///< Frames heard on the bus, set-points, or steps of a real autopilot.
  double speed_mps{};        ///< At the end.
  std::size_t injected{};    ///< Faults of a scenario that began.
  std::optional<PlantAutopilotReport> autopilot{};
  std::optional<PlantPackage> package{};  ///< None: it hangs on the hook, or there is none.
  std::optional<PhysicsCounters> physics{};
  /// "collision", "landed" (on the ground again, motors off), "time_limit" or "interrupted".
  std::string reason;
};

inline constexpr double kClearanceCap_m = 10.0;

struct PlantProgress {
  double time_s{};  ///< Since the start.
  bool is_heard{};  ///< The runtime is there, or a real autopilot.
  Vector3 p_WB = Vector3::Zero();
  double speed_mps{};
};

/// Runs until what reports.reason says. `ready` is called once the ports are there; `progress` about four times a second; both may be
/// empty. Throws InputError for what flight_config_of() refuses, and for ports that cannot be made.
[[nodiscard]] PlantReport run_plant(const sitl::World& world, const PlantConfig& config,
                                    const std::function<void()>& ready,
                                    const std::function<void(const PlantProgress&)>& progress);

}  // namespace roborun::live
