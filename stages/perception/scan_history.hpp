/// The images of a moment ago: what they saw through was free then, to the pixel.
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

/// Two scans that are kApart, the younger one up to that old. Memory from the arena: of large images tiles are kept.
class ScanHistory {
 public:
  /// In less, what moves has not moved by more than depths are wrong by.
  static constexpr Nanos kYoungest{250'000'000};
  /// What is slow, or far from a noisy camera, needs longer; a camera that turns has seen something else by then.
  static constexpr Nanos kApart{500'000'000};
  /// Before that the estimate was another.
  static constexpr Nanos kOldest{2'000'000'000};
  static constexpr double kCube_m = 0.2;

  [[nodiscard]] static std::size_t arena_bytes(std::size_t frames, std::size_t max_width,
                                               std::size_t max_height) noexcept;
  /// Room for so many images per scan, of up to max_width x max_height pixels. Precondition: frames <= kMaxCameras.
  ScanHistory(core::Arena& arena, std::size_t frames, std::size_t max_width, std::size_t max_height) noexcept;

  /// Whether the scan of this instant is to be kept. Then its images are to be added.
  [[nodiscard]] bool begin(MonotonicTime stamp) noexcept;
  /// `frame` is the image with what its holes say. What there is no room for is not kept. RT-safe: O(pixels).
  void add(const PosedDepthFrame& posed, const firmware_if::DepthFrame& frame) noexcept;
  /// SightCameras::complete of the scan that was begun last.
  void set_complete(bool complete) noexcept { scan_[last_].cameras.complete = complete; }
  void forget() noexcept;
  /// Which of at most BlocksSeen::kMost cubes of kCube_m were seen past, all over, by a scan that was between kYoungest and kOldest
  /// ago: bit i is cube i. RT-safe: O(cameras x cubes).
  [[nodiscard]] std::uint64_t saw_through(MonotonicTime now,
                                          std::span<const Vector3> center_W) const noexcept;

 private:
  struct Scan {
    SightCameras cameras{};
    std::array<std::optional<DepthPyramid>, kMaxCameras> pyramid{};  ///< Those that there is room for.
    MonotonicTime stamp{};
  };
  std::array<Scan, 2> scan_{};  ///< One without cameras is none.
  std::size_t last_{0};
};

}  // namespace roborun::stages
