#include "platform/report/calibration_plot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "platform/report/svg.hpp"

namespace roborun::report {
namespace {

constexpr std::size_t kColumns = 2;
constexpr double kPanelWidth = kPictureWidth / kColumns;
constexpr double kPanelHeight = 360.0;
constexpr double kMargin = 62.0;

struct Axis {
  double low{std::numeric_limits<double>::infinity()};
  double high{0.0};
  void cover(double x) {
    if (!(x > 0.0)) return;
    low = std::min(low, x);
    high = std::max(high, x);
  }
  void widen() {
    if (!(high > 0.0)) low = high = 1.0;
    low = std::pow(10.0, std::floor(std::log10(low)));
    high = std::pow(10.0, std::floor(std::log10(high)) + 1.0);
  }
  [[nodiscard]] double ratio(double x) const {
    return std::clamp(std::log10(std::max(x, low) / low) / std::log10(high / low), 0.0, 1.0);
  }
};

void draw_panel(Svg& svg, const CalibrationPanel& panel, double left, double top) {
  Axis volume;
  Axis time;
  for (const CalibrationCurve& curve : panel.curves) {
    for (const CalibrationPoint& p : curve.points) {
      volume.cover(p.volume_m3);
      time.cover(p.measured_s);
    }
  }
  volume.widen();
  time.widen();
  const auto x = [&](double v) { return left + kMargin + volume.ratio(v) * (kPanelWidth - 1.4 * kMargin); };
  const auto y = [&](double t) { return top + kPanelHeight - 44.0 - time.ratio(t) * (kPanelHeight - 84.0); };
  svg.text(left + kMargin, top + 24.0, panel.title, "start", 15, kInk, "bold");
  for (double v = volume.low; v <= volume.high * 1.01; v *= 10.0) {
    svg.add(R"(<line x1="{0:.1f}" y1="{1:.1f}" x2="{0:.1f}" y2="{2:.1f}" stroke="{3}"/>)", x(v), y(time.low),
            y(time.high), kGrid);
    svg.text(x(v), y(time.low) + 18.0, fmt::format("{:g}", v), "middle", 12, kSoft);
  }
  for (double t = time.low; t <= time.high * 1.01; t *= 10.0) {
    svg.add(R"(<line x1="{1:.1f}" y1="{0:.1f}" x2="{2:.1f}" y2="{0:.1f}" stroke="{3}"/>)", y(t),
            x(volume.low), x(volume.high), kGrid);
    svg.text(x(volume.low) - 6.0, y(t) + 4.0, fmt::format("{:g}", 1e3 * t), "end", 12, kSoft);
  }
  svg.text(x(volume.low), y(time.low) + 36.0, "volume, m3; time, ms", "start", 12, kSoft);
  for (std::size_t c = 0; c < panel.curves.size(); ++c) {
    const CalibrationCurve& curve = panel.curves[c];
    const std::string colour =
        ramp_colour(static_cast<double>(c) / std::max<double>(1.0, static_cast<double>(panel.curves.size())));
    std::string line;
    constexpr int kSteps = 40;
    for (int i = 0; i <= kSteps; ++i) {
      const double v = volume.low * std::pow(volume.high / volume.low, static_cast<double>(i) / kSteps);
      line += fmt::format("{:.1f},{:.1f} ", x(v), y(curve.fixed_s + curve.slope_s_per_m3 * v));
    }
    svg.add(R"(<polyline points="{}" fill="none" stroke="{}" stroke-width="1.5"/>)", line, colour);
    for (const CalibrationPoint& p : curve.points) {
      if (!(p.volume_m3 > 0.0)) continue;
      svg.add(R"(<circle cx="{:.1f}" cy="{:.1f}" r="3" fill="{}" stroke="{}"/>)", x(p.volume_m3),
              y(p.measured_s), p.hold_out ? kPaper : colour, colour);
    }
    svg.text(left + kPanelWidth - 8.0, top + 60.0 + 17.0 * static_cast<double>(c),
             fmt::format("{} m", curve.cell_m), "end", 12, colour.c_str(), "bold");
  }
}

}  // namespace

std::string calibration_svg(const std::string& title, const std::vector<CalibrationPanel>& panels) {
  Svg svg;
  svg.text(20.0, 28.0, title, "start", 17, kInk, "bold");
  for (std::size_t i = 0; i < panels.size(); ++i)
    draw_panel(svg, panels[i], kPanelWidth * static_cast<double>(i % kColumns),
               36.0 + kPanelHeight * static_cast<double>(i / kColumns));
  const double bottom = 60.0 + kPanelHeight * static_cast<double>((panels.size() + kColumns - 1) / kColumns);
  const std::string key =
      "lines: the model; filled points: fitted; open points: held out; colours: precision";
  svg.text(20.0, bottom, key, "start", 12, kSoft);
  return svg.finish(bottom + 16.0, title, "Time of a stage over the volume that it worked on. " + key + ".");
}

}  // namespace roborun::report
