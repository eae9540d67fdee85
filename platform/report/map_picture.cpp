#include "platform/report/map_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "platform/report/svg.hpp"

namespace roborun::report {
namespace {

constexpr double kMargin_px = 50.0;
constexpr double kTallest_px = 700.0;

double scale_px(const MapPanel& panel) {
  return std::min((kPictureWidth - 2.0 * kMargin_px) / panel.columns, kTallest_px / panel.rows);
}

/// Runs of equal cells in a row are one rectangle.
void draw(const MapPanel& panel, double top_px, std::string& out) {
  const double px = scale_px(panel);
  const auto to = std::back_inserter(out);
  fmt::format_to(to, "<text x='{}' y='{:.1f}'>{}</text>\n", kMargin_px, top_px - 8.0,
                 xml_escape(panel.title));
  fmt::format_to(to, "<rect x='{}' y='{:.1f}' width='{:.2f}' height='{:.2f}' fill='#d9d9d9'/>\n", kMargin_px,
                 top_px, px * panel.columns, px * panel.rows);
  for (int row = 0; row < panel.rows; ++row) {
    const CellColour* cell = panel.cell.data() + static_cast<std::ptrdiff_t>(row) * panel.columns;
    for (int begin = 0, end = 0; begin < panel.columns; begin = end) {
      while (end < panel.columns && cell[end] == cell[begin]) ++end;
      if (cell[begin] == CellColour::kUnknown) continue;
      fmt::format_to(to, "<rect x='{:.2f}' y='{:.2f}' width='{:.2f}' height='{:.2f}' class='{}'/>\n",
                     kMargin_px + px * begin, top_px + px * (panel.rows - 1 - row), px * (end - begin), px,
                     cell[begin] == CellColour::kFree ? "f" : "o");
    }
  }
  fmt::format_to(to, "<text x='{}' y='{:.1f}'>{:.1f} .. {:.1f} {}</text>\n", kMargin_px,
                 top_px + px * panel.rows + 16.0, panel.right_m, panel.right_m + panel.cell_m * panel.columns,
                 xml_escape(panel.right_axis));
  fmt::format_to(to, "<text transform='translate({},{:.1f}) rotate(-90)'>{:.1f} .. {:.1f} {}</text>\n",
                 kMargin_px - 8.0, top_px + px * panel.rows, panel.up_m,
                 panel.up_m + panel.cell_m * panel.rows, xml_escape(panel.up_axis));
}

}  // namespace

std::string map_svg(const std::string& title, std::span<const MapPanel> panels) {
  std::string body;
  double top_px = 70.0;
  for (const MapPanel& panel : panels) {
    top_px += 24.0;
    draw(panel, top_px, body);
    top_px += scale_px(panel) * panel.rows + 36.0;
  }
  return fmt::format(
             "<svg xmlns='http://www.w3.org/2000/svg' width='{0}' height='{1:.0f}' viewBox='0 0 {0} {1:.0f}' "
             "font-family='sans-serif' font-size='13' "
             "shape-rendering='crispEdges'>\n<title>{3}</title>\n<desc>Cuts through the map: "
             "occupied, free and unknown cells.</desc>\n"
             "<style>.f{{fill:#cfe8ff}}.o{{fill:#222}}</style>\n<rect width='100%' height='100%' "
             "fill='white'/>\n"
             "<text x='{2}' y='26' font-size='16'>{3}</text>\n"
             "<rect x='{2}' y='40' width='12' height='12' class='o'/><text x='68' y='51'>occupied</text>\n"
             "<rect x='150' y='40' width='12' height='12' class='f'/><text x='168' y='51'>free</text>\n"
             "<rect x='220' y='40' width='12' height='12' fill='#d9d9d9'/><text x='238' "
             "y='51'>unknown</text>\n",
             kPictureWidth, top_px, kMargin_px, xml_escape(title)) +
         body + "</svg>\n";
}

}  // namespace roborun::report
