/// The simulated sensors, and what a fault makes of what they say. Without a fault every sample passes as it
/// is.
#pragma once

#include <vector>

#include "core/random/counter_rng.hpp"
#include "firmware_if/depth_camera.hpp"
#include "platform/sitl/fault/fault_line.hpp"
#include "platform/sitl/sensors/navigation_sensors.hpp"

namespace roborun::sitl {

class FaultySensors final : public firmware_if::Imu,
                            public firmware_if::Gnss,
                            public firmware_if::Barometer,
                            public firmware_if::Odometry {
 public:
  /// Implicit: sensors are healthy until somebody connects a fault line.
  FaultySensors(const NavigationSensors& sensors) noexcept  // NOLINT(google-explicit-constructor)
      : sensors_(sensors) {}
  /// Null: none. It must outlive the sensors.
  void connect(const FaultLine* faults) noexcept { faults_ = faults; }
  void stand_in(const World& world) noexcept { sensors_.stand_in(&world); }
  void sample(MonotonicTime now, const VehicleState& state) noexcept {
    now_ = now;
    sensors_.sample(now, state);
  }
  [[nodiscard]] Status read(firmware_if::ImuSample& sample) noexcept override;
  [[nodiscard]] Status read(firmware_if::GnssFix& fix) noexcept override;
  [[nodiscard]] Status read(firmware_if::BarometerSample& sample) noexcept override;
  [[nodiscard]] Status read(firmware_if::OdometrySample& sample) noexcept override;

 private:
  template <typename Sample>
  struct Channel {
    Sample good{};  ///< The last one before the fault.
    DelayLine<Sample, 64> late{};
  };
  template <typename Sample>
  [[nodiscard]] Status read(Component component, Channel<Sample>& channel, Sample& sample) noexcept;

  NavigationSensors sensors_;
  const FaultLine* faults_{nullptr};
  MonotonicTime now_{};
  Channel<firmware_if::ImuSample> imu_;
  Channel<firmware_if::GnssFix> gnss_;
  Channel<firmware_if::BarometerSample> barometer_;
  Channel<firmware_if::OdometrySample> odometry_;
};

class FaultyDepthCamera final : public firmware_if::DepthCamera {
 public:
  FaultyDepthCamera(firmware_if::DepthCamera& camera, int instance, const FaultLine& faults)
      : camera_(camera), instance_(instance), faults_(faults) {}
  [[nodiscard]] Status read(firmware_if::DepthFrame& frame) noexcept override;
  [[nodiscard]] const firmware_if::CameraMount& mount() const noexcept override { return camera_.mount(); }

 private:
  firmware_if::DepthCamera& camera_;
  int instance_;
  const FaultLine& faults_;
  std::vector<float> good_m_;  ///< The last image before the fault.
  std::vector<float> bent_m_;
  firmware_if::DepthFrame late_{};  ///< Waits in bent_m_.
  bool waiting_{false};
};

}  // namespace roborun::sitl
