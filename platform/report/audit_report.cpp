#include "platform/report/audit_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "platform/input/json_reader.hpp"

namespace roborun::report {
namespace {

using Json = nlohmann::ordered_json;

double us(Nanos duration) { return 1e-3 * static_cast<double>(duration.count()); }

Json or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

Json timing(const TimingSummary& t) {
  return {{"count", t.count},
          {"min", t.min_us},
          {"median", t.median_us},
          {"p99", or_null(t.p99_us)},
          {"p999", or_null(t.p999_us)},
          {"p9999", or_null(t.p9999_us)},
          {"max", t.max_us},
          {"histogram", t.histogram}};
}

Json lane_json(const AuditLane& l) {
  Json j;
  j["name"] = l.name;
  j["cpu"] = l.cpu;
  j["priority"] = l.priority;
  j["frames"] = l.frames;
  j["slips"] = l.slips;
  j["deadline_misses"] = l.deadline_misses;
  j["period_us"] = l.period_us;
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
  j["p99_us"] = or_null(s.time.p99_us);
  j["p999_us"] = or_null(s.time.p999_us);
  j["p9999_us"] = or_null(s.time.p9999_us);
  j["max_us"] = s.time.max_us;
  j["histogram"] = s.time.histogram;
  j["budget_us"] = s.budget_us;
  j["margin_ratio"] = s.margin_ratio;
  j["on_overrun"] = s.policy;
  j["overruns"] = s.overruns;
  j["reactions"] = s.reactions;
  j["skipped"] = s.skipped;
  const WorstFrame& worst = s.longest;
  j["longest"] = {{"frame", worst.cause.frame},
                  {"time_s", seconds(worst.cause.at.time_since_epoch())},
                  {"work_units", worst.cause.work.units},
                  {"volume_m3", worst.cause.work.volume_m3},
                  {"level", worst.cause.work.level}};
  if (worst.known) {
    j["longest"]["decision"] = worst.decision;
    j["longest"]["seed"] = worst.seed;
    if (s.lane == "flight") {
      j["longest"]["position_m"] = worst.p_WB;
      j["longest"]["speed_mps"] = worst.speed_mps;
    }
  }
  j["longest"]["again"] = worst.again;
  Json p = {{"fitted", s.pwcet.fitted}, {"verdict", s.pwcet.verdict}, {"block_frames", s.block_frames}};
  if (s.pwcet.fitted) {
    p["exceeded_by_one_block_in_1e9_us"] = s.pwcet.exceeded_1e9_us;
    p["band_us"] = {s.pwcet.exceeded_1e9_low_us, s.pwcet.exceeded_1e9_high_us};
  }
  j["pwcet"] = p;
  if (s.instructions) j["instructions"] = *s.instructions;
  return j;
}

}  // namespace

TimingSummary summarise(const core::DurationHistogram& h) {
  TimingSummary t;
  t.count = h.count();
  t.min_us = us(h.min());
  t.median_us = us(h.quantile(0.5));
  t.max_us = us(h.max());
  const auto carried = [&h](double share) -> std::optional<double> {
    // The slack is that of 1 - 0.999.
    if (static_cast<double>(h.count()) * (1.0 - share) < kSamplesBeyond - 1e-6) return std::nullopt;
    return us(h.quantile(share));
  };
  t.p99_us = carried(0.99);
  t.p999_us = carried(0.999);
  t.p9999_us = carried(0.9999);
  for (std::size_t i = 0; i < core::DurationHistogram::kBuckets; ++i) {
    if (h.in_bucket(i) == 0) continue;
    const std::uint64_t longest_ns =
        std::min(core::DurationHistogram::upper_end_ns(i), static_cast<std::uint64_t>(h.max().count()));
    const std::uint64_t whole_us = (longest_ns + 999) / 1000;
    if (t.histogram.empty() || t.histogram.back().first != whole_us) t.histogram.emplace_back(whole_us, 0);
    t.histogram.back().second += h.in_bucket(i);
  }
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
  j["verdict"] = passes(r) ? "pass" : "fail";
  j["requirements"] = Json::array();
  for (const JudgedRequirement& q : r.requirements) {
    Json row = {{"name", q.name},
                {"limit", q.limit},
                {"value", or_null(q.value)},
                {"pass", q.pass()},
                {"is_default", q.is_default}};
    if (!q.value) row["not_shown"] = q.why_unknown;
    j["requirements"].push_back(std::move(row));
  }
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
  j["interrupted"] = r.interrupted;
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
  j["interference"] = Json::array();
  for (const Interference& i : r.interference)
    j["interference"].push_back({{"name", i.name},
                                 {"unit", i.unit},
                                 {"total", or_null(i.total)},
                                 {"worst_second", or_null(i.worst_second)}});
  j["events_lost"] = r.events_lost;
  j["time_line"] = Json::array();
  for (const AuditLane& l : r.lanes) {
    Json columns = Json::array();
    for (const TimeColumn& c : l.time_line)
      columns.push_back({c.frames, c.misses, c.worst_jitter_us, c.worst_response_us});
    j["time_line"].push_back({{"lane", l.name},
                              {"columns", {"frames", "misses", "worst_jitter_us", "worst_response_us"}},
                              {"rows", std::move(columns)}});
  }
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

std::string or_dash(const std::optional<double>& value) {
  return value ? fmt::format("{:.1f}", *value) : "-";
}

namespace {

std::string limit_text(double limit) {
  return std::isinf(limit) ? "is not required" : fmt::format("at most {:g}", limit);
}

std::string verdict_of(const AuditReport& r) {
  std::string text = passes(r) ? "PASS" : "FAIL";
  std::size_t met = 0;
  for (const JudgedRequirement& q : r.requirements) met += q.pass() ? 1U : 0U;
  text += fmt::format(": {} of {} requirements are met\n", met, r.requirements.size());
  for (const JudgedRequirement& q : r.requirements)
    if (!q.is_default) text += fmt::format("  by --require: {} {}\n", q.name, limit_text(q.limit));
  for (const auto& [where, verdict] : verdict_by_lane(r))
    text += fmt::format("  {:<11} {}\n", where, verdict);
  for (const JudgedRequirement& q : r.requirements) {
    if (q.pass()) continue;
    text += q.value
                ? fmt::format("  FAIL {}: {:g}, at most {:g}\n", q.name, *q.value, q.limit)
                : fmt::format("  FAIL {}: not shown ({}), at most {:g}\n", q.name, q.why_unknown, q.limit);
  }
  return text + "\n";
}

}  // namespace

std::vector<std::pair<std::string, std::string>> verdict_by_lane(const AuditReport& r) {
  std::vector<std::pair<std::string, std::string>> rows;
  for (const JudgedRequirement& q : r.requirements) {
    const std::size_t dot = q.name.find('.');
    const std::string where = dot == std::string::npos ? "whole run" : q.name.substr(0, dot);
    auto row = std::find_if(rows.begin(), rows.end(), [&](const auto& each) { return each.first == where; });
    if (row == rows.end()) row = rows.insert(rows.end(), {where, "PASS"});
    if (!q.pass()) row->second = "FAIL";
  }
  return rows;
}

std::string audit_table(const AuditReport& r) {
  std::string text = verdict_of(r);
  if (!r.missing.empty()) {
    text += "NOT REAL TIME (best effort):\n";
    for (const std::string& why : r.missing) text += "  " + why + "\n";
  }
  text += fmt::format("{:<11} {:>3} {:>4} {:>7} {:>5} {:>6}  {:>24}  {:>24}  {:>7}  {:>9}\n", "lane (us)",
                      "cpu", "prio", "frames", "slips", "missed", "wake-up p50/p99.9/max",
                      "response p50/p99.9/max", "faults", "stack");
  const auto three = [](const TimingSummary& t) {
    return fmt::format("{:.1f}/{}/{:.1f}", t.median_us, or_dash(t.p999_us), t.max_us);
  };
  for (const AuditLane& l : r.lanes) {
    text += fmt::format("{:<11} {:>3} {:>4} {:>7} {:>5} {:>6}  {:>24}  {:>24}  {:>7}  {:>9}\n", l.name, l.cpu,
                        l.priority, l.frames, l.slips, l.deadline_misses, three(l.jitter), three(l.response),
                        fmt::format("{} + {}", l.minor_faults, l.major_faults),
                        fmt::format("{}k/{}k", l.stack_high_water_bytes / 1024, l.stack_bytes / 1024));
  }
  text += fmt::format("\n{:<12} {:>8} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>10} {:>7} {:>5}\n", "slot (us)",
                      "count", "min", "median", "p99", "p99.9", "p99.99", "max", "budget", "margin", "over");
  for (const AuditSlot& s : r.slots) {
    text += fmt::format(
        "{:<12} {:>8} {:>9.1f} {:>9.1f} {:>9} {:>9} {:>9} {:>9.1f} {:>10.0f} {:>6.0f}% {:>5}\n", s.name,
        s.time.count, s.time.min_us, s.time.median_us, or_dash(s.time.p99_us), or_dash(s.time.p999_us),
        or_dash(s.time.p9999_us), s.time.max_us, s.budget_us, 100.0 * s.margin_ratio, s.overruns);
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
        "{} / {:.0f} us; "
        "longest gap {:.0f} us\n",
        c.interfaces[0], c.interfaces[1], c.sent, c.refused, c.lost, c.late, c.age.median_us,
        or_dash(c.age.p999_us), c.age.max_us, c.gap.max_us);
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
  if (r.interrupted) text += "interrupted: all figures are of the time until then\n";
  return text;
}

}  // namespace roborun::report
