/// Simulated visual-inertial odometry: a pose that drifts with the way flown, and now and then begins anew.
#pragma once

#include <cstdint>

#include "core/random/counter_rng.hpp"
#include "core/sensor_model.hpp"
#include "firmware_if/odometry.hpp"
#include "platform/sitl/sensors/delay_line.hpp"
#include "platform/sitl/sensors/navigation_models.hpp"
#include "platform/sitl/vehicle/vehicle.hpp"

namespace roborun::sitl {

/// Its frame is the world's at the start, as contracts of firmware_if ask for a vehicle without satellite navigation.
class VisualOdometry final : public firmware_if::Odometry {
 public:
  VisualOdometry(OdometryModel model, std::uint64_t seed) noexcept;
  /// To be called once a minor frame with the true state.
  void sample(MonotonicTime now, const VehicleState& state) noexcept;
  [[nodiscard]] Status read(firmware_if::OdometrySample& sample) noexcept override {
    return line_.pop(sample, now_);
  }

 private:
  void follow(const VehicleState& state) noexcept;
  void begin_anew(const VehicleState& state) noexcept;
  [[nodiscard]] Nanos next_reset() noexcept;

  OdometryModel model_;
  OdometryErrors errors_{};
  core::CounterRng rng_;
  double scale_{}, climb_{};     ///< Of the way flown.
  double yaw_error_rad_{0.0};
  double frame_yaw_rad_{0.0};    ///< Of the world in O, without the error.
  Vector3 p_O_ = Vector3::Zero();
  Vector3 last_W_ = Vector3::Zero();
  bool begun_{false};
  std::uint8_t resets_{0};
  std::uint32_t sequence_{0};
  MonotonicTime now_{}, next_{}, reset_at_{};
  DelayLine<firmware_if::OdometrySample, 16> line_;
};

}  // namespace roborun::sitl
