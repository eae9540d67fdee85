#include "platform/report/sweep_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "platform/report/svg.hpp"
#include "platform/report/sweep_sensitivity.hpp"

namespace roborun::report {
namespace {

constexpr double kLeft = 50.0;
constexpr std::array<const char*, 6> kDesignColour{"#0072b2", "#d55e00", "#009e73",
                                                   "#cc79a7", "#e69f00", "#56b4e9"};
constexpr std::array<const char*, core::kStageCount> kStageColour{"#7b8794", "#cc79a7", "#0072b2",
                                                                  "#56b4e9", "#e69f00", "#009e73"};

const char* colour_of(std::size_t design) { return kDesignColour[design % kDesignColour.size()]; }

/// A step of 1, 2 or 5 times a power of ten that gives at most `parts` parts.
double nice_step(double span, double parts) {
  const double raw = span / parts;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= raw) return factor * power;
  }
  return 10.0 * power;
}

/// A rectangle with a scale from low (bottom) to high (top).
struct Panel {
  double left, top, width, height;
  double low, high;
  bool logarithmic;

  [[nodiscard]] double y(double value) const {
    const double ratio = logarithmic ? std::log(std::max(value, low) / low) / std::log(high / low)
                                     : (value - low) / (high - low);
    return top + height * (1.0 - std::clamp(ratio, 0.0, 1.0));
  }
  void tick(Svg& svg, double value) const {
    svg.add(R"(<line x1="{0:.1f}" x2="{1:.1f}" y1="{2:.1f}" y2="{2:.1f}" stroke="{3}"/>)", left, left + width,
            y(value), kGrid);
    svg.text(left - 6, y(value) + 4, fmt::format("{:g}", value), "end", 11, kSoft);
  }
  void draw(Svg& svg, const std::string& title) const {
    svg.text(left, top - 8, title, "start", 13, kInk, "bold");
    if (logarithmic) {
      for (double power = std::pow(10.0, std::floor(std::log10(low))); power <= high * 1.001; power *= 10.0) {
        for (const double factor : {1.0, 2.0, 5.0}) {
          if (factor * power >= low * 0.999 && factor * power <= high * 1.001) tick(svg, factor * power);
        }
      }
    } else {
      const double step = nice_step(high - low, 4.0);
      for (int i = 0; low + i * step <= high * 1.001; ++i) tick(svg, low + i * step);
    }
    svg.add(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="none" stroke="#cbd2d9"/>)",
            left, top, width, height);
  }
  void whisker(Svg& svg, double x, const Estimate& e) const {
    if (!std::isfinite(e.half_95)) return;
    const double upper = y(e.mean + e.half_95);
    const double lower = y(e.mean - e.half_95);
    svg.add(
        R"(<path d="M {0:.1f} {1:.1f} V {2:.1f} M {3:.1f} {1:.1f} H {4:.1f} M {3:.1f} {2:.1f} H {4:.1f}" stroke="{5}" stroke-width="1.4" fill="none"/>)",
        x, upper, lower, x - 5.0, x + 5.0, kInk);
  }
};

std::string three_digits(double value) {
  if (!std::isfinite(value)) return "-";
  return value >= 100.0 ? fmt::format("{:.0f}", value) : fmt::format("{:.3g}", value);
}

/// What a chart shows of a design.
struct Bar {
  std::string title;
  Estimate (*value)(const DesignSummary&);
  double (*printed)(const Published&);  ///< Null: nothing was printed.
};

void draw_bars(Svg& svg, const std::vector<DesignSummary>& summaries, const Bar& bar, double left,
               double top) {
  double high = 1e-9;
  for (const DesignSummary& s : summaries) {
    const Estimate e = bar.value(s);
    if (std::isfinite(e.mean)) high = std::max(high, e.mean + (std::isfinite(e.half_95) ? e.half_95 : 0.0));
    const auto p = published(s.design);
    if (p && bar.printed != nullptr) high = std::max(high, bar.printed(*p));
  }
  const Panel panel{left, top, 190.0, 230.0, 0.0, 1.12 * high, false};
  panel.draw(svg, bar.title);
  const double place = panel.width / static_cast<double>(summaries.size());
  for (std::size_t i = 0; i < summaries.size(); ++i) {
    const Estimate e = bar.value(summaries[i]);
    const double x = panel.left + place * (static_cast<double>(i) + 0.5);
    const double half = 0.32 * place;
    if (std::isfinite(e.mean)) {
      svg.add(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="{}"/>)", x - half,
              panel.y(e.mean), 2.0 * half, panel.y(0.0) - panel.y(e.mean), colour_of(i));
      panel.whisker(svg, x, e);
    }
    svg.text(x, panel.top + panel.height + 17.0, three_digits(e.mean), "middle", 12, kInk, "bold");
    const auto p = published(summaries[i].design);
    if (!p || bar.printed == nullptr) continue;
    const double y = panel.y(bar.printed(*p));
    svg.add(
        R"(<line x1="{:.1f}" x2="{:.1f}" y1="{:.1f}" y2="{:.1f}" stroke="{}" stroke-width="2.5" stroke-dasharray="5 3"/>)",
        x - 0.45 * place, x + 0.45 * place, y, y, kInk);
    svg.text(x, panel.top + panel.height + 32.0, fmt::format("[{:g}]", bar.printed(*p)), "middle", 11, kSoft);
  }
}

struct Metric {
  const char* name;
  double (*value)(const MissionResult&);
  bool printed;
};

std::vector<std::string> designs_of(const std::vector<SweepRow>& rows, const std::string& profile) {
  std::vector<std::string> designs;
  for (const DesignSummary& s : summarise(rows)) {
    if (s.profile == profile) designs.push_back(s.design);
  }
  return designs;
}

/// What a chart shows of one design over a knob.
struct Curve {
  std::vector<Estimate> points;  ///< One per value of the knob, or none.
  std::string missing;           ///< Why there is none.
};

void draw_sensitivity(Svg& svg, const std::vector<SweepRow>& rows, const std::string& profile,
                      const Knob& knob, const Metric& metric, double left, double top) {
  const std::vector<std::string> designs = designs_of(rows, profile);
  std::vector<Curve> curves;
  double low = std::numeric_limits<double>::infinity();
  double high = 0.0;
  for (const std::string& design : designs) {
    const Sensitivity s = sensitivity_of(rows, profile, design, knob);
    Curve& curve = curves.emplace_back();
    curve.missing = s.missing;
    for (const auto& missions : s.at) {
      if (missions.empty()) continue;
      curve.points.push_back(estimate(missions, metric.value));
      low = std::min(low, curve.points.back().mean);
      high = std::max(high, curve.points.back().mean);
    }
  }
  if (!(high > 0.0 && low > 0.0)) low = high = 1.0;
  const Panel panel{left, top, 205.0, 180.0, low / 1.6, high * 1.6, true};
  panel.draw(svg, fmt::format("{} over {}", metric.name, knob.name));
  const auto x = [&](std::size_t i) {
    return panel.left + panel.width * (0.1 + 0.4 * static_cast<double>(i));  // three values
  };
  for (std::size_t i = 0; i < knob.values.size(); ++i)
    svg.text(x(i), panel.top + panel.height + 16.0, fmt::format("{:g}", knob.values.at(i)), "middle", 11,
             kSoft);
  for (std::size_t d = 0; d < designs.size(); ++d) {
    const std::vector<Estimate>& points = curves[d].points;
    if (points.empty()) {
      svg.text(panel.left + 8.0, panel.top + 18.0 + 16.0 * static_cast<double>(d),
               fmt::format("{}: {}", designs[d], curves[d].missing), "start", 11, colour_of(d));
      continue;
    }
    std::string line;
    for (std::size_t i = 0; i < points.size(); ++i)
      line += fmt::format("{:.1f},{:.1f} ", x(i), panel.y(points[i].mean));
    svg.add(R"(<polyline points="{}" fill="none" stroke="{}" stroke-width="2"/>)", line, colour_of(d));
    for (std::size_t i = 0; i < points.size(); ++i) {
      panel.whisker(svg, x(i), points[i]);
      svg.add(R"(<circle cx="{:.1f}" cy="{:.1f}" r="3.5" fill="{}"/>)", x(i), panel.y(points[i].mean),
              colour_of(d));
    }
    std::string ratio = fmt::format("{:.2f}x", points.back().mean / points.front().mean);
    const auto p = published(designs[d]);
    if (p && metric.printed) ratio += fmt::format(" [{:g}x]", knob.printed_ratio(*p));
    svg.text(panel.left + 4.0 + 85.0 * static_cast<double>(d), panel.top + panel.height + 33.0, ratio,
             "start", 12, colour_of(d), "bold");
  }
}

/// A line for each name; returns where the next line would be.
double draw_key(Svg& svg, const std::vector<std::string>& names, double left, double y) {
  for (std::size_t i = 0; i < names.size(); ++i, y += 18.0) {
    svg.add(R"(<rect x="{:.1f}" y="{:.1f}" width="12" height="12" rx="2" fill="{}"/>)", left, y - 11.0,
            colour_of(i));
    svg.text(left + 18.0, y, names[i], "start", 13);
  }
  return y;
}

/// What the bars show first: who is faster than whom.
std::string finding_of(const std::vector<DesignSummary>& summaries) {
  std::vector<const DesignSummary*> flown;
  for (const DesignSummary& s : summaries)
    if (std::isfinite(s.velocity_mps.mean) && s.velocity_mps.mean > 0.0) flown.push_back(&s);
  if (flown.empty()) return "No mission reached its goal";
  const auto [slowest, fastest] = std::minmax_element(
      flown.begin(), flown.end(),
      [](const auto* a, const auto* b) { return a->velocity_mps.mean < b->velocity_mps.mean; });
  const auto name = [](const DesignSummary& s) { return fmt::format("{} ({})", s.design, s.profile); };
  if (flown.size() == 1)
    return fmt::format("{} flies {:.2f} m/s", name(*flown.front()), flown.front()->velocity_mps.mean);
  return fmt::format("{} flies {:.1f} times as fast as {}", name(**fastest),
                     (*fastest)->velocity_mps.mean / (*slowest)->velocity_mps.mean, name(**slowest));
}

/// The knob that costs a design most time.
std::string finding_of(const std::vector<SweepRow>& rows, const std::string& profile) {
  std::string finding = "No two missions differ in one knob alone";
  double most = 0.0;
  for (const std::string& design : designs_of(rows, profile)) {
    for (const Knob& knob : kKnobs) {
      const Sensitivity s = sensitivity_of(rows, profile, design, knob);
      if (s.at.front().empty() || s.at.back().empty()) continue;
      const double ratio =
          estimate(s.at.back(), mission_time).mean / estimate(s.at.front(), mission_time).mean;
      if (!(ratio > most)) continue;
      most = ratio;
      const std::string name(knob.name);
      finding = fmt::format("What costs most is {}: {} takes {:.2f} times as long at its highest",
                            name.substr(0, name.find(',')), design, ratio);
    }
  }
  return finding;
}

/// Time axis of one flight.
struct TimeAxis {
  double left, width, last_s;
  [[nodiscard]] double x(double s) const { return left + width * std::clamp(s / last_s, 0.0, 1.0); }
};

void draw_line(Svg& svg, const MissionReport& flight, const TimeAxis& axis, const Panel& panel,
               double (*value)(const DecisionRecord&), const char* colour) {
  std::string points;
  double y_before = panel.y(panel.low);
  for (const DecisionRecord& d : flight.decisions) {
    // As steps: a value holds until the next decision.
    points += fmt::format("{0:.1f},{1:.1f} {0:.1f},{2:.1f} ", axis.x(d.time_s), y_before, panel.y(value(d)));
    y_before = panel.y(value(d));
  }
  svg.add(R"(<polyline points="{}" fill="none" stroke="{}" stroke-width="1.3"/>)", points, colour);
}

void draw_stages(Svg& svg, const MissionReport& flight, const TimeAxis& axis, const Panel& panel) {
  // One path a stage: the tops of its part of each decision and back along the bottoms.
  const std::size_t count = flight.decisions.size();
  std::vector<double> bottom_s(count, 0.0);
  for (std::size_t stage = 0; stage < core::kStageCount; ++stage) {
    std::string area;
    for (std::size_t i = 0; i < count; ++i) {
      const DecisionRecord& d = flight.decisions[i];
      const double x0 = axis.x(d.time_s);
      const double x1 = axis.x(i + 1 < count ? flight.decisions[i + 1].time_s : d.time_s + d.deadline_s);
      const double top_s = bottom_s[i] + d.stage_s[stage];
      area += fmt::format("M{0:.1f} {2:.1f}V{3:.1f}H{1:.1f}V{2:.1f}z", x0, x1, panel.y(bottom_s[i]),
                          panel.y(top_s));
      bottom_s[i] = top_s;
    }
    svg.add(R"(<path d="{}" fill="{}"/>)", area, kStageColour[stage]);
  }
}

/// The stage that the first of some flights spends most time in.
std::string finding_of(std::span<const MissionReport> flights) {
  if (flights.empty()) return "No flight";
  std::array<double, core::kStageCount> spent_s{};
  for (const DecisionRecord& d : flights.front().decisions) {
    for (std::size_t i = 0; i < core::kStageCount; ++i) spent_s[i] += d.stage_s[i];
  }
  const double whole_s = std::accumulate(spent_s.begin(), spent_s.end(), 0.0);
  const auto most = std::max_element(spent_s.begin(), spent_s.end());
  return fmt::format("{} spends most of its time in the stage {}: {:.0f} %", flights.front().result.design,
                     core::to_string(static_cast<core::StageId>(most - spent_s.begin())),
                     whole_s > 0.0 ? 100.0 * *most / whole_s : 0.0);
}

std::size_t zone_of(const DecisionRecord& d, const std::vector<double>& borders_m) {
  return static_cast<std::size_t>(std::count_if(borders_m.begin(), borders_m.end(),
                                                [&d](double border_m) { return d.p_WB.x() >= border_m; }));
}

void draw_zones(Svg& svg, const MissionReport& flight, const std::vector<double>& borders_m, double left,
                double top) {
  const std::size_t zones = borders_m.size() + 1;
  std::vector<std::array<double, core::kStageCount>> mean_s(zones);
  std::vector<double> whole_s(zones, 0.0);
  for (std::size_t zone = 0; zone < zones; ++zone) {
    const auto inside = [&](const DecisionRecord& d) { return zone_of(d, borders_m) == zone; };
    const auto count = std::count_if(flight.decisions.begin(), flight.decisions.end(), inside);
    for (const DecisionRecord& d : flight.decisions) {
      for (std::size_t i = 0; inside(d) && i < core::kStageCount; ++i) {
        mean_s[zone][i] += d.stage_s[i] / static_cast<double>(count);
        whole_s[zone] += d.stage_s[i] / static_cast<double>(count);
      }
    }
  }
  const double high_s = std::max(0.1, 1.1 * *std::max_element(whole_s.begin(), whole_s.end()));
  const Panel panel{left, top, 150.0, 358.0, 0.0, high_s, false};
  panel.draw(svg, "mean by zone, s");
  const double place = panel.width / static_cast<double>(zones);
  for (std::size_t zone = 0; zone < zones; ++zone) {
    const double x = panel.left + place * (static_cast<double>(zone) + 0.2);
    double bottom_s = 0.0;
    for (std::size_t i = 0; i < core::kStageCount; ++i) {
      const double top_s = bottom_s + mean_s[zone][i];
      svg.add(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="{}"/>)", x, panel.y(top_s),
              0.6 * place, panel.y(bottom_s) - panel.y(top_s), kStageColour[i]);
      bottom_s = top_s;
    }
    const std::string name = zones == 1 ? std::string("all") : std::string(1, static_cast<char>('A' + zone));
    svg.text(x + 0.3 * place, panel.top + panel.height + 16.0, fmt::format("{}: {:.2f}", name, whole_s[zone]),
             "middle", 12);
  }
}

}  // namespace

std::string overall_svg(const std::vector<SweepRow>& rows) {
  const std::vector<DesignSummary> summaries = summarise(rows);
  const std::array<Bar, 5> bars{
      {{"mean velocity, m/s", [](const DesignSummary& s) { return s.velocity_mps; },
        [](const Published& p) { return p.velocity_mps; }},
       {"mission time, s", [](const DesignSummary& s) { return s.mission_time_s; },
        [](const Published& p) { return p.mission_time_s; }},
       {"energy, kJ", [](const DesignSummary& s) { return s.energy_kJ; },
        [](const Published& p) { return p.energy_kJ; }},
       {"median latency, s", [](const DesignSummary& s) { return s.latency_s; }, nullptr},
       {"CPU time per decision, s", [](const DesignSummary& s) { return s.cpu_s_per_decision; }, nullptr}}};
  Svg svg;
  std::vector<std::string> names;
  names.reserve(summaries.size());
  for (const DesignSummary& s : summaries)
    names.push_back(fmt::format("{}, {}: {} of {} reached, {} collided", s.design, s.profile, s.reached,
                                s.missions, s.collided));
  constexpr std::size_t kColumns = 3;
  constexpr double kRow = 320.0;
  const std::string finding = finding_of(summaries);
  svg.text(kLeft, 26.0, finding, "start", 15, kInk, "bold");
  double y = draw_key(svg, names, kLeft, 52.0) + 24.0;
  for (std::size_t i = 0; i < bars.size() && !summaries.empty(); ++i)
    draw_bars(svg, summaries, bars[i], kLeft + 265.0 * static_cast<double>(i % kColumns),
              y + kRow * static_cast<double>(i / kColumns));
  y += 2.0 * kRow - 20.0;
  const std::string key =
      "bars: means over the missions that reached the goal; whiskers: 95 % interval over seeds; dashes and "
      "[ ]: published";
  svg.text(kLeft, y, key, "start", 12, kSoft);
  return svg.finish(y + 16.0, finding,
                    "Means by design: velocity, mission time, energy, latency. " + key + ".");
}

std::string sensitivity_svg(const std::vector<SweepRow>& rows, const std::string& profile) {
  constexpr std::array<Metric, 3> kMetrics{{{"time, s,", mission_time, true},
                                            {"velocity, m/s,", velocity, false},
                                            {"energy, kJ,", energy, false}}};
  Svg svg;
  const std::string finding = finding_of(rows, profile);
  svg.text(kLeft, 26.0, finding, "start", 15, kInk, "bold");
  double y = draw_key(svg, designs_of(rows, profile), kLeft, 52.0) + 24.0;
  for (const Metric& metric : kMetrics) {
    for (std::size_t k = 0; k < kKnobs.size(); ++k)
      draw_sensitivity(svg, rows, profile, kKnobs[k], metric, kLeft + 255.0 * static_cast<double>(k), y);
    y += 260.0;
  }
  svg.text(kLeft, y, "only missions that differ in nothing but the knob; whiskers: 95 % interval over seeds;",
           "start", 12, kSoft);
  svg.text(kLeft, y + 16.0, "below each chart: highest knob against lowest, [ ]: published", "start", 12,
           kSoft);
  return svg.finish(y + 32.0, finding, "Mission time, velocity and energy over each knob of an environment.");
}

std::string breakdown_svg(std::span<const MissionReport> flights, const std::vector<double>& zone_borders_m) {
  constexpr double kChart = 530.0;
  Svg svg;
  const std::string finding = finding_of(flights);
  svg.text(kLeft, 26.0, finding, "start", 15, kInk, "bold");
  double key_x = kLeft;
  for (std::size_t i = 0; i < core::kStageCount; ++i) {
    svg.add(R"(<rect x="{:.1f}" y="41" width="12" height="12" rx="2" fill="{}"/>)", key_x, kStageColour[i]);
    svg.text(key_x + 18.0, 52.0, core::to_string(static_cast<core::StageId>(i)));
    key_x += 120.0;
  }
  svg.text(kLeft, 72.0, "line: deadline; dashed: borders of the zones");
  double y = 136.0;
  for (const MissionReport& flight : flights) {
    double last_s = 1.0;
    double longest_s = 0.1;
    double fastest_mps = 1.0;
    for (const DecisionRecord& d : flight.decisions) {
      last_s = std::max(last_s, d.time_s + d.deadline_s);
      longest_s = std::max(longest_s, d.latency_s);
      fastest_mps = std::max(fastest_mps, d.speed_mps);
    }
    const TimeAxis axis{kLeft, kChart, last_s};
    svg.text(kLeft, y - 28.0, flight.result.design, "start", 16, kInk, "bold");
    const Panel speed{kLeft, y, kChart, 70.0, 0.0, std::ceil(fastest_mps), false};
    const Panel precision{kLeft, y + 104.0, kChart, 70.0, 0.25, 10.0, true};
    const Panel latency{kLeft, y + 208.0, kChart, 150.0, 0.0, 1.1 * longest_s, false};
    speed.draw(svg, "velocity, m/s");
    precision.draw(svg, "precision p0, m");
    latency.draw(svg, "latency by stage, s");
    draw_line(
        svg, flight, axis, speed, [](const DecisionRecord& d) { return d.speed_mps; }, kInk);
    draw_line(
        svg, flight, axis, precision, [](const DecisionRecord& d) { return d.p0_m; }, kInk);
    draw_stages(svg, flight, axis, latency);
    draw_line(
        svg, flight, axis, latency, [](const DecisionRecord& d) { return d.deadline_s; }, kInk);
    for (std::size_t i = 1; i < flight.decisions.size(); ++i) {
      const DecisionRecord& d = flight.decisions[i];
      if (zone_of(d, zone_borders_m) == zone_of(flight.decisions[i - 1], zone_borders_m)) continue;
      svg.add(
          R"(<line x1="{0:.1f}" x2="{0:.1f}" y1="{1:.1f}" y2="{2:.1f}" stroke="{3}" stroke-dasharray="6 5"/>)",
          axis.x(d.time_s), speed.top, latency.top + latency.height, kSoft);
    }
    const double step_s = nice_step(last_s, 8.0);
    for (int i = 0; i * step_s <= last_s; ++i)
      svg.text(axis.x(i * step_s), latency.top + latency.height + 16.0, fmt::format("{:g} s", i * step_s),
               "middle", 11, kSoft);
    draw_zones(svg, flight, zone_borders_m, kLeft + kChart + 60.0, y);
    y += 452.0;
  }
  return svg.finish(
      y - 50.0, finding,
      "Velocity, precision and latency by stage of each design over the time of its flight, and the mean "
      "latency in each zone.");
}

}  // namespace roborun::report
