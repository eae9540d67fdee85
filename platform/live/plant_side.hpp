/// What of a plant speaks with the runtime: sensors and bus behind ports, or an autopilot behind MAVLink.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/sensor_rig.hpp"
#include "platform/can/socket_can.hpp"
#include "platform/live/sim_line.hpp"
#include "platform/mavlink/link.hpp"
#include "platform/mavlink/signed_end.hpp"
#include "platform/mission/autopilot_choice.hpp"
#include "platform/sensor_port/port_names.hpp"
#include "platform/sensor_port/port_navigation.hpp"
#include "platform/sitl/aircraft/simulated_aircraft.hpp"

namespace roborun::live {

/// Who flies the plant's vehicle, where that is not the runtime itself.
struct PlantAutopilot {
  mission::AutopilotKind kind{mission::AutopilotKind::kPx4};
  mavlink::LinkAddress link{};
  std::optional<firmware_if::mavlink::SecretKey> key{};  ///< Of both directions; none: nothing is signed.
  std::optional<double> pilot_s{};  ///< So long after it left the ground its pilot takes over, and lands.
};

/// How it stood with it at the end.
struct PlantAutopilotReport {
  std::string mode;
  bool armed{};
  std::uint64_t set_points{}, refused_set_points{}, timeouts{}, releases{};
  std::uint64_t lost_frames{}, doubled_frames{};  ///< Of the runtime, by their sequence numbers.
};

/// The package as it left the hook.
struct PlantPackage {
  double height_m{};  ///< Above the ground.
  double speed_mps{};
};

/// One thread. Nothing blocks.
class PlantSide {
 public:
  virtual ~PlantSide() = default;
  /// Before a minor frame of the world: what the runtime sent. `clock_now`: time as it passes, also where the world stood
  /// still. True: something came.
  virtual bool hear(MonotonicTime clock_now) = 0;
  /// After it. Stamps on the world's clock become CLOCK_MONOTONIC by `shift`.
  virtual void tell(MonotonicTime clock_now, Nanos shift) = 0;
  /// A few times a second: looks for what is to be listened to.
  virtual void listen() {}
  virtual void left_ground(MonotonicTime clock_now) { (void)clock_now; }
  [[nodiscard]] virtual std::uint64_t commands() const = 0;
  [[nodiscard]] virtual std::uint64_t lost() const = 0;  ///< Of what was sent to it.
  [[nodiscard]] virtual std::optional<PlantAutopilotReport> autopilot() const { return std::nullopt; }
  [[nodiscard]] virtual std::optional<PlantPackage> package() const { return std::nullopt; }
};

/// IMU, receiver and barometer are nodes on the bus, and an operator proves the kill switch and arms.
struct PlantBus {
  std::string interface;  ///< Of the kernel; empty: the bus is made of ports.
  /// The pulls of two gpio-sim lines, the kill switch's normally open and normally closed contact; empty: the port of lines has them.
  std::vector<std::string> kill_pulls;
};

/// What `on_bus` names of the kernel; null: nothing.
struct KernelEnds {
  std::unique_ptr<can::SocketCan> bus;
  std::unique_ptr<SimLine> kill_open, kill_closed;
};
/// Before any port is made: what is refused leaves none. Throws InputError.
[[nodiscard]] KernelEnds kernel_ends(const std::optional<PlantBus>& on_bus);
/// Ports of `names`; the world's origin is at `origin`. `body` outlives it. Throws InputError.
[[nodiscard]] std::unique_ptr<PlantSide> port_side(sitl::SimulatedAircraft& body, const SensorRig& rig,
                                                   const sensor_port::VehiclePorts& names,
                                                   const sensor_port::EarthPlace& origin,
                                                   const std::optional<PlantBus>& on_bus, KernelEnds kernel);
/// A fake autopilot, which steps `body`'s motors.
[[nodiscard]] std::unique_ptr<PlantSide> autopilot_side(sitl::SimulatedAircraft& body,
                                                        const VehicleModel& vehicle, Nanos minor_frame,
                                                        const PlantAutopilot& config,
                                                        const sensor_port::EarthPlace& origin);

}  // namespace roborun::live
