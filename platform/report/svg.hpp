/// Elements of an SVG file, and the colours of all pictures.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <string>

namespace roborun::report {

inline constexpr const char* kInk = "#1f2933";
inline constexpr const char* kSoft = "#7b8794";  ///< Readable on light and dark.
inline constexpr const char* kGrid = "#e4e7eb";
inline constexpr const char* kPaper = "#ffffff";
/// Of every picture: a page of GitHub is about so wide, and texts are read at their size there.
inline constexpr double kPictureWidth = 830.0;

/// A dark-to-bright ramp that stays readable without colour vision: violet, teal, yellow-green. ratio 0 .. 1,
/// as #rrggbb.
[[nodiscard]] inline std::string ramp_colour(double ratio) {
  constexpr std::array<std::array<double, 3>, 6> kStops{
      {{68, 1, 84}, {65, 68, 135}, {42, 120, 142}, {34, 168, 132}, {122, 209, 81}, {240, 220, 40}}};
  const double at = std::clamp(ratio, 0.0, 1.0) * (kStops.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(at), kStops.size() - 2);
  const double share = at - static_cast<double>(i);
  const auto mix = [&](std::size_t c) {
    return static_cast<int>(kStops[i][c] + share * (kStops[i + 1][c] - kStops[i][c]));
  };
  return fmt::format("#{:02x}{:02x}{:02x}", mix(0), mix(1), mix(2));
}

/// Text as XML wants it; control characters become spaces.
[[nodiscard]] inline std::string xml_escape(const std::string& raw) {
  std::string text;
  for (const char c : raw) {
    switch (c) {
      case '&':
        text += "&amp;";
        break;
      case '<':
        text += "&lt;";
        break;
      case '>':
        text += "&gt;";
        break;
      case '"':
        text += "&quot;";
        break;
      default:
        text += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
  }
  return text;
}

class Svg {
 public:
  template <typename... Args>
  void add(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(body_), format, std::forward<Args>(args)...);
    body_ += '\n';
  }
  void text(double x, double y, const std::string& what, const char* anchor = "start", double size = 13,
            const char* fill = kInk, const char* weight = "normal") {
    add(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="{}" font-size="{}" fill="{}" font-weight="{}">{}</text>)",
        x, y, anchor, size, fill, weight, xml_escape(what));
  }
  /// The whole file, `kPictureWidth` wide; `title` and `description` are for those who cannot see it. Where the reader's
  /// screen is dark, paper and ink are exchanged; worlds from above stay as they are.
  [[nodiscard]] std::string finish(double height, const std::string& title,
                                   const std::string& description) const {
    return fmt::format(
        R"(<svg xmlns="http://www.w3.org/2000/svg" width="{0:.0f}" height="{1:.0f}" viewBox="0 0 {0:.0f} {1:.0f}" font-family="Helvetica, Arial, sans-serif">
<title>{3}</title>
<desc>{4}</desc>
<style>@media (prefers-color-scheme: dark) {{ [fill="{5}"] {{ fill: #14181d }} [fill="{6}"] {{ fill: #e4e7eb }} [stroke="{6}"] {{ stroke: #e4e7eb }} [stroke="{7}"] {{ stroke: #323f4b }} }}</style>
<rect width="100%" height="100%" fill="{5}"/>
{2}</svg>
)",
        kPictureWidth, height, body_, xml_escape(title), xml_escape(description), kPaper, kInk, kGrid);
  }

 private:
  std::string body_;
};

}  // namespace roborun::report
