#include "platform/report/evaluation_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "core/executive/stage_budget.hpp"
#include "platform/report/sweep_sensitivity.hpp"

namespace roborun::report {
namespace {

std::string kernels_of(const MissionResult& r) {
  return r.map == "own" && r.planner == "own" ? "own" : fmt::format("{} + {}", r.map, r.planner);
}

/// Of sweep rows or flights, in the order of first appearance.
template <typename Rows>
std::vector<std::string> names_of(const Rows& rows, std::string (*name)(const MissionResult&)) {
  std::vector<std::string> names;
  for (const auto& row : rows) {
    if (std::find(names.begin(), names.end(), name(row.result)) == names.end())
      names.push_back(name(row.result));
  }
  return names;
}

std::string design_of(const MissionResult& r) { return r.design; }
std::string profile_of(const MissionResult& r) { return r.profile; }

/// Mean time of the missions at `high` over that at `low`, for each seed that has both.
Estimate time_ratio(const std::vector<const SweepRow*>& high, const std::vector<const SweepRow*>& low) {
  std::set<std::uint64_t> seeds;
  for (const SweepRow* row : high) seeds.insert(row->result.seed);
  std::vector<double> ratios;
  for (const std::uint64_t seed : seeds) {
    const auto mean = [seed](const std::vector<const SweepRow*>& rows) {
      std::vector<const SweepRow*> mine;
      for (const SweepRow* row : rows) {
        if (row->result.seed == seed) mine.push_back(row);
      }
      return estimate(mine, mission_time).mean;
    };
    if (const double ratio = mean(high) / mean(low); std::isfinite(ratio)) ratios.push_back(ratio);
  }
  return estimate(ratios);
}

std::size_t zone_of(const DecisionRecord& d, const std::vector<double>& borders_m) {
  return static_cast<std::size_t>(std::count_if(borders_m.begin(), borders_m.end(),
                                                [&d](double border_m) { return d.p_WB.x() >= border_m; }));
}

/// What the decisions of one flight took in one zone.
struct ZoneTime {
  std::array<double, core::kStageCount> mean_s{};
  double whole_s{}, longest_s{};
  int decisions{};
};

ZoneTime time_in(const MissionReport& flight, const std::vector<double>& borders_m, std::size_t zone) {
  ZoneTime t;
  for (const DecisionRecord& d : flight.decisions) {
    if (zone_of(d, borders_m) != zone) continue;
    ++t.decisions;
    t.whole_s += d.latency_s;
    t.longest_s = std::max(t.longest_s, d.latency_s);
    for (std::size_t i = 0; i < core::kStageCount; ++i) t.mean_s[i] += d.stage_s[i];
  }
  for (double& s : t.mean_s) s /= std::max(t.decisions, 1);
  t.whole_s /= std::max(t.decisions, 1);
  return t;
}

/// What RoboRun printed of one mission is of its middle environment: it stands beside no other one.
bool is_published(const MissionResult& r) { return r.env == "14"; }

std::string zone_table(std::span<const MissionReport> flights, const std::vector<double>& borders_m) {
  constexpr const char* kRow = "{:<12} {:<4} {:>13} {:>8} {:>11}";
  std::string text = fmt::format(fmt::runtime(kRow), "latency, s", "zone", "mean", "longest", "published");
  for (const char* stage : {"cloud", "governor", "map", "export", "planner", "smoother"})
    text += fmt::format(" {:>8}", stage);
  text += '\n';
  for (const std::string& design : names_of(flights, design_of)) {
    for (std::size_t zone = 0; zone <= borders_m.size(); ++zone) {
      std::vector<double> whole_s;
      ZoneTime all;
      for (const MissionReport& f : flights) {
        const ZoneTime t = time_in(f, borders_m, zone);
        if (f.result.design != design || t.decisions == 0) continue;
        whole_s.push_back(t.whole_s);
        all.longest_s = std::max(all.longest_s, t.longest_s);
        for (std::size_t i = 0; i < core::kStageCount; ++i) all.mean_s[i] += t.mean_s[i];
      }
      if (whole_s.empty()) continue;
      // RoboRun printed the largest of its two designs in zones A and C, and a typical one in zone B.
      constexpr std::array<const char*, 3> kAware{"up to 10", "0.15", "up to 12.5"};
      std::string printed = design == "static" ? "up to 5.4" : "";
      if (design == "aware" && borders_m.size() == 2) printed = kAware[zone];
      if (!is_published(flights.front().result)) printed.clear();
      text += fmt::format(fmt::runtime(kRow), design,
                          borders_m.empty() ? "all" : std::string(1, static_cast<char>('A' + zone)),
                          shown(estimate(whole_s), 2), fmt::format("{:.2f}", all.longest_s), printed);
      for (const double s : all.mean_s)
        text += fmt::format(" {:>8.3f}", s / static_cast<double>(whole_s.size()));
      text += '\n';
    }
  }
  return text;
}

}  // namespace

std::string sensitivity_table(const std::vector<SweepRow>& rows, const std::string& profile) {
  constexpr const char* kRow = "{:<17} {:<12} {:>11} {:>13} {:>13} {:>13} {:>13} {:>10}\n";
  std::string text;
  for (const Knob& knob : kKnobs) {
    std::array<std::string, 3> head;
    for (std::size_t i = 0; i < head.size(); ++i) head.at(i) = fmt::format("s at {:g}", knob.values.at(i));
    text += fmt::format(fmt::runtime(kRow), knob.name, "design", "missions", head[0], head[1], head[2],
                        "last / first", "published");
    for (const std::string& design : names_of(rows, design_of)) {
      const Sensitivity s = sensitivity_of(rows, profile, design, knob);
      if (!s.missing.empty()) {
        text += fmt::format("{:<17} {:<12} not compared; {}\n", "", design, s.missing);
        continue;
      }
      std::array<std::string, 3> cell;
      for (std::size_t i = 0; i < cell.size(); ++i) cell.at(i) = shown(estimate(s.at.at(i), mission_time), 0);
      const auto p = published(design);
      text += fmt::format(fmt::runtime(kRow), "", design,
                          fmt::format("{} of {}", 3 * s.at.front().size(), s.missions), cell[0], cell[1],
                          cell[2], shown(time_ratio(s.at.back(), s.at.front()), 2),
                          p ? fmt::format("{:g}", knob.printed_ratio(*p)) : "");
    }
  }
  return text + "missions: those that have a twin at every value of the knob, all else being equal\n";
}

std::string representative_table(std::span<const MissionReport> flights,
                                 const std::vector<double>& zone_borders_m) {
  std::vector<SweepRow> rows;
  for (const MissionReport& f : flights) rows.push_back({f.result, 0.0, 0.0, 0.0});
  constexpr const char* kRow = "{:<14} {:>8} {:>14} {:>14} {:>14} {:>17}\n";
  std::string text = fmt::format(fmt::runtime(kRow), "design", "reached", "time s", "mean m/s", "energy kJ",
                                 "median latency s");
  for (const std::string& design : names_of(rows, design_of)) {
    std::vector<const SweepRow*> mine;
    for (const SweepRow& row : rows) {
      if (row.result.design == design) mine.push_back(&row);
    }
    const auto reached =
        std::count_if(mine.begin(), mine.end(), [](const SweepRow* row) { return counts(row->result); });
    text += fmt::format(fmt::runtime(kRow), design, fmt::format("{}/{}", reached, mine.size()),
                        shown(estimate(mine, mission_time), 0), shown(estimate(mine, velocity), 2),
                        shown(estimate(mine, energy), 0), shown(estimate(mine, latency), 2));
    if (is_published(mine.front()->result) && (design == "static" || design == "aware"))
      text +=
          fmt::format(fmt::runtime(kRow), "  published", "", "", design == "aware" ? "2.01" : "0.43", "", "");
  }
  const std::string profile = rows.empty() ? std::string() : rows.front().result.profile;
  text += '\n' + gain_head();
  for (const char* baseline : {"static", "static-fair"}) {
    const Gain g = gain(rows, profile, "aware", baseline);
    if (g.pairs > 0) text += gain_row(fmt::format("aware against {}", baseline), g);
  }
  if (!rows.empty() && is_published(rows.front().result))
    text +=
        "  published, aware against static: 4.6 velocity, 3.5 shorter, 3 less energy, 11 latency (median)\n";
  return text + '\n' + zone_table(flights, zone_borders_m);
}

std::string kernel_table(const std::vector<SweepRow>& rows) {
  constexpr const char* kRow = "{:<12} {:<24} {:<12} {:>7} {:>8} {:>12} {:>11} {:>15}\n";
  std::string text = fmt::format(fmt::runtime(kRow), "profile", "map + planner", "design", "reached",
                                 "collided", "mean m/s", "time s", "median latency");
  std::string gains = gain_head();
  const std::vector<std::string> kernels = names_of(rows, kernels_of);
  for (const std::string& profile : names_of(rows, profile_of)) {
    const auto select = [&](const std::string& kernel, const char* design) {
      std::vector<const SweepRow*> mine;
      for (const SweepRow& row : rows) {
        const MissionResult& r = row.result;
        if (r.profile == profile && r.design == design && kernels_of(r) == kernel) mine.push_back(&row);
      }
      return mine;
    };
    for (const std::string& kernel : kernels) {
      for (const char* design : {"static-fair", "aware"}) {
        const std::vector<const SweepRow*> mine = select(kernel, design);
        if (mine.empty()) continue;
        const auto count = [&mine](bool (*is)(const MissionResult&)) {
          return std::count_if(mine.begin(), mine.end(),
                               [is](const SweepRow* row) { return is(row->result); });
        };
        text += fmt::format(
            fmt::runtime(kRow), profile, kernel, design, fmt::format("{}/{}", count(counts), mine.size()),
            count([](const MissionResult& r) { return r.collided; }), shown(estimate(mine, velocity), 2),
            shown(estimate(mine, mission_time), 0), shown(estimate(mine, latency), 2) + " s");
      }
    }
    const auto add = [&](const std::string& what, const Gain& g) {
      if (g.pairs > 0) gains += gain_row(fmt::format("{}: {}", profile, what), g);
    };
    for (const std::string& kernel : kernels)
      add("awareness, " + kernel, gain(select(kernel, "aware"), select(kernel, "static-fair")));
    for (const std::string& kernel : kernels) {
      if (kernel == "own") continue;
      for (const char* design : {"static-fair", "aware"})
        add(fmt::format("own code, {}", design), gain(select("own", design), select(kernel, design)));
      add("both", gain(select("own", "aware"), select(kernel, "static-fair")));
    }
  }
  return text + "means over the missions that reached the goal; +-: 95 % interval over seeds\n\n" + gains;
}

}  // namespace roborun::report
