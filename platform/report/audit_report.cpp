#include "platform/report/audit_report.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "platform/input/json_reader.hpp"

namespace roborun::report {
namespace {

using Json = nlohmann::ordered_json;

double us(Nanos duration) { return 1e-3 * static_cast<double>(duration.count()); }

Json timing(const TimingSummary& t) {
  return {{"count", t.count},  {"min", t.min_us},     {"median", t.median_us}, {"p99", t.p99_us},
          {"p999", t.p999_us}, {"p9999", t.p9999_us}, {"max", t.max_us}};
}

Json lane_json(const AuditLane& l) {
  Json j;
  j["name"] = l.name;
  j["cpu"] = l.cpu;
  j["priority"] = l.priority;
  j["frames"] = l.frames;
  j["slips"] = l.slips;
  j["deadline_misses"] = l.deadline_misses;
  j["wakeup_jitter_us"] = timing(l.jitter);
  j["overhead_us"] = timing(l.overhead);
  j["response_us"] = timing(l.response);
  j["page_faults"] = {{"minor", l.minor_faults}, {"major", l.major_faults}};
  j["context_switches"] = {{"voluntary", l.voluntary_switches}, {"involuntary", l.involuntary_switches}};
  j["migrations"] = l.migrations_known ? Json(l.migrations) : Json(nullptr);
  j["stack_bytes"] = l.stack_bytes;
  j["stack_high_water_bytes"] = l.stack_high_water_bytes;
  return j;
}

Json slot_json(const AuditSlot& s) {
  Json j;
  j["name"] = s.name;
  j["lane"] = s.lane;
  j["count"] = s.time.count;
  j["min_us"] = s.time.min_us;
  j["median_us"] = s.time.median_us;
  j["p99_us"] = s.time.p99_us;
  j["p999_us"] = s.time.p999_us;
  j["p9999_us"] = s.time.p9999_us;
  j["max_us"] = s.time.max_us;
  j["budget_us"] = s.budget_us;
  j["margin_ratio"] = s.margin_ratio;
  j["on_overrun"] = s.policy;
  j["overruns"] = s.overruns;
  j["reactions"] = s.reactions;
  j["skipped"] = s.skipped;
  j["longest"] = {{"frame", s.longest.frame},
                  {"time_s", seconds(s.longest.at.time_since_epoch())},
                  {"work_units", s.longest.work.units},
                  {"volume_m3", s.longest.work.volume_m3},
                  {"level", s.longest.work.level}};
  Json p = {{"fitted", s.pwcet.fitted}, {"verdict", s.pwcet.verdict}, {"block_frames", s.block_frames}};
  if (s.pwcet.fitted) p["exceeded_by_one_block_in_1e9_us"] = s.pwcet.exceeded_1e9_us;
  j["pwcet"] = p;
  return j;
}

}  // namespace

TimingSummary summarise(const core::DurationHistogram& h) {
  TimingSummary t;
  t.count = h.count();
  t.min_us = us(h.min());
  t.median_us = us(h.quantile(0.5));
  t.p99_us = us(h.quantile(0.99));
  t.p999_us = us(h.quantile(0.999));
  t.p9999_us = us(h.quantile(0.9999));
  t.max_us = us(h.max());
  // Ten points a decade of the share that took longer, down to one sample.
  for (int tenth = 0; h.count() > 0 && tenth <= 80; ++tenth) {
    const double longer = std::pow(10.0, -0.1 * tenth);
    if (longer * static_cast<double>(h.count()) < 1.0) break;
    t.exceedance.emplace_back(us(h.quantile(1.0 - longer)), longer);
  }
  return t;
}

std::uint64_t minor_faults(const AuditReport& r) {
  std::uint64_t sum = 0;
  for (const AuditLane& l : r.lanes) sum += l.name == "background" ? 0 : l.minor_faults;
  return sum;
}
std::uint64_t major_faults(const AuditReport& r) {
  std::uint64_t sum = 0;
  for (const AuditLane& l : r.lanes) sum += l.name == "background" ? 0 : l.major_faults;
  return sum;
}

std::string to_json(const AuditReport& r) {
  Json j;
  j["seconds"] = r.seconds;
  j["rate_Hz"] = r.rate_Hz;
  j["best_effort"] = r.best_effort;
  j["missing"] = r.missing;
  j["load"] = r.load;
  j["heap_calls_after_start"] = r.heap_sealed ? Json(r.heap_calls_after_start) : Json(nullptr);
  j["heap_call_sites"] = Json::array();
  for (const auto& [name, count] : r.heap_sites)
    j["heap_call_sites"].push_back({{"site", name}, {"count", count}});
  j["page_faults"] = {{"minor", minor_faults(r)}, {"major", major_faults(r)}};
  j["locked_bytes"] = r.locked_bytes;
  j["decisions"] = r.decisions;
  j["decisions_too_late"] = r.decisions_too_late;
  j["exposures_dropped"] = r.exposures_dropped;
  j["offers_refused"] = r.offers_refused;
  j["decision_stalls"] = r.decision_stalls;
  j["stalled_in"] = r.stalled_in;
  j["flown_m"] = r.flown_m;
  j["least_clearance_m"] = r.least_clearance_m;
  j["stopped_by"] = r.stopped_by;
  if (r.commands) {
    const CommandPath& c = *r.commands;
    j["commands"] = {{"interfaces", c.interfaces}, {"sent", c.sent},         {"refused", c.refused},
                     {"heard", c.heard},           {"lost", c.lost},         {"late", c.late},
                     {"age_us", timing(c.age)},    {"gap_us", timing(c.gap)}};
  }
  if (r.kill_switch) {
    const KillSwitchLog& k = *r.kill_switch;
    j["kill_switch"] = {{"lines", k.lines},   {"samples", k.samples},   {"pressed", k.pressed},
                        {"faults", k.faults}, {"glitches", k.glitches}, {"killed", k.killed}};
  }
  j["lanes"] = Json::array();
  for (const AuditLane& l : r.lanes) j["lanes"].push_back(lane_json(l));
  j["slots"] = Json::array();
  for (const AuditSlot& s : r.slots) j["slots"].push_back(slot_json(s));
  j["pools"] = Json::array();
  for (const PoolUse& p : r.pools)
    j["pools"].push_back({{"name", p.name},
                          {"element_bytes", p.element_bytes},
                          {"count", p.count},
                          {"bytes", p.element_bytes * p.count},
                          {"high_water", p.tells_use ? Json(p.high_water) : Json(nullptr)}});
  for (const auto& [key, value] : r.identity) j["identity"][key] = value;
  return j.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string audit_table(const AuditReport& r) {
  std::string text;
  if (!r.missing.empty()) {
    text += "NOT REAL TIME (best effort):\n";
    for (const std::string& why : r.missing) text += "  " + why + "\n";
  }
  text += fmt::format("{:<11} {:>3} {:>4} {:>7} {:>5} {:>6}  {:>26}  {:>8}  {:>11}  {:>8}\n", "lane", "cpu",
                      "prio", "frames", "slips", "missed", "wake-up p50 / p99.9 / max", "overhead", "faults",
                      "stack");
  for (const AuditLane& l : r.lanes) {
    text += fmt::format(
        "{:<11} {:>3} {:>4} {:>7} {:>5} {:>6}  {:>26}  {:>8.1f}  {:>11}  {:>8}\n", l.name, l.cpu, l.priority,
        l.frames, l.slips, l.deadline_misses,
        fmt::format("{:.1f} / {:.1f} / {:.1f}", l.jitter.median_us, l.jitter.p999_us, l.jitter.max_us),
        l.overhead.median_us, fmt::format("{} + {}", l.minor_faults, l.major_faults),
        fmt::format("{}k/{}k", l.stack_high_water_bytes / 1024, l.stack_bytes / 1024));
  }
  text += fmt::format("\n{:<12} {:>8} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>10} {:>7} {:>5}\n", "slot (us)",
                      "count", "min", "median", "p99", "p99.9", "p99.99", "max", "budget", "margin", "over");
  for (const AuditSlot& s : r.slots) {
    text += fmt::format(
        "{:<12} {:>8} {:>9.1f} {:>9.1f} {:>9.1f} {:>9.1f} {:>9.1f} {:>9.1f} {:>10.0f} {:>6.0f}% {:>5}\n",
        s.name, s.time.count, s.time.min_us, s.time.median_us, s.time.p99_us, s.time.p999_us, s.time.p9999_us,
        s.time.max_us, s.budget_us, 100.0 * s.margin_ratio, s.overruns);
  }
  text += fmt::format(
      "\n{:.0f} s at {:g} Hz{}, {} decisions ({} too late), {:.0f} m flown; heap calls after start: {}; page "
      "faults: {} "
      "minor, {} "
      "major; locked: {:.1f} MiB\n",
      r.seconds, r.rate_Hz, r.load ? " under load" : "", r.decisions, r.decisions_too_late, r.flown_m,
      r.heap_sealed ? fmt::format("{}", r.heap_calls_after_start) : "not counted in this build",
      minor_faults(r), major_faults(r), static_cast<double>(r.locked_bytes) / 1048576.0);
  if (r.commands) {
    const CommandPath& c = *r.commands;
    text += fmt::format(
        "commands from {} to {}: {} sent, {} refused, {} lost, {} late; age p50 / p99.9 / max {:.0f} / "
        "{:.0f} / {:.0f} us; "
        "longest gap {:.0f} us\n",
        c.interfaces[0], c.interfaces[1], c.sent, c.refused, c.lost, c.late, c.age.median_us, c.age.p999_us,
        c.age.max_us, c.gap.max_us);
  }
  if (r.kill_switch) {
    const KillSwitchLog& k = *r.kill_switch;
    text += fmt::format(
        "kill switch on {} and {}: {} samples, {} pressed, {} with both the same, {} glitches; {}\n",
        k.lines[0], k.lines[1], k.samples, k.pressed, k.faults, k.glitches,
        k.killed ? "KILLED" : "not killed");
  }
  for (const auto& [name, count] : r.heap_sites) text += fmt::format("  heap: {} x {}\n", count, name);
  if (r.decision_stalls > 0)
    text += fmt::format("the decision lane hung {} times, the last time in {}\n", r.decision_stalls,
                        r.stalled_in);
  if (!r.stopped_by.empty()) text += fmt::format("stopped by the overruns of {}\n", r.stopped_by);
  return text;
}

Comparison compare_audits(const std::string& before_json, const std::string& after_json,
                          double tolerance_ratio) {
  constexpr double kResolution_us = 10.0;
  const auto parse = [](const std::string& text) {
    Json j;
    try {
      j = input::parse_json(text);
    } catch (const InputError& error) {
      throw std::invalid_argument(fmt::format("is not the JSON of an audit: {}", error.what()));
    }
    if (!j.is_object() || !j.contains("slots") || !j.contains("lanes"))
      throw std::invalid_argument("is not the JSON of an audit");
    return j;
  };
  const Json before = parse(before_json), after = parse(after_json);
  Comparison out;
  const auto judge = [&](const std::string& what, const Json& a, const Json& b, double slack) {
    if (!a.is_number() || !b.is_number()) return;
    const double x = a.get<double>(), y = b.get<double>();
    const bool worse = y > x * tolerance_ratio + slack;
    out.table += fmt::format("{:<34} {:>12.1f} {:>12.1f} {}\n", what, x, y, worse ? "WORSE" : "");
    if (worse) out.worse.push_back(fmt::format("{}: {:.1f} was {:.1f}", what, y, x));
  };
  try {
    for (const auto& [key, value] : before.at("identity").items()) {
      const Json& other = after.at("identity").value(key, Json());
      if (value != other)
        out.notes.push_back(fmt::format("{} differs: {} and {}", key, value.dump(), other.dump()));
    }
    judge("heap calls", before.at("heap_calls_after_start"), after.at("heap_calls_after_start"), 0.0);
    for (const char* kind : {"minor", "major"})
      judge(fmt::format("{} page faults", kind), before.at("page_faults").at(kind),
            after.at("page_faults").at(kind), 0.0);
    judge("locked bytes", before.at("locked_bytes"), after.at("locked_bytes"), 0.0);
    const auto find = [](const Json& rows, const Json& name) -> const Json* {
      for (const Json& row : rows)
        if (row.at("name") == name) return &row;
      return nullptr;
    };
    for (const Json& lane : before.at("lanes")) {
      const Json* other = find(after.at("lanes"), lane.at("name"));
      if (other == nullptr) continue;
      const std::string name = lane.at("name");
      // Rates, so that runs of different length can be compared; one a thousand frames is the resolution.
      const auto rate = [](const Json& l, const char* key) {
        return Json(1000.0 * l.at(key).get<double>() / std::max(1.0, l.at("frames").get<double>()));
      };
      judge(name + " misses per 1000", rate(lane, "deadline_misses"), rate(*other, "deadline_misses"), 1.0);
      for (const char* key : {"median", "p99", "p999"})
        judge(fmt::format("{} jitter {}", name, key), lane.at("wakeup_jitter_us").at(key),
              other->at("wakeup_jitter_us").at(key), kResolution_us);
    }
    for (const Json& slot : before.at("slots")) {
      const Json* other = find(after.at("slots"), slot.at("name"));
      if (other == nullptr) continue;
      for (const char* key : {"median_us", "p99_us", "max_us"})
        judge(fmt::format("{} {}", slot.at("name").get<std::string>(), key), slot.at(key), other->at(key),
              kResolution_us);
    }
  } catch (const Json::exception& error) {
    throw std::invalid_argument(std::string("is not the JSON of an audit: ") + error.what());
  }
  return out;
}

}  // namespace roborun::report
