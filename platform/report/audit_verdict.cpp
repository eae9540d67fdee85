#include "platform/report/audit_verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "core/executive/frame_table.hpp"

namespace roborun::report {
namespace {

using Value = std::optional<double>;
constexpr double kNone = -1.0;  // no default

double number(std::uint64_t count) { return static_cast<double>(count); }

struct LaneFigure {
  const char* name;
  const char* meaning;
  /// In the order of core::kLanes: flight, decision, background, watchdog.
  std::array<double, core::kLaneCount> limit;
  Value (*value)(const AuditReport&, const AuditLane&);
};

struct RunFigure {
  const char* name;
  const char* meaning;
  double limit;
  Value (*value)(const AuditReport&);
  bool (*applies)(const AuditReport&);
};

Value overruns(const AuditReport& r, const AuditLane& lane) {
  double sum = 0.0;
  for (const AuditSlot& s : r.slots) sum += s.lane == lane.name ? number(s.overruns) : 0.0;
  return sum;
}

bool always(const AuditReport&) { return true; }
bool with_bus(const AuditReport& r) { return r.commands.has_value(); }
bool with_kill_switch(const AuditReport& r) { return r.kill_switch.has_value(); }

// clang-format off
constexpr std::array kLaneFigures{
    //          name                    meaning                                          flight decision background watchdog
    LaneFigure{"misses",               "frames that ended after their deadline",           {0, 0, kNone, 0},
               [](const AuditReport&, const AuditLane& l) -> Value { return number(l.deadline_misses); }},
    LaneFigure{"slips",                "releases that had no frame: the one before ran into them", {0, 0, kNone, 0},
               [](const AuditReport&, const AuditLane& l) -> Value { return number(l.slips); }},
    LaneFigure{"overruns",             "slots that took more than their budget",           {0, 0, kNone, 0}, overruns},
    LaneFigure{"minor_faults",         "pages that had to be mapped",                      {0, 0, kNone, 0},
               [](const AuditReport&, const AuditLane& l) -> Value { return number(l.minor_faults); }},
    LaneFigure{"major_faults",         "pages that had to be read",                        {0, 0, kNone, 0},
               [](const AuditReport&, const AuditLane& l) -> Value { return number(l.major_faults); }},
    LaneFigure{"jitter_p999_us",       "99.9 % of wake-ups come no later, us",             {200, kNone, kNone, kNone},
               [](const AuditReport&, const AuditLane& l) -> Value { return l.jitter.p999_us; }},
    LaneFigure{"jitter_max_us",        "the latest wake-up, us",                           {kNone, kNone, kNone, kNone},
               [](const AuditReport&, const AuditLane& l) -> Value { return l.jitter.count > 0 ? Value(l.jitter.max_us) : Value(); }},
    LaneFigure{"response_p999_us",     "99.9 % of frames end no later after their release, us", {kNone, kNone, kNone, kNone},
               [](const AuditReport&, const AuditLane& l) -> Value { return l.response.p999_us; }},
    LaneFigure{"response_max_us",      "the latest end of a frame after its release, us",  {kNone, kNone, kNone, kNone},
               [](const AuditReport&, const AuditLane& l) -> Value { return l.response.count > 0 ? Value(l.response.max_us) : Value(); }},
    LaneFigure{"involuntary_switches", "times that the kernel took the CPU away",          {kNone, kNone, kNone, kNone},
               [](const AuditReport&, const AuditLane& l) -> Value { return number(l.involuntary_switches); }},
    LaneFigure{"migrations",           "moves to another CPU",                             {kNone, kNone, kNone, kNone},
               [](const AuditReport&, const AuditLane& l) -> Value { return l.migrations_known ? Value(number(l.migrations)) : Value(); }},
};
constexpr std::array kRunFigures{
    RunFigure{"missing",         "things that real time needs and this run did without", 0,
              [](const AuditReport& r) -> Value { return number(r.missing.size()); }, always},
    RunFigure{"stopped",         "1: overruns of a slot, or a signal, ended the run",    0,
              [](const AuditReport& r) -> Value { return r.stopped_by.empty() && !r.interrupted ? 0.0 : 1.0; }, always},
    RunFigure{"heap_calls",      "of the lanes, after the start",                        0,
              [](const AuditReport& r) -> Value { return r.heap_sealed ? Value(number(r.heap_calls_after_start)) : Value(); }, always},
    RunFigure{"decisions_late",  "trajectories too late for their own start",            0,
              [](const AuditReport& r) -> Value { return number(r.decisions_too_late); }, always},
    RunFigure{"decision_stalls", "times that the watchdog found the decision lane hanging", 0,
              [](const AuditReport& r) -> Value { return number(r.decision_stalls); }, always},
    RunFigure{"events_lost",     "that the evidence below lacks",                        0,
              [](const AuditReport& r) -> Value { return number(r.events_lost); }, always},
    RunFigure{"commands_lost",   "motor commands that no ESC heard (with --can)",        0,
              [](const AuditReport& r) -> Value { return number(r.commands->lost); }, with_bus},
    RunFigure{"commands_late",   "motor commands older than a minor frame (with --can)", 0,
              [](const AuditReport& r) -> Value { return number(r.commands->late); }, with_bus},
    RunFigure{"kill_faults",     "samples with both contacts the same (with --kill-lines)", 0,
              [](const AuditReport& r) -> Value { return number(r.kill_switch->faults); }, with_kill_switch},
};
// clang-format on

const RunFigure* run_figure(const std::string& name) {
  for (const RunFigure& f : kRunFigures)
    if (name == f.name) return &f;
  return nullptr;
}

const LaneFigure* lane_figure(const std::string& name) {
  for (const LaneFigure& f : kLaneFigures)
    if (name == f.name) return &f;
  return nullptr;
}

std::optional<std::size_t> lane_index(const std::string& name) {
  for (std::size_t i = 0; i < core::kLaneCount; ++i)
    if (name == core::kLanes[i].name) return i;
  return std::nullopt;
}

std::vector<std::string> names_of(const std::string& name) {
  if (run_figure(name) != nullptr) return {name};
  const std::size_t dot = name.find('.');
  if (dot != std::string::npos) {
    const bool known = lane_index(name.substr(0, dot)) && lane_figure(name.substr(dot + 1)) != nullptr;
    return known ? std::vector<std::string>{name} : std::vector<std::string>{};
  }
  std::vector<std::string> names;
  if (const LaneFigure* f = lane_figure(name)) {
    for (std::size_t i = 0; i < core::kLaneCount; ++i)
      if (f->limit[i] != kNone) names.push_back(fmt::format("{}.{}", core::kLanes[i].name, name));
    // One without any default is the flight lane's, which has the least patience.
    if (names.empty()) names.push_back(fmt::format("{}.{}", core::kLanes[0].name, name));
  }
  return names;
}

std::string all_names() {
  std::string names;
  for (const RunFigure& f : kRunFigures) names += fmt::format("{}{}", names.empty() ? "" : ", ", f.name);
  for (const LaneFigure& f : kLaneFigures) names += fmt::format(", [LANE.]{}", f.name);
  return names;
}

void put(std::vector<Requirement>& all, const std::string& name, double limit) {
  for (Requirement& r : all) {
    if (r.name == name) {
      r = {name, limit, false};
      return;
    }
  }
  all.push_back({name, limit, false});
}

}  // namespace

std::vector<Requirement> requirements_of(const std::vector<std::string>& texts) {
  std::vector<Requirement> all;
  all.reserve(kRunFigures.size() + core::kLaneCount * kLaneFigures.size());
  for (const RunFigure& f : kRunFigures) all.push_back({f.name, f.limit});
  for (std::size_t i = 0; i < core::kLaneCount; ++i) {
    for (const LaneFigure& f : kLaneFigures)
      if (f.limit[i] != kNone)
        all.push_back({fmt::format("{}.{}", core::kLanes[i].name, f.name), f.limit[i]});
  }
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    const std::string name = text.substr(0, equals);
    const std::vector<std::string> names = names_of(name);
    if (names.empty())
      throw std::invalid_argument(fmt::format(
          "'{}': must be one of {}; LANE: flight, decision, background, watchdog", name, all_names()));
    char* end = nullptr;
    const char* digits = equals == std::string::npos ? "" : text.c_str() + equals + 1;
    const bool none = std::strcmp(digits, "none") == 0;
    const double limit = none ? std::numeric_limits<double>::infinity() : std::strtod(digits, &end);
    if (!none && (end == digits || *end != '\0' || !std::isfinite(limit) || limit < 0.0))
      throw std::invalid_argument(
          fmt::format("'{}': must be NAME=LIMIT with a limit of 0 or more, or none", text));
    for (const std::string& each : names) put(all, each, limit);
  }
  return all;
}

std::vector<JudgedRequirement> judge(const AuditReport& report,
                                     const std::vector<Requirement>& requirements) {
  std::vector<JudgedRequirement> judged;
  for (const Requirement& requirement : requirements) {
    JudgedRequirement j{requirement.name, requirement.limit, requirement.is_default, {}, {}};
    if (const RunFigure* f = run_figure(requirement.name)) {
      if (!f->applies(report)) continue;
      j.value = f->value(report);
      if (!j.value) j.why_unknown = "this build cannot count them";
    } else {
      const std::size_t dot = requirement.name.find('.');
      const LaneFigure* figure = lane_figure(requirement.name.substr(dot + 1));
      const auto lane = std::find_if(report.lanes.begin(), report.lanes.end(), [&](const AuditLane& l) {
        return l.name == requirement.name.substr(0, dot);
      });
      if (figure != nullptr && lane != report.lanes.end() && lane->frames > 0)
        j.value = figure->value(report, *lane);
      if (!j.value)
        j.why_unknown = lane == report.lanes.end() || lane->frames == 0 ? "the lane had no frame"
                        : j.name.find("migrations") != std::string::npos
                            ? "the kernel does not say"
                            : fmt::format("{} frames are too few for it", lane->frames);
    }
    judged.push_back(std::move(j));
  }
  return judged;
}

bool passes(const AuditReport& report) {
  return !report.requirements.empty() && std::all_of(report.requirements.begin(), report.requirements.end(),
                                                     [](const JudgedRequirement& r) { return r.pass(); });
}

std::string requirement_help() {
  std::string text = "Requirements (at most; NAME=none takes one back):\n";
  for (const RunFigure& f : kRunFigures)
    text += fmt::format("  {:<21}{:>3}  {}\n", f.name, f.limit, f.meaning);
  text +=
      "of a lane, LANE.NAME or NAME (every lane with a default; defaults of flight, decision, background, "
      "watchdog):\n";
  for (const LaneFigure& f : kLaneFigures) {
    std::string limits;
    for (const double limit : f.limit)
      limits += fmt::format("{:>5}", limit == kNone ? "-" : fmt::format("{}", limit));
    text += fmt::format("  {:<21}{}  {}\n", f.name, limits, f.meaning);
  }
  return text;
}

}  // namespace roborun::report
