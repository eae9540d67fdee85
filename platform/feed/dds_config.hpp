/// What `roborun feed dds` tells the process that speaks DDS, as the JSON text of its one argument. Topics by their ROS names, ports
/// by their paths.
#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "firmware_if/depth_camera.hpp"

namespace roborun::feed {

/// A camera or a LiDAR.
struct DdsEye {
  std::string topic;
  std::string info;  ///< Topic of a camera's CameraInfo.
  std::string port;
  std::size_t most_points{};  ///< Of a LiDAR's cloud.
  double range_min_m{}, range_m{};
  std::array<double, 9> R_BC{};
  std::array<double, 3> p_BC_m{};
};

/// Empty texts: not asked for.
struct DdsConfig {
  int domain{0};
  std::vector<DdsEye> cameras{}, lidars{};
  std::string imu{}, imu_port{};
  std::string odometry{}, odometry_port{};
  int live{0};                     ///< Port of `roborun run --live`; 0: nothing is published.
  std::string prefix{"/roborun"};  ///< Of the topics that are published.
};

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(DdsEye, topic, info, port, most_points, range_min_m, range_m, R_BC, p_BC_m)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(DdsConfig, domain, cameras, lidars, imu, imu_port, odometry, odometry_port,
                                   live, prefix)

}  // namespace roborun::feed
