#include "platform/report/sweep_summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

namespace roborun::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Two-sided 95 % quantile of Student's t.
double student_t(std::size_t degrees) {
  constexpr std::array<double, 10> kSmall{12.706, 4.303, 3.182, 2.776, 2.571,
                                          2.447,  2.365, 2.306, 2.262, 2.228};
  if (degrees <= kSmall.size()) return kSmall[degrees - 1];
  // Cornish-Fisher expansion around the normal quantile: within 0.001 from 11 degrees on.
  const auto n = static_cast<double>(degrees);
  constexpr double z = 1.959964;
  return z + (z * z * z + z) / (4.0 * n) +
         (5.0 * std::pow(z, 5) + 16.0 * z * z * z + 3.0 * z) / (96.0 * n * n);
}

double cpu_per_decision(const MissionResult& r) {
  return r.decisions > 0 ? r.cpu_s / static_cast<double>(r.decisions) : kNaN;
}

double flight_per_metre(const MissionResult& r) { return r.flight_Jpm; }
double computing_per_metre(const MissionResult& r) { return r.computing_Jpm; }

double median(std::vector<double> values) {
  if (values.empty()) return kNaN;
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

std::string shown(double value, int digits) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, digits) : std::string("-");
}

/// Half the 95 % interval of the mean of `values`, by Student's t; NaN with fewer than two.
double half_95(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  if (values.size() < 2) return kNaN;
  double mean = 0.0;
  for (const double v : values) mean += v / n;
  double square = 0.0;
  for (const double v : values) square += (v - mean) * (v - mean);
  return student_t(values.size() - 1) * std::sqrt(square / (n - 1.0) / n);
}

/// What pairs of missions add up to.
struct Pairs {
  std::array<double, 4> mine{}, theirs{};
  std::vector<double> my_latency_s, their_latency_s;

  void add(const MissionResult& m, const MissionResult& t) {
    constexpr std::array<double (*)(const MissionResult&), 4> kValue{velocity, mission_time, energy,
                                                                     cpu_per_decision};
    for (std::size_t i = 0; i < kValue.size(); ++i) {
      mine[i] += kValue[i](m);
      theirs[i] += kValue[i](t);
    }
    my_latency_s.push_back(latency(m));
    their_latency_s.push_back(latency(t));
  }
  /// In the order of Gain.
  [[nodiscard]] std::array<double, 5> ratios() const {
    return {mine[0] / theirs[0], theirs[1] / mine[1], theirs[2] / mine[2],
            median(their_latency_s) / median(my_latency_s), theirs[3] / mine[3]};
  }
};

constexpr const char* kGainRow = "{:<46} {:>5} {:>11} {:>11} {:>11} {:>11} {:>8}\n";

}  // namespace

bool counts(const MissionResult& r) { return r.reached_goal && !r.collided; }

std::string shown(const Estimate& e, int digits) {
  return std::isfinite(e.half_95) ? fmt::format("{} +-{}", shown(e.mean, digits), shown(e.half_95, digits))
                                  : shown(e.mean, digits);
}

std::string gain_head() {
  return fmt::format(fmt::runtime(kGainRow), "times as good, where both reached the goal", "pairs",
                     "velocity", "shorter", "less energy", "latency", "less CPU");
}

std::string gain_row(const std::string& what, const Gain& g) {
  return fmt::format(fmt::runtime(kGainRow), what, g.pairs, shown(g.velocity, 2), shown(g.mission_time, 2),
                     shown(g.energy, 2), shown(g.latency, 1),
                     shown(100.0 * (1.0 - 1.0 / g.cpu_s_per_decision.mean), 0) + " %");
}

Estimate estimate(const std::vector<double>& of_seeds) {
  Estimate e;
  for (const double v : of_seeds)
    e.mean = (std::isfinite(e.mean) ? e.mean : 0.0) + v / static_cast<double>(of_seeds.size());
  e.half_95 = half_95(of_seeds);
  return e;
}

std::optional<Published> published(const std::string& design) {
  if (design == "static") return Published{0.4, 2093.0, 1000.0, 1.1, 1.1, 2.0};
  if (design == "aware") return Published{2.5, 465.0, 257.0, 1.5, 1.4, 1.3};
  return std::nullopt;
}

Estimate estimate(const std::vector<const SweepRow*>& rows, double (*value)(const MissionResult&)) {
  struct Sum {
    double sum{};
    int count{};
  };
  std::map<std::uint64_t, Sum> of_seed;
  Sum all;
  for (const SweepRow* row : rows) {
    const double x = value(row->result);
    if (!counts(row->result) || !std::isfinite(x)) continue;
    Sum& s = of_seed[row->result.seed];
    s.sum += x;
    ++s.count;
    all.sum += x;
    ++all.count;
  }
  Estimate e;
  if (all.count == 0) return e;
  e.mean = all.sum / all.count;
  std::vector<double> means;
  means.reserve(of_seed.size());
  for (const auto& [seed, s] : of_seed) means.push_back(s.sum / s.count);
  e.half_95 = half_95(means);
  return e;
}

std::vector<DesignSummary> summarise(const std::vector<SweepRow>& rows) {
  std::vector<DesignSummary> summaries;
  for (const SweepRow& row : rows) {
    const bool known = std::any_of(summaries.begin(), summaries.end(), [&row](const DesignSummary& s) {
      return s.design == row.result.design && s.profile == row.result.profile;
    });
    if (known) continue;
    DesignSummary s;
    s.design = row.result.design;
    s.profile = row.result.profile;
    std::vector<const SweepRow*> mine;
    std::vector<double> latencies_s;
    for (const SweepRow& other : rows) {
      const MissionResult& r = other.result;
      if (r.design != s.design || r.profile != s.profile) continue;
      mine.push_back(&other);
      ++s.missions;
      s.reached += counts(r) ? 1 : 0;
      s.collided += r.collided ? 1 : 0;
      s.decisions += r.decisions;
      s.deadline_misses += r.deadline_misses;
      if (counts(r)) latencies_s.push_back(r.latency_s.median);
    }
    s.velocity_mps = estimate(mine, velocity);
    s.mission_time_s = estimate(mine, mission_time);
    s.energy_kJ = estimate(mine, energy);
    s.flight_Jpm = estimate(mine, flight_per_metre);
    s.computing_Jpm = estimate(mine, computing_per_metre);
    s.latency_s = estimate(mine, latency);
    s.latency_s.mean = median(latencies_s);
    s.cpu_s_per_decision = estimate(mine, cpu_per_decision);
    summaries.push_back(std::move(s));
  }
  return summaries;
}

Gain gain(const std::vector<const SweepRow*>& mine, const std::vector<const SweepRow*>& theirs) {
  std::map<std::pair<std::string, std::uint64_t>, const MissionResult*> base;
  for (const SweepRow* row : theirs) {
    if (counts(row->result)) base[{row->result.env, row->result.seed}] = &row->result;
  }
  Gain g;
  Pairs all;
  std::map<std::uint64_t, Pairs> of_seed;
  for (const SweepRow* row : mine) {
    const MissionResult& r = row->result;
    const auto found = base.find({r.env, r.seed});
    if (!counts(r) || found == base.end()) continue;
    ++g.pairs;
    all.add(r, *found->second);
    of_seed[r.seed].add(r, *found->second);
  }
  if (g.pairs == 0) return g;
  const std::array<Estimate*, 5> value{&g.velocity, &g.mission_time, &g.energy, &g.latency,
                                       &g.cpu_s_per_decision};
  for (std::size_t i = 0; i < value.size(); ++i) {
    std::vector<double> ratios;
    ratios.reserve(of_seed.size());
    for (const auto& [seed, pairs] : of_seed) ratios.push_back(pairs.ratios()[i]);
    *value[i] = {all.ratios()[i], half_95(ratios)};
  }
  return g;
}

Gain gain(const std::vector<SweepRow>& rows, const std::string& profile, const std::string& design,
          const std::string& baseline) {
  std::vector<const SweepRow*> mine;
  std::vector<const SweepRow*> theirs;
  for (const SweepRow& row : rows) {
    if (row.result.profile != profile) continue;
    if (row.result.design == design) mine.push_back(&row);
    if (row.result.design == baseline) theirs.push_back(&row);
  }
  return gain(mine, theirs);
}

std::string sweep_table(const std::vector<SweepRow>& rows) {
  const std::vector<DesignSummary> summaries = summarise(rows);
  constexpr const char* kRow =
      "{:<12} {:<8} {:>8} {:>7} {:>8} {:>13} {:>15} {:>13} {:>13} {:>9} {:>9} {:>9}\n";
  std::string text =
      fmt::format(fmt::runtime(kRow), "design", "profile", "missions", "reached", "collided", "mean m/s",
                  "time s", "kJ", "flight J/m", "comp. J/m", "latency s", "CPU s per");
  text += fmt::format(fmt::runtime(kRow), "", "", "", "", "", "", "", "", "", "", "median", "decision");
  for (const DesignSummary& s : summaries) {
    text += fmt::format(fmt::runtime(kRow), s.design, s.profile, s.missions, s.reached, s.collided,
                        shown(s.velocity_mps, 2), shown(s.mission_time_s, 0), shown(s.energy_kJ, 0),
                        shown(s.flight_Jpm, 1), shown(s.computing_Jpm.mean, 1), shown(s.latency_s.mean, 2),
                        shown(s.cpu_s_per_decision, 2));
    if (const auto p = published(s.design)) {
      text += fmt::format("{:<12} {:<8} {:>8} {:>7} {:>8} {:>13} {:>15} {:>13}\n", "  published", "", 27, "",
                          "", shown(p->velocity_mps, 1), shown(p->mission_time_s, 0), shown(p->energy_kJ, 0));
    }
  }
  text +=
      "means over the missions that reached the goal; +-: 95 % interval over seeds (none with one seed)\n";
  std::string gains;
  for (const DesignSummary& s : summaries) {
    for (const char* baseline : {"static", "static-fair"}) {
      if (s.design != "aware") continue;
      const Gain g = gain(rows, s.profile, s.design, baseline);
      if (g.pairs == 0) continue;
      gains += gain_row(fmt::format("{}, {} against {}", s.profile, s.design, baseline), g);
      if (std::string_view(baseline) == "static")
        gains += fmt::format(fmt::runtime(kGainRow), "  published", 27, "5", "4.5", "4", "11", "36 %");
    }
  }
  if (!gains.empty()) {
    text += '\n' + gain_head() + gains + '\n';
    if (std::any_of(summaries.begin(), summaries.end(),
                    [](const DesignSummary& s) { return s.profile == "paper"; }))
      text +=
          "profile paper charges what the authors' stages cost; with stages that are fast, awareness gains "
          "less: "
          "roborun sweep compare\n\n";
  }
  for (const SweepRow& row : rows) {
    const MissionResult& r = row.result;
    if (counts(r)) continue;
    text += fmt::format("not reached: environment {}, {}, {}, seed {}: {} after {:.0f} s\n", r.env, r.profile,
                        r.design, r.seed, r.reason, r.mission_time_s);
  }
  return text;
}

std::string sweep_json(const std::string& suite, const std::vector<SweepRow>& rows, bool complete) {
  Json profiles = Json::object();
  for (const DesignSummary& s : summarise(rows)) {
    Json json{{"missions", s.missions}, {"reached", s.reached}, {"collided", s.collided}};
    json["mean_velocity_mps"] = s.velocity_mps.mean;
    json["mean_mission_time_s"] = s.mission_time_s.mean;
    json["mean_energy_kJ"] = s.energy_kJ.mean;
    json["mean_flight_Jpm"] = s.flight_Jpm.mean;
    json["mean_computing_Jpm"] = s.computing_Jpm.mean;
    json["median_latency_s"] = s.latency_s.mean;
    json["cpu_s_per_decision"] = s.cpu_s_per_decision.mean;
    json["half_95"] = {{"mean_velocity_mps", s.velocity_mps.half_95},
                       {"mean_mission_time_s", s.mission_time_s.half_95},
                       {"mean_energy_kJ", s.energy_kJ.half_95},
                       {"cpu_s_per_decision", s.cpu_s_per_decision.half_95}};
    json["decisions"] = s.decisions;
    json["deadline_misses"] = s.deadline_misses;
    profiles[s.profile][s.design] = std::move(json);
  }
  Json json{{"suite", suite}, {"complete", complete}};
  json["designs"] = profiles.empty() ? Json::object() : profiles.front();
  json["profiles"] = profiles;
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace roborun::report
