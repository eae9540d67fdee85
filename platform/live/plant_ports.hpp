/// What the plant's sensors measure, written to the ports of a vehicle.
#pragma once

#include <array>
#include <deque>
#include <string>
#include <vector>

#include "core/geometry/vector.hpp"
#include "core/sensor_rig.hpp"
#include "firmware_if/barometer.hpp"
#include "firmware_if/gnss.hpp"
#include "firmware_if/imu.hpp"
#include "firmware_if/lidar.hpp"
#include "firmware_if/odometry.hpp"
#include "platform/sensor_port/port_bus.hpp"
#include "platform/sensor_port/port_names.hpp"
#include "platform/sensor_port/port_navigation.hpp"
#include "platform/sensor_port/port_writer.hpp"

namespace roborun::live {

/// Stamps on the plant's clock become CLOCK_MONOTONIC by `shift`.
/// The depth cameras and LiDARs of a rig. One thread.
class PicturePorts {
 public:
  /// Makes one port each. Throws InputError.
  PicturePorts(const SensorRig& rig, const std::vector<std::size_t>& most_points,
               const sensor_port::VehiclePorts& ports);
  void write(std::size_t camera, const firmware_if::DepthFrame& frame, const firmware_if::CameraMount& mount,
             Nanos shift) noexcept;
  void write(std::size_t lidar, const firmware_if::LidarSweep& sweep, const firmware_if::CameraMount& mount,
             Nanos shift) noexcept;

 private:
  std::deque<sensor_port::PortWriter> camera_, lidar_;
  std::vector<roborun_port_point> points_;
};

/// IMU, receiver, odometry, pressure, lines, and the vehicle's end of the bus. One thread.
class NavigationPorts {
 public:
  /// Makes what this rig has; `on_bus`: but for IMU, receiver and pressure. The world's origin is at `origin`. Throws InputError.
  NavigationPorts(const SensorRig& rig, const sensor_port::VehiclePorts& ports,
                  const sensor_port::EarthPlace& origin, bool on_bus = false);
  void write(const firmware_if::ImuSample& sample, Nanos shift) noexcept;
  void write(const firmware_if::GnssFix& fix, Nanos shift) noexcept;
  void write(const firmware_if::BarometerSample& sample, Nanos shift) noexcept;
  void write(const firmware_if::OdometrySample& sample, Nanos shift) noexcept;
  /// `active`: enum roborun_port_line; all of them are wired but those in `gone`.
  void write_lines(MonotonicTime now, std::uint32_t active, std::uint32_t gone, Nanos shift) noexcept;

 private:
  sensor_port::PortWriter imu_, gnss_, odometry_, pressure_, lines_;
  sensor_port::LocalFrame frame_;
  double origin_height_m_;
  std::uint32_t lines_written_{0};
};

/// Where the vehicle really is: for who makes the pictures; no part of a vehicle.
class TruthPort {
 public:
  /// Throws InputError.
  explicit TruthPort(const sensor_port::VehiclePorts& ports);
  void write(MonotonicTime now, const Vector3& p_WB, const Quaternion& q_WB, Nanos shift) noexcept;

 private:
  sensor_port::PortWriter port_;
  std::uint32_t written_{0};
};

}  // namespace roborun::live
