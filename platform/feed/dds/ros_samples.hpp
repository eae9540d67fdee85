/// ROS 2 messages as samples of sensor ports. They come from anybody on the network: no length, size, offset or number is believed.
/// Sources: common_interfaces; REP 103 (axes), 105 (frames), 117 and 118 (values of depth images), 145 (IMU).
#pragma once

#include <ros2_messages.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "platform/feed/dds/ros_clock.hpp"
#include "platform/sensor_port/roborun_port.h"

namespace roborun::feed {

using RosImage = sensor_msgs_msg_dds__Image_;
using RosCameraInfo = sensor_msgs_msg_dds__CameraInfo_;
using RosCloud = sensor_msgs_msg_dds__PointCloud2_;
using RosImu = sensor_msgs_msg_dds__Imu_;
using RosOdometry = nav_msgs_msg_dds__Odometry_;

/// All set what belongs to the message alone: no stamp, ranges or mount. Nothing is set where one is refused.

/// Optics of a rectified camera. Refused: distortion, binning, a part of the image, numbers that are none.
struct RosOptics {
  std::uint32_t width{}, height{};
  float fx{}, fy{}, cx{}, cy{};
};
[[nodiscard]] std::optional<Refused> optics_of(const RosCameraInfo& info, RosOptics& optics);

/// 16UC1 (millimetres) and 32FC1 (metres) of the size that `optics` says. `pixels`: the rows without gaps; the memory of the message
/// if it has none, else `room`.
[[nodiscard]] std::optional<Refused> depth_of(const RosImage& image, const RosOptics& optics,
                                              std::vector<std::byte>& room, roborun_port_depth& depth,
                                              std::span<const std::byte>& pixels);

/// Points of fields x, y, z (float32, axes forward, left, up), with a time each if there is `t` (uint32, ns), `time` (float32, s), both
/// from the stamp on, or `timestamp` (float64, s, wall clock). `late_s`: how long after the message's stamp the last point was measured,
/// which is what the points' times count back from. More than `most_points`: refused.
[[nodiscard]] std::optional<Refused> cloud_of(const RosCloud& cloud, std::size_t most_points,
                                              std::vector<roborun_port_point>& points, double& late_s);

/// In the body's axes.
[[nodiscard]] std::optional<Refused> imu_of(const RosImu& message, roborun_port_imu& imu);

/// Of the body; with variances that are not all zero, which says "unknown" in ROS. The speed comes in the body's axes and goes in O's.
[[nodiscard]] std::optional<Refused> odometry_of(const RosOdometry& message, roborun_port_odometry& odometry);

}  // namespace roborun::feed
