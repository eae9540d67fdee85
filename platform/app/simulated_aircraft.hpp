/// Vehicle, motors' bus and navigation sensors of a simulated flight, and who takes pictures on the way.
#pragma once

#include "core/executive/frame_table.hpp"
#include "platform/app/actuator_link.hpp"
#include "platform/sitl/sensors/navigation_sensors.hpp"
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
  sitl::NavigationSensors sensors;
  ExposureSink& cameras;
  ActuatorLink actuators;
  MonotonicTime now{};

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
