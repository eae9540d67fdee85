/// A depth camera: one image of distances along the optical axis, and where the camera sits on the body.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "firmware_if/status.hpp"
#include "firmware_if/time.hpp"

namespace roborun::firmware_if {

/// One depth image. Pixel (column u, row v) looks along the camera-frame direction
/// (1, -(2 (u + 0.5) / width - 1) tan_half_width, -(2 (v + 0.5) / height - 1) tan_half_height):
/// x forward along the optical axis, y left, z up, so that u grows to the right and v downwards.
/// depth_m is row-major, [v * width + u], the x coordinate of the hit in the camera frame.
///   in (range_min_m, range_m]  a surface at that depth
///   +infinity or > range_m     nothing within range_m (measured along the optical axis)
///   NaN or <= range_min_m      no information (dropout, or too near to be measured): such a pixel clears nothing
struct DepthFrame {
  MonotonicTime stamp{};     ///< Instant of exposure.
  std::uint32_t sequence{};  ///< Grows by one with each exposure, lost ones included.
  std::uint16_t width{};     ///< Pixels, 8 .. 1280.
  std::uint16_t height{};    ///< Pixels, 8 .. 1280.
  float tan_half_width{};    ///< Tangent of half the horizontal field of view; 1 for 90 degrees.
  float tan_half_height{};   ///< Tangent of half the vertical field of view.
  float range_m{};           ///< Depth beyond which the sensor sees nothing.
  float range_min_m{};  ///< Depth up to which what the sensor says means nothing; 0: all means something.
  std::span<const float> depth_m{};
};

/// Where the camera frame C sits in the body frame B (FLU). R_BC is row-major.
struct CameraMount {
  std::array<double, 9> R_BC{1, 0, 0, 0, 1, 0, 0, 0, 1};
  std::array<double, 3> p_BC_m{};
};

/// Contract:
///  1. read() neither blocks nor allocates.
///  2. kOk hands out the newest frame, which stays valid until the next read(); the same frame is never
///     handed out twice: then, and before the first one, the answer is kNotReady.
class DepthCamera {
 public:
  virtual ~DepthCamera() = default;
  [[nodiscard]] virtual Status read(DepthFrame& frame) noexcept = 0;
  [[nodiscard]] virtual const CameraMount& mount() const noexcept = 0;
};

}  // namespace roborun::firmware_if
