/// An occupancy map as a picture: from above, and cut.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace roborun::report {

enum class CellColour : std::uint8_t { kUnknown, kFree, kOccupied };

/// A raster of cells, drawn true to scale with its own axes.
struct MapPanel {
  std::string title;
  std::string right_axis, up_axis;  ///< Names with unit: "x [m]".
  double right_m{}, up_m{};         ///< Lower left corner.
  double cell_m{1.0};
  int columns{}, rows{};         ///< Both > 0.
  std::vector<CellColour> cell;  ///< [row * columns + column], lowest row first.
};

/// A complete SVG file without external resources: the panels below one another and a legend.
[[nodiscard]] std::string map_svg(const std::string& title, std::span<const MapPanel> panels);

}  // namespace roborun::report
