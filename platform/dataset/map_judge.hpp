/// How far a map agrees with images that were taken later.
#pragma once

#include <cstdint>
#include <span>

#include "stages/perception/map_view.hpp"
#include "stages/perception/occupancy_map.hpp"

namespace roborun::dataset {

/// Of all images judged so far.
struct Agreement {
  std::uint64_t surface_pixels{};  ///< Pixels with a depth within the range.
  std::uint64_t in_free{};         ///< Of these: that end in a cell held free.
  std::uint64_t in_no_occupied{};  ///< Of these: that end in a cell held free or unknown.
  std::uint64_t
      occupied_shown{};  ///< Cells held occupied of which an image says something, each once an image.
  std::uint64_t occupied_passed{};  ///< Of these: that it sees past.

  /// Space held free in which a later image shows a surface; surfaces of later images that the map does not have; cells held
  /// occupied that a later image sees past. NaN: nothing was judged.
  [[nodiscard]] double false_free_ratio() const noexcept;
  [[nodiscard]] double missed_ratio() const noexcept;
  [[nodiscard]] double false_occupied_ratio() const noexcept;
};

/// Compares what the view holds with images that are not in it. An image says something of an occupied cell that lies whole
/// within its view and range: it sees past it if all pixels that meet the cell have depths more than 3 sigma behind it, and shows it if
/// one has a depth within it, 3 sigma more on both sides; otherwise (hidden, a hole) nothing. O(pixels + cells in reach).
void judge(const stages::MapView& view, std::span<const stages::PosedDepthFrame> frames,
           Agreement& agreement);

}  // namespace roborun::dataset
