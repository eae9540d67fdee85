/// The physics under ArduPilot's `--model JSON`: servo packets in, the vehicle's true state out. Source: ArduPilot,
/// libraries/SITL/examples/JSON/readme.md.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "platform/live/physics_link.hpp"
#include "platform/mavlink/link.hpp"
#include "platform/rt/monotonic_clock.hpp"
#include "platform/sitl/vehicle/vehicle.hpp"

namespace roborun::live {

struct ServoPacket {
  std::uint32_t frame{};  ///< Rises by one with each packet; begins anew when ArduPilot does.
  PhysicsStep step{};
};

/// 40 bytes (16 servos) or 72 (32), magic number, a rate of 50 Hz at least. Nothing: it is none. Motors of a quad X: 1 front right,
/// 2 rear left, 3 front left, 4 rear right; 1,000 to 2,000 us, 0: off. Thrust = 0.35 u + 0.65 u^2 of the throttle u, which is what
/// ArduCopter's MOT_THST_EXPO counts on.
[[nodiscard]] std::optional<ServoPacket> servo_packet(std::span<const std::uint8_t> bytes) noexcept;

/// One line of compact JSON between two line ends: north, east, down from the world's origin, body forward, right, down.
[[nodiscard]] std::string state_line(double time_s, const sitl::VehicleState& state);

/// One answer for each packet. The same number again: its answer was lost, and it has the same one again. Missing numbers are
/// counted, and are no steps: ArduPilot waited too. A lower number: it restarted. Stamps begin at zero with each start of it:
/// it takes the time from its zero to the first stamp, where that is less than 0.1 s, for the step, and asks for that rate from then on.
class ArduPilotPhysics final : public PhysicsLink {
 public:
  explicit ArduPilotPhysics(int port);
  [[nodiscard]] std::optional<PhysicsStep> wait() override;
  void answer(sitl::SimulatedPlant& plant) override;
  [[nodiscard]] int port() const noexcept { return link_.local_port(); }

 private:
  /// Nothing: no step.
  [[nodiscard]] std::optional<PhysicsStep> take(std::span<const std::uint8_t> bytes);
  void send();

  rt::MonotonicClock clock_;
  mavlink::Link link_;
  std::array<std::uint8_t, 2048> bytes_{};
  std::optional<std::uint32_t> frame_;
  Nanos time_{};  ///< Of its steps, since it started.
  std::string answer_;
};

}  // namespace roborun::live
