/// Depth images as distances around the vehicle, as MAVLink's OBSTACLE_DISTANCE has them.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/geometry/vector.hpp"
#include "firmware_if/depth_camera.hpp"
#include "firmware_if/mavlink/flight_messages.hpp"

namespace roborun::live {

/// From the body (FLU) to the same heading, level, of MAVLink's angles (FRD, rad), and of its attitude (FRD in NED; w, x, y, z).
[[nodiscard]] Matrix3 level_of(double roll_rad, double pitch_rad);
[[nodiscard]] Matrix3 level_of(const std::array<double, 4>& q);

/// 72 sectors of 5 degrees, clockwise; the middle of the first one is straight ahead. What lies within `band_m` above or below the
/// body's middle counts. A sector holds the nearest
/// hit; it is free only if more of its level rays (3 degrees) found nothing within the range than said nothing; else
/// it is not known.
class ObstacleSectors {
 public:
  static constexpr std::size_t kSectors = 72;
  static constexpr std::uint16_t kUnknown = 65535;
  static constexpr Nanos kOld{500'000'000};  ///< An image; then what it showed is not known.

  ObstacleSectors(std::size_t cameras, double band_m) : camera_(cameras), band_m_(band_m) {}
  /// The newest image of a camera. `R_LB`: from the body to the same heading, level; identity where nobody knows how it leans: then
  /// the band is that of the body's axes, and a vehicle that leans sees the ground as an obstacle.
  void see(std::size_t camera, const firmware_if::DepthFrame& frame, const firmware_if::CameraMount& mount,
           const Matrix3& R_LB = Matrix3::Identity());
  /// As it is to be sent at `now`; ranges are the least far of the cameras. Body frame (12), right for PX4 and ArduPilot.
  [[nodiscard]] firmware_if::mavlink::ObstacleDistance message(MonotonicTime now) const;
  /// As far as nothing is, in sectors of the message that are at most `half_rad` beside `clockwise_rad` from straight ahead, m: the
  /// nearest hit, or the range; 0 if more than a fifth of them is not known.
  [[nodiscard]] static double clear_m(const firmware_if::mavlink::ObstacleDistance& message,
                                      double clockwise_rad, double half_rad);
  /// The nearest hit at `now`, m; +infinity: none.
  [[nodiscard]] double nearest_m(MonotonicTime now) const;

 private:
  struct Sector {
    float hit_m{};         ///< +infinity: none.
    int free{}, silent{};  ///< Level rays.
  };
  struct Camera {
    MonotonicTime stamp = MonotonicTime::min();
    double range_min_m{}, range_m{};
    std::array<Sector, kSectors> sector{};
  };
  [[nodiscard]] Sector merged(std::size_t index, MonotonicTime now) const;

  std::vector<Camera> camera_;
  double band_m_;
};

}  // namespace roborun::live
