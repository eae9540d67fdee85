/// Which blocks of space do the cameras of one scan see through? Eight blocks at a time, with the widest
/// vector instructions of the machine; the same bits on all of them.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "stages/perception/brick.hpp"
#include "stages/perception/depth_pyramid.hpp"

namespace roborun::stages {

inline constexpr std::size_t kMaxCameras = 8;

/// A camera and its image, prepared for see_*(). Single precision: positions are relative to the camera.
struct SightCamera {
  /// `depth_margin`: a block is free only if every pixel sees constant_m + per_m2 * depth^2 past it.
  struct Margin {
    double constant_m{};
    double per_m2{};
  };
  void prepare(const PosedDepthFrame& posed, const DepthPyramid& image, const Margin& depth_margin) noexcept;

  Vector3 p_WC = Vector3::Zero();
  std::array<float, 9> R_CW{};  ///< Row-major.
  alignas(32) std::array<std::array<float, 8>,
                         3> child{};  ///< Centres of a block's children, for a quarter edge of 1.
  float extent{};                     ///< Half extent of a cube of half-edge 1 along the optical axis.
  std::array<float, 4>
      support{};  ///< The same against the four sides of the field of view: left, right, up, down.
  float tan_half{}, range_m{};
  float columns_per_tan{}, rows_per_tan{}, last_column{}, last_row{};
  float margin_m{}, margin_per_m2{};
  const DepthPyramid* pyramid{};
};

struct SightCameras {
  std::array<SightCamera, kMaxCameras> camera{};
  std::size_t count{0};
  bool complete{
      false};  ///< All cameras of the vehicle: what lies between two images is seen by them together.
};

/// Eight blocks of one size. At the finest level only the inner half of a cell's edge counts: a surface in
/// its rim ends in it, and is written after free space; without this a cell that touches a shadow or the
/// ground is never free. `free`: seen past, all over, and no camera disagrees. `mixed`: smaller blocks may be
/// free. Bit i is block i.
struct EightSeen {
  std::uint8_t free{}, mixed{};
  std::array<std::uint8_t, 8> cameras{};  ///< For each block, the set of cameras that can see some of it.
};

/// The same of many blocks.
struct BlocksSeen {
  static constexpr std::size_t kMost = 64;
  std::uint64_t free{}, mixed{};
  std::array<std::uint8_t, kMost> cameras{};
};

/// A block and the cameras that can see some of it.
struct SightBlock {
  Vector3 center_W = Vector3::Zero();
  int level{};
  std::uint8_t cameras{};
};

/// Free blocks of a brick: bit i of `free` is the block of `level` with Morton index 8 * parent + i.
struct FreeGroup {
  std::uint16_t parent;
  std::uint8_t level;
  std::uint8_t free;
};
/// Room for a group of each block of level 4 .. 1; there are those of divided ones with a free child, in any
/// order.
struct BrickSeen {
  static constexpr std::size_t kMaxGroups = 1 + 8 + 64 + 512;
  std::array<FreeGroup, kMaxGroups> group;
  std::size_t count{0};
  std::uint32_t visited{0};     ///< Blocks divided.
  std::uint32_t free_cells{0};  ///< Of level 0, in all groups.
};

/// At most kMost blocks of any position; each camera looks only at those in its view. RT-safe: O(cameras).
[[nodiscard]] BlocksSeen see_blocks(const SightCameras& cameras, int level,
                                    std::span<const Vector3> center_W) noexcept;
/// The eight children of a block, in Morton order. RT-safe: O(cameras).
[[nodiscard]] EightSeen see_children(const SightCameras& cameras, const SightBlock& parent) noexcept;
/// Divides a brick (level 4) down to blocks of level `finest` (0 .. 3). RT-safe: at most kMaxGroups times
/// see_children().
void see_brick(const SightCameras& cameras, const SightBlock& brick, int finest, BrickSeen& seen) noexcept;

/// A row of an image as a line in cells of the finest level: pixel u at depth d ends at
/// origin + rest + d (first + u step). Ends outside [low, high] are none.
struct PixelLine {
  std::array<std::int32_t, 3> origin{};  ///< Whole cells, and
  std::array<float, 3> rest{};           ///< what is left of one.
  std::array<float, 3> first{};
  std::array<float, 3> step{};
  std::array<std::int32_t, 3> low{}, high{};
};
/// The cells in which the pixels of a row end, from left to right; neighbours in one cell are one entry.
struct SurfaceRow {
  static constexpr std::size_t kPad = 8;  ///< Room for whole vectors.
  alignas(32) std::array<std::array<std::int32_t, DepthPyramid::kMaxPixels + 2 * kPad>, 3> cell{};
  std::size_t count{0};
};
/// Precondition: at most kMaxPixels depths, range_m at most kMaxRange_m. RT-safe: O(pixels).
void end_cells(const PixelLine& line, std::span<const float> depth_m, float range_m,
               SurfaceRow& row) noexcept;

inline constexpr std::size_t kMaxTile = 8;  ///< Pixels on a side.
/// Some rows of an image.
struct DepthStrip {
  const float* depth_m{};
  std::size_t width{}, rows{};  ///< Pixels; at most kMaxTile rows.
  float range_m{}, steps_per_m{};
};
/// Of a strip: bit i says that of the columns [8 i, 8 i + 8) a pixel has no information; and whether one
/// shows a surface.
struct StripSeen {
  std::uint64_t incomplete{};
  bool surface{};
};
/// Bounds of tiles of 2^shift columns and all rows of the strip, in steps of DepthPyramid. A pixel without
/// information has no part in them.
[[nodiscard]] StripSeen tile_steps(const DepthStrip& strip, int shift, DepthPyramid::Entry* entry) noexcept;

/// How many pixels of an image have information.
[[nodiscard]] std::size_t informed_pixels(std::span<const float> depth_m) noexcept;

/// A row of tiles in space, in cells of any size: as PixelLine, for the tiles' middles. `half`: how much a
/// direction differs at most within a tile.
struct TileLine {
  std::array<std::int32_t, 3> origin{};
  std::array<float, 3> rest{}, first{}, step{}, half{};
  float steps_per_m{};
};
/// For each tile: whether it shows a surface; then in which cells, at most, and in which one its middle would
/// be the nearest.
struct TileRow {
  static constexpr std::size_t kMost = DepthPyramid::kMaxPixels + 8;
  using Cells = std::array<std::array<std::int32_t, kMost>, 3>;
  alignas(32) Cells low{};
  alignas(32) Cells high{};
  alignas(32) Cells nearest{};
  std::array<bool, kMost> surface{};
};
/// Bounds of a row of tiles, `stride` entries apart.
struct TileEntries {
  const DepthPyramid::Entry* entry{};
  std::size_t stride{}, count{};
};
void tile_boxes(const TileLine& line, const TileEntries& tiles, TileRow& row) noexcept;

/// to[x] = the least of fine[stride x + {0, next}] of two rows; `count` times.
void least_of_four(const DepthPyramid::Entry* above, const DepthPyramid::Entry* below, std::size_t stride,
                   std::size_t count, DepthPyramid::Entry* to) noexcept;

/// mip[i] = content flags of the cells 8 i .. 8 i + 7 of a brick. Returns how many cells are known.
[[nodiscard]] std::size_t brick_flags(const std::array<std::uint64_t, Brick::kWords>& word,
                                      std::uint8_t* mip) noexcept;

/// Instruction sets that see_*() can use here, and the use of one of them only (tests); all again with ~0.
[[nodiscard]] std::int64_t sight_instruction_sets() noexcept;
void use_sight_instruction_sets(std::int64_t sets) noexcept;

}  // namespace roborun::stages
