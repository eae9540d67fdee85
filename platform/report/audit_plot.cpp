#include "platform/report/audit_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "platform/report/svg.hpp"

namespace roborun::report {
namespace {

constexpr double kHeight = 220, kLeft = 66, kBottom = 30, kTop = 22, kRight = 10;

/// One plot with its scales: x and y are given as 0 .. 1 of the frame.
class Plot {
 public:
  Plot(const std::string& title, double width) : width_(width) {
    svg_ = fmt::format(
        R"(<svg viewBox="0 0 {0} {1}" width="{0}" height="{1}" role="img" aria-label="{3}"><text x="{2}" y="14" class="t">{3}</text>)",
        width_, kHeight, kLeft, xml_escape(title));
  }
  [[nodiscard]] double x(double share) const { return kLeft + (width_ - kLeft - kRight) * share; }
  [[nodiscard]] static double y(double share) {
    return kHeight - kBottom - (kHeight - kTop - kBottom) * share;
  }
  void vertical(double share, const std::string& label, const char* style = "g") {
    svg_ += fmt::format(
        R"(<line x1="{0:.1f}" x2="{0:.1f}" y1="{1}" y2="{2}" class="{3}"/><text x="{0:.1f}" y="{4}" text-anchor="{6}">{5}</text>)",
        x(share), kTop, kHeight - kBottom, style, kHeight - kBottom + 16, label,
        share > 0.99 ? "end" : "middle");
  }
  void horizontal(double share, const std::string& label, const char* style = "g") {
    svg_ += fmt::format(
        R"(<line x1="{0}" x2="{1}" y1="{2:.1f}" y2="{2:.1f}" class="{3}"/><text x="{4}" y="{5:.1f}" text-anchor="end">{6}</text>)",
        kLeft, width_ - kRight, y(share), style, kLeft - 4, y(share) + 4, label);
  }
  void line(const std::vector<std::pair<double, double>>& points, const char* style) {
    svg_ += fmt::format(R"(<polyline class="{}" points=")", style);
    for (const auto& [px, py] : points) svg_ += fmt::format("{:.1f},{:.1f} ", x(px), y(py));
    svg_ += "\"/>";
  }
  void add(const std::string& text) { svg_ += text; }
  [[nodiscard]] std::string finish() const { return svg_ + "</svg>\n"; }

 private:
  double width_;
  std::string svg_;
};

/// From 0 at `low` to 1 at `high`, both powers of ten.
double log_share(double us, double low, double high) {
  return std::clamp((std::log10(std::max(us, 0.01)) - low) / std::max(high - low, 1.0), 0.0, 1.0);
}

}  // namespace

std::string exceedance_plot(const std::string& title, const TimingSummary& t, double limit_us) {
  if (t.count == 0) return {};
  const double low = std::floor(std::log10(std::max(t.min_us, 0.1)));
  const double high = std::ceil(std::log10(std::max({t.max_us, limit_us, 1.0})) + 1e-9);
  const double decades = std::max(1.0, std::ceil(std::log10(static_cast<double>(t.count))));
  Plot plot(title, 420);
  for (double d = low; d <= high; ++d)
    plot.vertical(log_share(std::pow(10.0, d), low, high), fmt::format("{:g} us", std::pow(10.0, d)));
  for (double d = 0; d <= decades; ++d) plot.horizontal(1.0 - d / decades, fmt::format("1e-{:.0f}", d));
  if (limit_us > 0) plot.vertical(log_share(limit_us, low, high), "", "b");
  std::vector<std::pair<double, double>> points;
  for (const auto& [us, share] : t.exceedance)
    points.emplace_back(log_share(us, low, high), 1.0 + std::log10(share) / decades);
  points.emplace_back(log_share(t.max_us, low, high), 0.0);
  plot.line(points, "p");
  return plot.finish();
}

std::string time_line_plot(const AuditLane& lane, double seconds) {
  double longest_us = lane.period_us;
  for (const TimeColumn& c : lane.time_line) longest_us = std::max(longest_us, c.worst_response_us);
  if (lane.frames == 0 || lane.time_line.empty()) return {};
  const double low = 0.0, high = std::ceil(std::log10(std::max(longest_us, 10.0)) + 1e-9);
  Plot plot(fmt::format("{}: worst of each {:.2g} s; bars: missed deadlines", lane.name,
                        seconds / static_cast<double>(kTimeColumns)),
            860);
  for (double d = low; d <= high; ++d)
    plot.horizontal(log_share(std::pow(10.0, d), low, high), fmt::format("{:g} us", std::pow(10.0, d)));
  for (int i = 0; i <= 4; ++i) plot.vertical(0.25 * i, fmt::format("{:.3g} s", 0.25 * i * seconds));
  if (lane.period_us > 0) plot.horizontal(log_share(lane.period_us, low, high), "", "b");
  std::vector<std::pair<double, double>> jitter, response;
  for (std::size_t i = 0; i < lane.time_line.size(); ++i) {
    const TimeColumn& c = lane.time_line[i];
    const double at = (static_cast<double>(i) + 0.5) / static_cast<double>(lane.time_line.size());
    if (c.misses > 0)
      plot.add(fmt::format(
          R"(<line x1="{0:.1f}" x2="{0:.1f}" y1="{1}" y2="{2}" class="m"><title>{3} missed</title></line>)",
          plot.x(at), kTop, kHeight - kBottom, c.misses));
    if (c.frames == 0) continue;
    jitter.emplace_back(at, log_share(c.worst_jitter_us, low, high));
    response.emplace_back(at, log_share(c.worst_response_us, low, high));
  }
  plot.line(response, "r");
  plot.line(jitter, "p");
  plot.add(
      fmt::format(R"(<text x="{}" y="14" text-anchor="end">solid: wake-up jitter, dotted: response</text>)",
                  860 - kRight));
  return plot.finish();
}

std::string return_level_plot(const std::string& title, const Pwcet& p) {
  if (!p.fitted || p.levels.empty() || p.observed_us.empty()) return {};
  const double first = p.levels.front().reduced, last = p.levels.back().reduced;
  double low = p.observed_us.front().second, high = low;
  for (const ReturnLevel& l : p.levels) {
    low = std::min(low, l.low_us);
    high = std::max(high, l.high_us);
  }
  for (const auto& [reduced, us] : p.observed_us) high = std::max(high, us);
  const auto x = [&](double reduced) { return (reduced - first) / (last - first); };
  const auto y = [&](double us) { return (us - low) / std::max(high - low, 1e-9); };
  Plot plot(title, 420);
  for (const double decade : {1.0, 3.0, 5.0, 7.0, 9.0})
    plot.vertical(x(decade * std::log(10.0)), fmt::format("1 in 1e{:.0f}", decade));
  for (int i = 0; i <= 4; ++i)
    plot.horizontal(0.25 * i, fmt::format("{:.4g} us", low + 0.25 * i * (high - low)));
  std::vector<std::pair<double, double>> fit, below, above;
  for (const ReturnLevel& l : p.levels) {
    fit.emplace_back(x(l.reduced), y(l.level_us));
    below.emplace_back(x(l.reduced), y(l.low_us));
    above.emplace_back(x(l.reduced), y(l.high_us));
  }
  plot.line(fit, "p");
  plot.line(below, "r");
  plot.line(above, "r");
  for (const auto& [reduced, us] : p.observed_us)
    plot.add(fmt::format(R"(<circle cx="{:.1f}" cy="{:.1f}" r="1.5"/>)", plot.x(x(reduced)), Plot::y(y(us))));
  return plot.finish();
}

}  // namespace roborun::report
