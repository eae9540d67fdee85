/// Vehicle and navigation sensors of a simulated flight, and who takes pictures on the way.
#pragma once

#include "core/executive/frame_table.hpp"
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
  MonotonicTime now{};

  /// The world moves on in whole minor frames until `time`: more than one after frames that slipped, at most
  /// 40 (0.1 s) a call.
  void fly_to(MonotonicTime time) noexcept {
    for (int i = 0; i < 40 && now < time; ++i) {
      vehicle.step(core::kMinorFrame);
      now += core::kMinorFrame;
      sensors.sample(now, vehicle.state());
      cameras.expose(now, vehicle.X_WB());
    }
  }
};

}  // namespace roborun::app
