/// The simulated plant as an aircraft of the runtime, in one process: with the vehicle's own side of the motors' bus.
#pragma once

#include "platform/flight/actuator_side.hpp"
#include "platform/flight/aircraft.hpp"
#include "platform/sitl/aircraft/simulated_plant.hpp"

namespace roborun::sitl {

class SimulatedAircraft final : public flight::Aircraft {
 public:
  /// As SimulatedPlant.
  SimulatedAircraft(const VehicleModel& vehicle, const SimulatorConfig& config, const Vector3& ground_W,
                    std::uint64_t seed, Nanos minor_frame, ExposureSink& cameras,
                    const OutsideActuators& outside = {})
      : plant_(vehicle, config, ground_W, seed, minor_frame, cameras, outside),
        actuators_(minor_frame, plant_.far_side().bus(), plant_.far_side().kill_open(),
                   plant_.far_side().kill_closed()) {}

  void connect(const FaultLine& line) noexcept { plant_.connect(line); }
  void stand_in(const World& world) noexcept { plant_.stand_in(world); }
  /// A twin for tests: the kill switch has no effect.
  void ignore_kill_switch() noexcept { actuators_.ignore_kill_switch(); }

  void start(MonotonicTime now) noexcept { plant_.start(now); }
  /// The world moves on in whole minor frames until `now`: more than one after frames that slipped, at most
  /// 40 a call.
  void begin_frame(MonotonicTime now) noexcept override {
    for (int i = 0; i < 40 && plant_.now() < now; ++i) plant_.step();
  }
  [[nodiscard]] firmware_if::Imu& imu() noexcept override { return plant_.sensors(); }
  [[nodiscard]] firmware_if::Gnss& gnss() noexcept override { return plant_.sensors(); }
  [[nodiscard]] firmware_if::Barometer& barometer() noexcept override { return plant_.sensors(); }
  [[nodiscard]] firmware_if::Odometry* odometry() noexcept override {
    return plant_.has_odometry() ? &plant_.sensors() : nullptr;
  }
  [[nodiscard]] firmware_if::Motors& motors() noexcept override { return actuators_; }
  [[nodiscard]] flight::AircraftHealth health(MonotonicTime now) noexcept override {
    return {actuators_.charge_ratio(now), actuators_.esc_silence(now), plant_.hears_operator(),
            actuators_.kill_switch().killed()};
  }
  void terminate() noexcept override { actuators_.terminate(); }
  void disarm() noexcept override { actuators_.disarm(); }
  void end_frame(MonotonicTime now) noexcept override {
    plant_.far_side().break_lines(now);
    actuators_.step(now);
  }

  [[nodiscard]] SimulatedPlant& plant() noexcept { return plant_; }
  [[nodiscard]] const Vehicle& vehicle() const noexcept { return plant_.vehicle(); }
  [[nodiscard]] const flight::ActuatorSide& actuators() const noexcept { return actuators_; }
  [[nodiscard]] const SimulatedActuators& far_side() const noexcept { return plant_.far_side(); }
  void set_mean_wind(const Vector3& mean_W_mps) noexcept { plant_.set_mean_wind(mean_W_mps); }

 private:
  SimulatedPlant plant_;
  flight::ActuatorSide actuators_;
};

}  // namespace roborun::sitl
