/// Vehicle, motors' bus and navigation sensors of a simulated flight, and who takes pictures on the way.
#pragma once

#include <limits>

#include "core/executive/frame_table.hpp"
#include "platform/app/actuator_link.hpp"
#include "platform/sitl/fault/faulty_sensors.hpp"
#include "platform/sitl/vehicle/vehicle.hpp"

namespace roborun::app {

/// Told the true pose once a minor frame. Contract: expose() neither blocks nor allocates.
class ExposureSink {
 public:
  virtual ~ExposureSink() = default;
  virtual void expose(MonotonicTime now, const Pose& X_WB) noexcept = 0;
};

struct SimulatedAircraft {
  sitl::Vehicle vehicle;
  sitl::FaultySensors sensors;
  ExposureSink& cameras;
  ActuatorLink actuators;
  MonotonicTime now{};
  const sitl::FaultLine* faults{nullptr};
  double last_battery_ratio{1.0};

  /// All that can fail is connected to the line, which must outlive the aircraft.
  void connect(const sitl::FaultLine& line) noexcept {
    faults = &line;
    sensors.connect(&line);
    actuators.connect(&line);
  }
  /// What the battery's monitor says; NaN: nothing usable.
  [[nodiscard]] double battery_ratio() noexcept {
    switch (faults != nullptr ? faults->of(sitl::Component::kBattery) : sitl::FaultKind::kNone) {
      case sitl::FaultKind::kNone:
        return last_battery_ratio = vehicle.state().battery_ratio;
      case sitl::FaultKind::kStuck:
        return last_battery_ratio;
      case sitl::FaultKind::kWrong:
        return 0.05;
      default:
        return std::numeric_limits<double>::quiet_NaN();
    }
  }
  /// The operator was heard in this frame. The simulator's always is, unless the link has a fault.
  [[nodiscard]] bool hears_operator() const noexcept {
    const sitl::FaultKind kind =
        faults != nullptr ? faults->of(sitl::Component::kLink) : sitl::FaultKind::kNone;
    return kind == sitl::FaultKind::kNone ||
           (kind == sitl::FaultKind::kIntermittent && now.time_since_epoch() / core::kMinorFrame % 2 == 0);
  }

  /// The world moves on in whole minor frames until `time`: more than one after frames that slipped, at most
  /// 40 (0.1 s) a call.
  void fly_to(MonotonicTime time) noexcept {
    for (int i = 0; i < 40 && now < time; ++i) {
      // What was sent at the end of a minor frame reaches the motors in the middle of the next one: four
      // throttles are on the bus for 0.13 ms, and an ESC has a cycle of its own.
      vehicle.step(core::kMinorFrame / 2);
      actuators.advance(now + core::kMinorFrame / 2, vehicle);
      vehicle.step(core::kMinorFrame / 2);
      now += core::kMinorFrame;
      sensors.sample(now, vehicle.state());
      cameras.expose(now, vehicle.X_WB());
    }
  }
};

}  // namespace roborun::app
