/// A camera of the kernel at a sensor port.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "core/sensor_rig.hpp"
#include "platform/feed/v4l2_capture.hpp"

namespace roborun::feed {

struct V4l2FeedConfig {
  CaptureWish wish;
  CameraSpec camera{};                                ///< Ranges, place, and optics where none are given.
  std::optional<std::array<double, 4>> intrinsics{};  ///< fx, fy, cx, cy in pixels.
  double unit_m{0.001};                               ///< Of a pixel's number.
  std::string port;                                   ///< Path.
  std::function<bool()> stop;                         ///< Asked ten times per second.
  std::function<void(const std::string&)> say;        ///< One line each.
};

/// Never decrease.
struct V4l2FeedCounters {
  std::uint64_t images{}, damaged{}, losses{};
};

/// Until `stop` says so. A device that is lost, or silent for 2 s, is opened again once per second; with the same size. Throws InputError
/// if it cannot be opened at the start, or had no image for kMostLost.
inline constexpr Nanos kMostLost{60'000'000'000};
[[nodiscard]] V4l2FeedCounters feed_v4l2(VideoCalls& calls, const V4l2FeedConfig& config);

}  // namespace roborun::feed
