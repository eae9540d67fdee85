/// The images of the last scan, prepared, and those of a moment ago: what they saw through was free then, to the pixel.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/memory/arena.hpp"
#include "firmware_if/time.hpp"
#include "stages/perception/block_sight.hpp"
#include "stages/perception/depth_pyramid.hpp"

namespace roborun::stages {

struct ScanImages {
  SightCameras cameras{};
  std::array<std::optional<DepthPyramid>, kMaxCameras> pyramid{};  ///< Those that there is room for.
  MonotonicTime stamp = MonotonicTime::min();
};

/// Three scans: the last one, and two that are kApart. Memory from the arena.
class ScanHistory {
 public:
  static constexpr std::size_t kScans = 3;
  /// In less, what is slow has not moved by more than depths are wrong by.
  static constexpr Nanos kYoungest{250'000'000};
  /// What is slow, or far from a noisy camera, needs longer; a camera that turns has seen something else by then.
  static constexpr Nanos kApart{500'000'000};
  /// Before that somebody else flew here.
  static constexpr Nanos kOldest{2'000'000'000};
  static constexpr double kCube_m = 0.2;

  [[nodiscard]] static std::size_t arena_bytes(std::size_t frames, std::size_t max_width,
                                               std::size_t max_height) noexcept {
    return kScans * frames * DepthPyramid::arena_bytes(max_width, max_height);
  }
  /// Room for so many images per scan, of up to max_width x max_height pixels. Precondition: frames <= kMaxCameras.
  ScanHistory(core::Arena& arena, std::size_t frames, std::size_t max_width, std::size_t max_height) noexcept;

  /// Where the images of the scan of this instant go, which becomes the last one: it has no cameras yet. Valid until the next.
  [[nodiscard]] ScanImages& begin(MonotonicTime stamp) noexcept;
  void forget() noexcept;
  /// Which of at most BlocksSeen::kMost cubes of kCube_m were seen past, all over, by a scan that was between kYoungest and kOldest
  /// ago: bit i is cube i. RT-safe: O(cameras x cubes).
  [[nodiscard]] std::uint64_t saw_through(MonotonicTime now,
                                          std::span<const Vector3> center_W) const noexcept;

 private:
  std::array<ScanImages, kScans> scan_{};
  std::array<std::size_t, kScans> by_age_{0, 1, 2};  ///< The last one first.
};

}  // namespace roborun::stages
