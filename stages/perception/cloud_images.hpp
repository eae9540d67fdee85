/// A cloud of points, as a LiDAR delivers it, as six depth images around the sensor: point cloud stage and
/// map take it from there like any camera's.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/memory/arena.hpp"
#include "stages/perception/occupancy_map.hpp"

namespace roborun::stages {

/// Points of one sweep, in the sensor's frame L (x forward, y left, z up), metres.
struct PosedCloud {
  std::span<const std::array<float, 3>> points_L{};
  MonotonicTime stamp{};
  /// A point that is not nearer says that nothing was met within the range in its direction. (0, kMaxRange_m]
  float range_m{};
  Pose X_WL{};
  Vector3 p_BL_W = Vector3::Zero();  ///< From the middle of the vehicle to the sensor.
  float range_min_m{};  ///< Points not farther than this from the sensor are left out. [0, range_m)
};

class CloudImages {
 public:
  static constexpr std::size_t kImages = 6;
  struct Config {
    /// Pixels a side of each image, 90 degrees. Not finer than the sensor's steps: a cell is free only if
    /// every pixel of it was met by a point. 32: steps of 2.8 degrees. [8, 512]
    std::uint16_t pixels{32};
    [[nodiscard]] constexpr Status validate() const noexcept {
      return pixels >= 8 && pixels <= 512 ? Status::kOk : Status::kInvalidArgument;
    }
  };
  /// Never decrease.
  struct Counters {
    std::uint64_t clouds{}, clouds_refused{}, points_refused{};
  };

  [[nodiscard]] static constexpr std::size_t arena_bytes(const Config& config) noexcept {
    return kImages * config.pixels * config.pixels * sizeof(float) + alignof(std::max_align_t);
  }
  /// Precondition, asserted: config.validate() is kOk. Check arena.exhausted() afterwards.
  CloudImages(const Config& config, core::Arena& arena) noexcept;

  /// Each pixel takes the nearest of its points; a pixel without one has no information: where no point came
  /// back nothing is cleared. A point stands in the middle of its pixel afterwards, at most half a pixel
  /// aside. Points that are not finite are left out and counted. kInvalidArgument, and no images, for a cloud
  /// without a usable point, a bad range or a pose that is not finite. RT-safe: O(points + pixels).
  [[nodiscard]] Status make(const PosedCloud& cloud) noexcept;
  /// Of the last make(): six, or none after a refused cloud; valid until the next. Six together see all around,
  /// so that what lies between two of them is seen; one into which no point fell says nothing.
  [[nodiscard]] std::span<const PosedDepthFrame> frames() const noexcept { return {frame_.data(), count_}; }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  Config config_;
  std::span<float> depth_m_;
  core::PoolRecord& pool_;
  std::array<PosedDepthFrame, kImages> frame_{};
  std::size_t count_{0};
  Counters counters_{};
};

}  // namespace roborun::stages
