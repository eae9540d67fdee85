/// A real autopilot as what flies the plant's vehicle: it hands over throttles, is told what its sensors feel, and its packets are the
/// world's clock (lock-step).
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>

#include "firmware_if/motors.hpp"
#include "platform/mission/autopilot_choice.hpp"
#include "platform/sensor_port/port_navigation.hpp"
#include "platform/sitl/aircraft/simulated_plant.hpp"

namespace roborun::live {

/// Which simulator link of which autopilot; on this machine alone (127.0.0.1).
struct PlantPhysics {
  mission::AutopilotKind kind{mission::AutopilotKind::kArduCopter};
  int port{};  ///< ArduCopter: UDP; PX4: TCP.
};
inline constexpr int kArduPilotPort = 9002;
inline constexpr int kPx4Port = 4560;

/// How it stood with it. Never decrease.
struct PhysicsCounters {
  std::uint64_t steps{};   ///< Of the world.
  std::uint64_t lost{};    ///< Packets that are missing between two others.
  std::uint64_t resent{};  ///< Answered again, without a step; PX4: steps without an answer within a second.
  std::uint64_t
      restarts{};  ///< It began anew. Its motors are off then: in the air the vehicle falls, as a real one does.
  std::uint64_t refused{};  ///< Was no packet of it.
};

struct PhysicsStep {
  Nanos dt{};
  firmware_if::MotorCommand motors{};
};

/// One thread.
class PhysicsLink {
 public:
  static constexpr std::chrono::milliseconds kPatience{25};
  virtual ~PhysicsLink() = default;
  /// What the world has to do next; waits for it, at most kPatience. Nothing: the world stands still.
  [[nodiscard]] virtual std::optional<PhysicsStep> wait() = 0;
  /// After that step.
  virtual void answer(sitl::SimulatedPlant& plant) = 0;
  [[nodiscard]] const PhysicsCounters& counters() const noexcept { return counters_; }

 protected:
  PhysicsCounters counters_{};
};

/// Throws InputError where the port is taken.
[[nodiscard]] std::unique_ptr<PhysicsLink> physics_link(const PlantPhysics& physics,
                                                        const sensor_port::EarthPlace& origin);

}  // namespace roborun::live
