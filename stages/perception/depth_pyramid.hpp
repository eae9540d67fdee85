/// A depth image as a pyramid of bounds: how far is every pixel of a rectangle known to see, at least and at
/// most?
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "core/memory/arena.hpp"
#include "stages/perception/depth_steps.hpp"
#include "stages/perception/occupancy_map.hpp"

namespace roborun::stages {

/// A pixel without information (NaN or not beyond the least range) most of whose neighbours have some counts as the nearest of
/// them: a camera loses some at random, and near cells have thousands. Those of larger holes have no part in bounds; how many
/// pixels of a rectangle are seen is counted beside them, and only of images with such holes.
///
/// Depths are whole steps of range / 32766, rounded so that bounds stay bounds. Level 0 holds the pixels; an
/// entry of level k >= 1 covers 2^k x 2^k pixels and they stand 2^(k-1) apart, so that they overlap: any
/// rectangle of up to 2^k + 2 pixels a side is covered by four of them, with less than 2^(k-1) pixels too
/// many on each side (none at level 1). Memory from the arena: 10/3 x 4 bytes a pixel.
class DepthPyramid {
 public:
  static constexpr int kMaxLevels = 12;  ///< The coarsest covers kMaxImageSide pixels.
  static constexpr std::int32_t kMaxSteps = DepthEntry::kMaxSteps;

  using Entry = DepthEntry;
  struct Level {
    const Entry* entry{};
    std::int32_t width{};  ///< Entries a row.
    int shift{};           ///< Entries stand 2^shift pixels apart.
    /// The last entry of the four starts at ((last pixel + 2^shift) >> shift) - back.
    std::int32_t back{};
  };
  struct Bound {
    float least_m;
    float most_m;
  };

  /// Bytes that the constructor takes from the arena.
  [[nodiscard]] static std::size_t arena_bytes(std::size_t max_width, std::size_t max_height) noexcept;
  /// Room for images of up to max_width x max_height of their tiles.
  DepthPyramid(core::Arena& arena, std::size_t max_width, std::size_t max_height,
               const char* name = "map depth pyramid") noexcept;
  /// kCapacity if the image has more tiles than planned. `tile_shift` in [0, 3]: the finest bounds are those of
  /// tiles of 2^tile_shift pixels a side, for eyes that need no better. O(pixels).
  [[nodiscard]] Status build(const firmware_if::DepthFrame& frame, int tile_shift = 0) noexcept;
  /// The level for rectangles of up to this many pixels a side: 0 up to two, else the least k >= 1 with
  /// side <= 2^k + 2. O(1).
  [[nodiscard]] static constexpr int level_for(std::int32_t side) noexcept {
    return (side > 2 ? 32 : 31) - __builtin_clz(static_cast<unsigned>(side > 3 ? side - 3 : 1));
  }
  [[nodiscard]] const Level& level(int k) const noexcept { return level_[static_cast<std::size_t>(k)]; }
  /// The finest level that there is: 0, or tile_shift + 1.
  [[nodiscard]] int first_level() const noexcept { return level_[0].shift == 0 ? 0 : level_[0].shift + 1; }
  /// The tiles, side by side; pixels if tile_shift was 0.
  [[nodiscard]] const Level& tiles() const noexcept { return level_[0]; }
  [[nodiscard]] float steps_per_m() const noexcept { return steps_per_m_; }
  /// Whether a pixel has information, and whether one shows a surface.
  [[nodiscard]] bool shows_anything() const noexcept { return shows_anything_; }
  [[nodiscard]] bool has_holes() const noexcept { return has_holes_; }
  /// How many pixels are not in a hole, as sums over tiles of 2^shift pixels a side: of the tiles [x0, x1) x [y0, y1) it is
  /// seen[y1 row + x1] - seen[y1 row + x0] - seen[y0 row + x1] + seen[y0 row + x0].
  struct SeenSums {
    const std::uint32_t* seen{};
    std::int32_t row{};
    int shift{};
    std::int32_t width{}, height{};  ///< Of the image, in pixels.
  };
  /// Precondition: has_holes(). O(1).
  [[nodiscard]] SeenSums seen_sums() const noexcept {
    return {seen_.data(), level_[0].width + 1, level_[0].shift, static_cast<std::int32_t>(width_),
            static_cast<std::int32_t>(height_)};
  }
  [[nodiscard]] bool shows_surface() const noexcept { return shows_surface_; }
  /// Pixels [u0, u1] x [v0, v1], inside the image. Conservative. O(1).
  [[nodiscard]] Bound bound(int u0, int v0, int u1, int v1) const noexcept;

 private:
  /// Adds pixels that count as a neighbour to their tiles in the strip from row y on. True: others are in a hole, in lost_ by tile.
  [[nodiscard]] bool bridge_strip(const firmware_if::DepthFrame& frame, std::size_t y, unsigned shift,
                                  const StripSeen& strip, Entry* tile) noexcept;
  /// Counts what is seen of the strip of tiles from row y on, where this one or one above it has a hole.
  void count_strip(const firmware_if::DepthFrame& frame, std::size_t y, unsigned shift,
                   bool any_lost) noexcept;
  void fill_tiles(const firmware_if::DepthFrame& frame, unsigned shift, Entry* tile) noexcept;

  std::size_t max_width_, max_height_;
  float steps_per_m_{0.0F};
  bool shows_anything_{false};
  bool shows_surface_{false};
  bool has_holes_{false};
  std::uint32_t width_{0}, height_{0};
  std::array<Level, kMaxLevels> level_{};
  std::span<Entry> memory_{};
  /// Row y, column x: the pixels seen in the tiles above and to the left. A row and a column more than tiles.
  std::span<std::uint32_t> seen_{};
  std::array<std::uint8_t, kMaxImageSide> lost_{};  ///< Pixels in holes, of each tile of a strip; at most 64.
  core::PoolRecord* pool_{nullptr};
};

}  // namespace roborun::stages
