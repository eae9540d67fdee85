/// The physics under PX4's simulator link: HIL_SENSOR and HIL_GPS out, HIL_ACTUATOR_CONTROLS in, over TCP. Source: PX4,
/// docs/en/simulation/index.md; src/modules/simulation/simulator_mavlink.
#pragma once

#include <cstdint>

#include "core/random/counter_rng.hpp"
#include "firmware_if/mavlink/receiver.hpp"
#include "firmware_if/mavlink/simulator_messages.hpp"
#include "platform/live/physics_link.hpp"
#include "platform/rt/monotonic_clock.hpp"

namespace roborun::live {

/// Motors of a quad X: 1 front right, 2 rear left, 3 front left, 4 rear right; thrust is the control itself, which is what PX4's
/// THR_MDL_FAC of 0 counts on. Zero where the vehicle is not armed; a control that is no number stops its motor.
[[nodiscard]] firmware_if::MotorCommand motors_of(
    const firmware_if::mavlink::HilActuatorControls& message) noexcept;

/// We are the server, for one client at a time. PX4 has no pace of its own: 250 steps a second at most, each after the answer to the
/// one before. Two exceptions: until the first answer PX4 boots, and steps follow the clock; and after a second without an answer one
/// more is made, for PX4's clock stands still too. A client that goes and one that comes is a restart.
class Px4Physics final : public PhysicsLink {
 public:
  static constexpr Nanos kPeriod{4'000'000};

  Px4Physics(int port, const sensor_port::EarthPlace& origin);
  ~Px4Physics() override;
  Px4Physics(const Px4Physics&) = delete;
  Px4Physics& operator=(const Px4Physics&) = delete;
  [[nodiscard]] std::optional<PhysicsStep> wait() override;
  void answer(sitl::SimulatedPlant& plant) override;

 private:
  [[nodiscard]] bool greet();
  void hear();
  void take(std::span<const std::uint8_t> bytes);
  void hang_up();
  [[nodiscard]] PhysicsStep step(MonotonicTime now);
  template <typename T>
  void send(const T& message);
  [[nodiscard]] firmware_if::mavlink::HilSensor feel(sitl::SimulatedPlant& plant);
  [[nodiscard]] firmware_if::mavlink::HilGps fix_of(const firmware_if::GnssFix& fix) const;

  rt::MonotonicClock clock_;
  sensor_port::EarthPlace origin_;
  sensor_port::LocalFrame frame_;
  Vector3 field_W_gauss_;
  core::CounterRng rng_{1, 40};
  int server_{-1}, client_{-1};
  firmware_if::mavlink::Receiver receiver_;
  firmware_if::MotorCommand motors_{};
  bool is_answered_{false};
  bool is_booting_{true};
  bool had_client_{false};
  MonotonicTime due_{}, sent_at_{};
  std::uint8_t seq_{0};
};

}  // namespace roborun::live
