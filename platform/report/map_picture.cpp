#include "platform/report/map_picture.hpp"

#include <algorithm>

#include "platform/report/svg.hpp"

namespace roborun::report {
namespace {

constexpr double kMargin_px = 50.0;
constexpr double kTallest_px = 700.0;
// On dark screens, too.
constexpr const char* kOccupied = "#222";
constexpr const char* kFree = "#cfe8ff";
constexpr const char* kUnknown = "#d9d9d9";

double scale_px(const MapPanel& panel) {
  return std::min((kPictureWidth - 2.0 * kMargin_px) / panel.columns, kTallest_px / panel.rows);
}

/// Runs of equal cells in a row are one rectangle.
void draw(const MapPanel& panel, double top_px, Svg& svg) {
  const double px = scale_px(panel);
  const double bottom_px = top_px + px * panel.rows;
  svg.text(kMargin_px, top_px - 8.0, panel.title);
  svg.add(R"(<rect x="{}" y="{:.1f}" width="{:.2f}" height="{:.2f}" fill="{}" stroke="{}"/>)", kMargin_px,
          top_px, px * panel.columns, px * panel.rows, kUnknown, kSoft);
  for (int row = 0; row < panel.rows; ++row) {
    const CellColour* cell = panel.cell.data() + static_cast<std::ptrdiff_t>(row) * panel.columns;
    for (int begin = 0, end = 0; begin < panel.columns; begin = end) {
      while (end < panel.columns && cell[end] == cell[begin]) ++end;
      if (cell[begin] == CellColour::kUnknown) continue;
      svg.add(R"(<rect x="{:.2f}" y="{:.2f}" width="{:.2f}" height="{:.2f}" fill="{}"/>)",
              kMargin_px + px * begin, top_px + px * (panel.rows - 1 - row), px * (end - begin), px,
              cell[begin] == CellColour::kFree ? kFree : kOccupied);
    }
  }
  svg.text(kMargin_px, bottom_px + 16.0,
           fmt::format("{:.1f} .. {:.1f} {}", panel.right_m, panel.right_m + panel.cell_m * panel.columns,
                       panel.right_axis));
  svg.add(
      R"x(<text transform="translate({},{:.1f}) rotate(-90)" font-size="13" fill="{}">{:.1f} .. {:.1f} {}</text>)x",
      kMargin_px - 8.0, bottom_px, kInk, panel.up_m, panel.up_m + panel.cell_m * panel.rows,
      xml_escape(panel.up_axis));
}

}  // namespace

std::string map_svg(const std::string& title, std::span<const MapPanel> panels) {
  constexpr double kLegend_px = 40.0;
  Svg svg;
  svg.text(kMargin_px, 26.0, title, "start", 16);
  double x_px = kMargin_px;
  for (const auto& [colour, what] :
       {std::pair{kOccupied, "occupied"}, std::pair{kFree, "free"}, std::pair{kUnknown, "unknown"}}) {
    svg.add(R"(<rect x="{}" y="{}" width="12" height="12" fill="{}"/>)", x_px, kLegend_px, colour);
    svg.text(x_px + 18.0, kLegend_px + 11.0, what);
    x_px += 95.0;
  }
  double top_px = 70.0;
  for (const MapPanel& panel : panels) {
    top_px += 24.0;
    draw(panel, top_px, svg);
    top_px += scale_px(panel) * panel.rows + 36.0;
  }
  return svg.finish(top_px, title, "Cuts through the map: occupied, free and unknown cells.");
}

}  // namespace roborun::report
