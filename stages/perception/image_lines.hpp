/// Rows of an image as lines in space: in which cells do their pixels, or tiles of pixels, end? Positions are
/// counted in cells, so that single precision is enough.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "stages/perception/depth_steps.hpp"

namespace roborun::stages {

/// A row of an image as a line in cells of the finest level: pixel u at depth d ends at
///   origin + rest + d (first + u step).
/// Ends outside [low, high] are left out.
struct PixelLine {
  std::array<std::int32_t, 3> origin{};  ///< Whole cells, and
  std::array<float, 3> rest{};           ///< what is left of one.
  std::array<float, 3> first{};
  std::array<float, 3> step{};
  std::array<std::int32_t, 3> low{}, high{};
};

/// The depths at which a pixel shows a surface: in (least_m, most_m).
struct SurfaceDepths {
  float least_m{}, most_m{};
};

/// The cells in which the pixels of a row end, from left to right; neighbours in one cell are one entry.
struct SurfaceRow {
  static constexpr std::size_t kPad = 8;  ///< Room for whole vectors.
  alignas(32) std::array<std::array<std::int32_t, kMaxImageSide + 2 * kPad>, 3> cell{};
  std::size_t count{0};
};

/// Fills `row` with the cells in which the pixels of a line end.
/// Precondition: at most kMaxImageSide depths, most_m at most kMaxRange_m. RT-safe: O(pixels).
void end_cells(const PixelLine& line, std::span<const float> depth_m, const SurfaceDepths& depths,
               SurfaceRow& row) noexcept;

/// A row of tiles in space, in cells of any size: as PixelLine, for the tiles' middles.
struct TileLine {
  std::array<std::int32_t, 3> origin{};
  std::array<float, 3> rest{}, first{}, step{};
  std::array<float, 3> half{};  ///< How much a direction differs at most within a tile.
  float steps_per_m{};
};

/// For each tile, the cells in which its pixels can end.
struct TileRow {
  static constexpr std::size_t kMost = kMaxImageSide + 8;
  using Cells = std::array<std::array<std::int32_t, kMost>, 3>;
  alignas(32) Cells low{};
  alignas(32) Cells high{};
  alignas(32) Cells nearest{};        ///< Where the tile's middle would end at its least depth.
  std::array<bool, kMost> surface{};  ///< Whether the tile shows a surface.
};

/// Bounds of a row of tiles, `stride` entries apart.
struct TileEntries {
  const DepthEntry* entry{};
  std::size_t stride{}, count{};
};

/// Fills `row` for each of the tiles. RT-safe: O(tiles).
void tile_boxes(const TileLine& line, const TileEntries& tiles, TileRow& row) noexcept;

}  // namespace roborun::stages
