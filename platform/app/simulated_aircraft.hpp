/// Vehicle, motors' bus and navigation sensors of a simulated flight, and who takes pictures on the way.
#pragma once

#include "platform/app/actuator_link.hpp"
#include "platform/app/aircraft.hpp"
#include "platform/app/mission.hpp"
#include "platform/sitl/fault/faulty_sensors.hpp"
#include "platform/sitl/vehicle/vehicle.hpp"

namespace roborun::app {

/// Told the true pose once a minor frame. Contract: expose() neither blocks nor allocates.
class ExposureSink {
 public:
  virtual ~ExposureSink() = default;
  virtual void expose(MonotonicTime now, const Pose& X_WB) noexcept = 0;
};

class SimulatedAircraft final : public Aircraft {
 public:
  /// On the ground below the start of `world`, which must outlive it as `cameras` and what is `real` must.
  SimulatedAircraft(const sitl::World& world, const MissionConfig& config, ExposureSink& cameras,
                    const RealActuators& real = {})
      : vehicle_(config.vehicle, config.wind, Vector3(world.start_W().x(), world.start_W().y(), 0.0),
                 config.seed),
        sensors_(sitl::NavigationSensors(config.sensors, config.seed)),
        cameras_(cameras),
        actuators_(config.seed, config.minor_frame, real),
        minor_frame_(config.minor_frame) {
    if (!config.answers) actuators_.ignore_kill_switch();
  }

  /// All that can fail is connected to the line, which must outlive the aircraft.
  void connect(const sitl::FaultLine& line) noexcept {
    faults_ = &line;
    sensors_.connect(&line);
    actuators_.connect(&line);
  }

  /// Its time begins here.
  void start(MonotonicTime now) noexcept { now_ = now; }
  /// The world moves on in whole minor frames until `now`: more than one after frames that slipped, at most
  /// 40 a call.
  void begin_frame(MonotonicTime now) noexcept override {
    for (int i = 0; i < 40 && now_ < now; ++i) {
      // What was sent at the end of a minor frame reaches the motors in the middle of the next one: four
      // throttles are on the bus for 0.13 ms, and an ESC has a cycle of its own.
      vehicle_.step(minor_frame_ / 2);
      actuators_.advance(now_ + minor_frame_ / 2, vehicle_.state().battery_ratio, vehicle_);
      vehicle_.step(minor_frame_ / 2);
      now_ += minor_frame_;
      sensors_.sample(now_, vehicle_.state());
      cameras_.expose(now_, vehicle_.X_WB());
    }
  }
  [[nodiscard]] firmware_if::Imu& imu() noexcept override { return sensors_; }
  [[nodiscard]] firmware_if::Gnss& gnss() noexcept override { return sensors_; }
  [[nodiscard]] firmware_if::Barometer& barometer() noexcept override { return sensors_; }
  [[nodiscard]] firmware_if::Motors& motors() noexcept override { return actuators_; }
  [[nodiscard]] AircraftHealth health(MonotonicTime now) noexcept override {
    return {actuators_.charge_ratio(now), actuators_.esc_silence(now), hears_operator(),
            actuators_.kill_switch().killed()};
  }
  void terminate() noexcept override { actuators_.terminate(); }
  void disarm() noexcept override { actuators_.disarm(); }
  void end_frame(MonotonicTime now) noexcept override { actuators_.step(now); }

  [[nodiscard]] const sitl::Vehicle& vehicle() const noexcept { return vehicle_; }
  [[nodiscard]] const ActuatorLink& actuators() const noexcept { return actuators_; }
  void set_mean_wind(const Vector3& mean_W_mps) noexcept { vehicle_.set_mean_wind(mean_W_mps); }

 private:
  [[nodiscard]] sitl::FaultKind fault_of(sitl::Component component) const noexcept {
    return faults_ != nullptr ? faults_->of(component) : sitl::FaultKind::kNone;
  }
  /// The simulator's operator always is heard, unless the link has a fault.
  [[nodiscard]] bool hears_operator() const noexcept {
    const sitl::FaultKind kind = fault_of(sitl::Component::kLink);
    return kind == sitl::FaultKind::kNone ||
           (kind == sitl::FaultKind::kIntermittent && now_.time_since_epoch() / minor_frame_ % 2 == 0);
  }

  sitl::Vehicle vehicle_;
  sitl::FaultySensors sensors_;
  ExposureSink& cameras_;
  ActuatorLink actuators_;
  Nanos minor_frame_;
  MonotonicTime now_{};
  const sitl::FaultLine* faults_{nullptr};
};

}  // namespace roborun::app
