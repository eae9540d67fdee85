/// An aircraft of your own: here a mass that moves up and down, with drivers behind the same calls in yours.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include "core/geometry/math.hpp"
#include "core/vehicle_model.hpp"
#include "platform/flight/aircraft.hpp"

namespace example {

using roborun::MonotonicTime;
using roborun::Status;
namespace fw = roborun::firmware_if;

/// It is its own motors and sensors. No call blocks or allocates. What is read is handed out once.
class Lift final : public roborun::flight::Aircraft, fw::Imu, fw::Gnss, fw::Barometer, fw::Motors {
 public:
  explicit Lift(const roborun::VehicleModel& vehicle) : vehicle_(vehicle) {}
  [[nodiscard]] double height_m() const { return height_m_; }

  /// The world moves on to `now`, and the sensors that are due have a sample.
  void begin_frame(MonotonicTime now) noexcept override {
    const double dt_s = roborun::seconds(now - std::exchange(now_, now));
    lift_mps2_ = 0.0;
    for (const double ratio : command_.thrust_ratio)
      lift_mps2_ += ratio * vehicle_.max_thrust_N / vehicle_.mass_kg;
    // The ground carries it until it lifts off.
    if (height_m_ <= 0.0) lift_mps2_ = std::max(lift_mps2_, roborun::core::kGravity_mps2);
    climb_mps_ += (lift_mps2_ - roborun::core::kGravity_mps2) * dt_s;
    height_m_ = std::max(height_m_ + climb_mps_ * dt_s, 0.0);
    ++frame_;
    imu_due_ = true;  // at the rate of the flight lane
    gnss_due_ = frame_ % 40 == 0;
    barometer_due_ = frame_ % 16 == 0;
  }
  [[nodiscard]] fw::Imu& imu() noexcept override { return *this; }
  [[nodiscard]] fw::Gnss& gnss() noexcept override { return *this; }
  [[nodiscard]] fw::Barometer& barometer() noexcept override { return *this; }
  [[nodiscard]] fw::Motors& motors() noexcept override { return *this; }
  /// What the failsafe asks for: here a full battery, ESCs that answer, and an operator in range.
  [[nodiscard]] roborun::flight::AircraftHealth health(MonotonicTime) noexcept override {
    return {1.0, roborun::Nanos{0}, true, false};
  }
  void terminate() noexcept override { command_ = {}; }
  void disarm() noexcept override { command_ = {}; }
  void end_frame(MonotonicTime) noexcept override {}

 private:
  [[nodiscard]] Status read(fw::ImuSample& sample) noexcept override {
    sample = {now_, frame_, {tremble(), 0.0, 0.0}, {0.0, 0.0, lift_mps2_}};
    return std::exchange(imu_due_, false) ? Status::kOk : Status::kNotReady;
  }
  [[nodiscard]] Status read(fw::GnssFix& fix) noexcept override {
    fix = {now_, frame_, {tremble(), 0.0, height_m_}, {0.0, 0.0, climb_mps_}, 0.0, 0.02, 0.03, 0.05, 0.01};
    return std::exchange(gnss_due_, false) ? Status::kOk : Status::kNotReady;
  }
  [[nodiscard]] Status read(fw::BarometerSample& sample) noexcept override {
    sample = {now_, frame_, height_m_};
    return std::exchange(barometer_due_, false) ? Status::kOk : Status::kNotReady;
  }
  [[nodiscard]] Status command(const fw::MotorCommand& command) noexcept override {
    command_ = command;
    return Status::kOk;
  }
  /// A sensor that says the same number twenty times is taken for a dead one.
  [[nodiscard]] double tremble() const { return 1e-4 * (frame_ % 7); }

  roborun::VehicleModel vehicle_;
  MonotonicTime now_{};
  std::uint32_t frame_{0};
  double height_m_{0.0}, climb_mps_{0.0}, lift_mps2_{0.0};
  bool imu_due_{false}, gnss_due_{false}, barometer_due_{false};
  fw::MotorCommand command_{};
};

}  // namespace example
