/// The plant's sensors as nodes on its DroneCAN bus, and its operator before the flight.
#pragma once

#include "core/sensor_model.hpp"
#include "firmware_if/barometer.hpp"
#include "firmware_if/can.hpp"
#include "firmware_if/gnss.hpp"
#include "firmware_if/imu.hpp"
#include "platform/sensor_port/port_navigation.hpp"
#include "platform/sitl/bus/fake_node.hpp"
#include "platform/sitl/vehicle/vehicle.hpp"

namespace roborun::live {

/// An IMU, which also keeps the bus's time, a receiver with two antennas, or with a magnetometer in its housing (kM9n), a barometer,
/// and a range finder that looks down. One thread.
class SensorNodes {
 public:
  /// `bus` outlives this. The world's origin is at `origin`.
  SensorNodes(firmware_if::CanBus& bus, const sensor_port::EarthPlace& origin, GnssModel receiver);
  /// Once a minor frame, before the samples: says what is no sample of the simulator. `ahead`: how far the bus's time is ahead
  /// of the world's, which may have stood still.
  void step(MonotonicTime now, Nanos ahead, const sitl::Vehicle& vehicle) noexcept;
  void say(const firmware_if::ImuSample& sample) noexcept;
  void say(const firmware_if::GnssFix& fix) noexcept;
  void say(const firmware_if::BarometerSample& sample) noexcept;

 private:
  [[nodiscard]] firmware_if::dronecan::Timestamp stamp_of(MonotonicTime stamp) const noexcept;
  void say_field(const sitl::Vehicle& vehicle) noexcept;
  void say_range(const sitl::Vehicle& vehicle) noexcept;

  sitl::FakeVoice<firmware_if::dronecan::GlobalTimeSync> time_;
  sitl::FakeVoice<firmware_if::dronecan::RawImu> imu_;
  sitl::FakeVoice<firmware_if::dronecan::GnssFix2> fix_;
  sitl::FakeVoice<firmware_if::dronecan::GnssHeading> heading_;
  sitl::FakeVoice<firmware_if::dronecan::StaticPressure> pressure_;
  sitl::FakeVoice<firmware_if::dronecan::StaticTemperature> temperature_;
  sitl::FakeVoice<firmware_if::dronecan::MagneticFieldStrength2> field_;
  sitl::FakeVoice<firmware_if::dronecan::RangeMeasurement> range_;
  sitl::FakeHeartbeat imu_beat_, receiver_beat_, barometer_beat_, range_beat_;
  sensor_port::LocalFrame frame_;
  double origin_height_m_;
  Vector3 earth_W_gauss_;
  bool has_magnetometer_;
  MonotonicTime now_{}, measured_{};
  Nanos ahead_{};
  std::uint64_t told_usec_{0};
};

/// Once somebody speaks on the bus he shows that the kill switch works: presses it, and releases it. Then he switches the
/// arming switch off and on again, until it flies.
class PlantOperator {
 public:
  /// `now`: as time passes; `heard`: the runtime spoke since the last call.
  void step(MonotonicTime now, bool heard) noexcept;
  void flies() noexcept { flies_ = true; }
  [[nodiscard]] bool presses_kill() const noexcept;
  [[nodiscard]] bool arms() const noexcept;

 private:
  double time_s_{-1.0};  ///< Since the runtime was first heard; negative: it was not.
  MonotonicTime began_{}, heard_{};
  bool hears_{false}, flies_{false};
};

}  // namespace roborun::live
