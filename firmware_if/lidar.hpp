/// A LiDAR: the points of one sweep, and where the sensor sits on the body.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "firmware_if/depth_camera.hpp"
#include "firmware_if/status.hpp"
#include "firmware_if/time.hpp"

namespace roborun::firmware_if {

/// One sweep. Points stand in the sensor's frame L (x forward, y left, z up), metres, as from one instant: a driver
/// that knows the vehicle's motion takes it out. A point p, by its distance from the sensor:
///   in (range_min_m, range_m)  a surface at p
///   finite and >= range_m      nothing within range_m in that direction, from drivers that know; others leave it out
///   NaN or <= range_min_m      no information
struct LidarSweep {
  MonotonicTime stamp{};     ///< The instant of the points.
  std::uint32_t sequence{};  ///< Grows by one with each sweep, lost ones included.
  float range_min_m{};
  float range_m{};
  std::span<const std::array<float, 3>> points_L_m{};
};

/// Contract:
///  1. read() neither blocks nor allocates.
///  2. kOk hands out the newest sweep, which stays valid until the next read(); the same sweep is never handed out
///     twice: then, and before the first one, the answer is kNotReady.
class Lidar {
 public:
  virtual ~Lidar() = default;
  [[nodiscard]] virtual Status read(LidarSweep& sweep) noexcept = 0;
  /// C is the sensor's frame L.
  [[nodiscard]] virtual const CameraMount& mount() const noexcept = 0;
};

}  // namespace roborun::firmware_if
