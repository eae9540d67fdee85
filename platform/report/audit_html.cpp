#include <fmt/format.h>

#include <cmath>
#include <string_view>

#include "platform/report/audit_plot.hpp"
#include "platform/report/audit_report.hpp"
#include "platform/report/page_parts.hpp"
#include "platform/report/svg.hpp"

namespace roborun::report {
namespace {

std::string row(const std::vector<std::string>& cells, const char* tag = "td", std::string_view style = {}) {
  std::string out = style.empty() ? "<tr>" : fmt::format("<tr class=\"{}\">", style);
  for (const std::string& cell : cells) out += fmt::format("<{0}>{1}</{0}>", tag, xml_escape(cell));
  return out + "</tr>\n";
}

std::string one(double value) { return fmt::format("{:.1f}", value); }
std::string count(std::uint64_t value) { return fmt::format("{}", value); }

/// What this page has besides the style of all pages. Classes of one letter are those of audit_plot.
constexpr const char* kStyle =
    R"(table{display:block;max-width:100%;overflow-x:auto;margin:8px 0 24px}
td,th{border-bottom:1px solid var(--line);padding:3px 14px 3px 0;text-align:right}
th:first-child,td:first-child,.text td{text-align:left}h2{margin:28px 0 4px}
svg{margin:6px 6px 6px 0;max-width:100%;height:auto;border:1px solid var(--line);border-radius:4px;font-size:11.5px;fill:var(--ink)}
.t{font-weight:600;font-size:12.5px}.g{stroke:var(--line)}.b{stroke:var(--red);stroke-width:1.5;stroke-dasharray:6 3}
.p{fill:none;stroke:var(--blue);stroke-width:1.5}.r{fill:none;stroke:var(--ink);stroke-dasharray:2 2}
.m{stroke:var(--orange);stroke-width:3}.verdict{font-size:20px}
)";

std::string head() {
  return fmt::format(
      R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'">
<title>roborun timing audit</title>
<style>
{}{}</style></head><body>
<h1>roborun timing audit</h1>
)",
      kPageStyle, kStyle);
}

/// Rows of a name and a text.
std::string texts(const std::vector<std::pair<std::string, std::string>>& rows) {
  std::string h = "<table class=\"text\">";
  for (const auto& [name, text] : rows) h += row({name, text});
  return h + "</table>\n";
}

std::string verdict(const AuditReport& r) {
  std::string h = fmt::format("<p class=\"verdict {}\">Verdict: {}</p>\n", passes(r) ? "good" : "bad",
                              passes(r) ? "PASS" : "FAIL");
  h += texts(verdict_by_lane(r));
  if (!r.missing.empty()) {
    h += "<p class=\"bad\">Not real time (best effort). Missing:</p><ul>\n";
    for (const std::string& why : r.missing) h += fmt::format("<li>{}</li>\n", xml_escape(why));
    h += "</ul>\n";
  }
  h += "<table>" + row({"requirement", "at most", "stated by", "value", "verdict"}, "th");
  for (const JudgedRequirement& q : r.requirements)
    h += row({q.name, std::isinf(q.limit) ? "not required" : fmt::format("{:g}", q.limit),
              q.is_default ? "default" : "--require",
              q.value ? fmt::format("{:g}", *q.value) : "not shown: " + q.why_unknown,
              std::isinf(q.limit) ? "-"
              : q.pass()          ? "PASS"
                                  : "FAIL"},
             "td", std::isinf(q.limit) || q.pass() ? "" : "bad");
  return h + "</table>\n";
}

std::string lanes(const AuditReport& r) {
  std::string h =
      "<h2>Lanes</h2><table>" +
      row({"lane", "cpu", "priority", "frames", "slips", "missed", "jitter median us", "p99", "p99.9",
           "p99.99", "max", "overhead median us", "voluntary switches", "involuntary", "migrations", "stack"},
          "th");
  for (const AuditLane& l : r.lanes)
    h += row({l.name, fmt::format("{}", l.cpu), fmt::format("{}", l.priority), count(l.frames),
              count(l.slips), count(l.deadline_misses), one(l.jitter.median_us), or_dash(l.jitter.p99_us),
              or_dash(l.jitter.p999_us), or_dash(l.jitter.p9999_us), one(l.jitter.max_us),
              one(l.overhead.median_us), count(l.voluntary_switches), count(l.involuntary_switches),
              l.migrations_known ? count(l.migrations) : "unknown",
              fmt::format("{} of {} KiB", l.stack_high_water_bytes / 1024, l.stack_bytes / 1024)});
  h += "</table><p>Response: from a release to the end of its frame.</p><table>" +
       row({"lane", "period us", "response median us", "p99", "p99.9", "p99.99", "max", "max of the period"},
           "th");
  for (const AuditLane& l : r.lanes)
    h += row({l.name, one(l.period_us), one(l.response.median_us), or_dash(l.response.p99_us),
              or_dash(l.response.p999_us), or_dash(l.response.p9999_us), one(l.response.max_us),
              l.period_us > 0 ? fmt::format("{:.0f} %", 100.0 * l.response.max_us / l.period_us) : "-"});
  h += "</table>\n";
  for (const AuditLane& l : r.lanes) h += time_line_plot(l, r.seconds);
  return h;
}

std::string slots(const AuditReport& r) {
  std::string h = "<h2>Slots</h2><table>" +
                  row({"slot", "lane", "count", "min us", "median", "p99", "p99.9", "p99.99", "max", "budget",
                       "margin", "overruns", "policy", "instructions, worst knobs"},
                      "th");
  for (const AuditSlot& s : r.slots)
    h += row({s.name, s.lane, count(s.time.count), one(s.time.min_us), one(s.time.median_us),
              or_dash(s.time.p99_us), or_dash(s.time.p999_us), or_dash(s.time.p9999_us), one(s.time.max_us),
              one(s.budget_us), fmt::format("{:.0f} %", 100.0 * s.margin_ratio), count(s.overruns), s.policy,
              s.instructions ? count(*s.instructions) : "-"});
  h += "</table><p>A percentile is given where ten samples or more lie beyond it.</p>"
       "<h2>Worst frame of each slot</h2><p>The command flies the same world, noise, wind and vehicle again "
       "up to that "
       "frame, and traces it. Time is real: where the clock ends a stage, decisions may come out "
       "differently.</p>"
       "<table>" +
       row({"slot", "max us", "frame", "at s", "work", "decision", "seed", "where, how fast", "again"}, "th");
  for (const AuditSlot& s : r.slots) {
    const WorstFrame& w = s.longest;
    h += row({s.name, one(s.time.max_us), count(w.cause.frame),
              fmt::format("{:.4f}", seconds(w.cause.at.time_since_epoch())),
              fmt::format("{} units, level {}, {:.0f} m3", w.cause.work.units, w.cause.work.level,
                          w.cause.work.volume_m3),
              w.known ? count(w.decision) : "-", w.known ? count(w.seed) : "-",
              w.known && s.lane == "flight" ? fmt::format("({:.2f}, {:.2f}, {:.2f}) m, {:.1f} m/s", w.p_WB[0],
                                                          w.p_WB[1], w.p_WB[2], w.speed_mps)
                                            : "-",
              w.again});
  }
  return h + "</table>\n";
}

std::string how_often(const AuditReport& r) {
  std::string h =
      "<h2>How often it took longer</h2><p>Share of frames (vertical) that took longer than a duration "
      "(horizontal). Dashed: the budget, or the lane's period.</p>\n";
  for (const AuditLane& l : r.lanes) h += exceedance_plot(l.name + ": wake-up jitter", l.jitter, 0.0);
  for (const AuditLane& l : r.lanes) h += exceedance_plot(l.name + ": response", l.response, l.period_us);
  for (const AuditSlot& s : r.slots) h += exceedance_plot(s.name, s.time, s.budget_us);
  return h;
}

std::string worst_case(const AuditReport& r) {
  std::string h =
      "<h2>Probabilistic worst case</h2><p>Supporting evidence: extrapolated from what was measured, silent "
      "on paths "
      "that never ran.</p><table>" +
      row({"slot", "verdict", "exceeded by one block in 1e9, us", "95 % band of the fit", "frames a block"},
          "th");
  for (const AuditSlot& s : r.slots)
    h += row({s.name, s.pwcet.verdict, s.pwcet.fitted ? one(s.pwcet.exceeded_1e9_us) : "-",
              s.pwcet.fitted
                  ? fmt::format("{:.1f} to {:.1f}", s.pwcet.exceeded_1e9_low_us, s.pwcet.exceeded_1e9_high_us)
                  : "-",
              fmt::format("{}", s.block_frames)});
  h += "</table>\n";
  for (const AuditSlot& s : r.slots)
    h += return_level_plot(s.name + ": block maxima, fit and its 95 % band", s.pwcet);
  return h;
}

std::string what_else(const AuditReport& r) {
  std::string h =
      "<h2>What else the machine did</h2><table>" + row({"", "in all", "worst second", "unit"}, "th");
  for (const Interference& i : r.interference)
    h += row({i.name, i.total ? fmt::format("{:g}", *i.total) : "not readable here",
              i.worst_second ? fmt::format("{:g}", *i.worst_second) : "-", i.unit});
  return h + "</table>\n";
}

std::string memory(const AuditReport& r) {
  std::string h = "<h2>Memory</h2><table>";
  h += row({"heap calls after start", r.heap_sealed ? count(r.heap_calls_after_start) : "not counted"});
  h += row(
      {"page faults, real-time lanes", fmt::format("{} minor, {} major", minor_faults(r), major_faults(r))});
  h += row({"locked", fmt::format("{:.1f} MiB", static_cast<double>(r.locked_bytes) / 1048576.0)});
  for (const auto& [name, calls] : r.heap_sites) h += row({"heap: " + name, count(calls)});
  h += "</table><table>" + row({"pool", "element bytes", "count", "bytes", "high water"}, "th");
  for (const PoolUse& p : r.pools)
    h += row({p.name, fmt::format("{}", p.element_bytes), fmt::format("{}", p.count),
              fmt::format("{}", p.element_bytes * p.count),
              p.tells_use ? fmt::format("{}", p.high_water) : "-"});
  return h + "</table>\n";
}

}  // namespace

std::string audit_html(const AuditReport& r) {
  std::string h = head() + verdict(r);
  h += fmt::format("<p>{:.0f} s at {:g} Hz{}, {} decisions ({} too late), {:.0f} m flown.</p>", r.seconds,
                   r.rate_Hz, r.load ? " under load" : "", r.decisions, r.decisions_too_late, r.flown_m);
  if (r.decision_stalls > 0)
    h += fmt::format("<p class=\"bad\">The decision lane hung {} times, the last time in {}</p>",
                     r.decision_stalls, xml_escape(r.stalled_in));
  if (!r.stopped_by.empty())
    h += fmt::format("<p class=\"bad\">Stopped by the overruns of {}</p>", xml_escape(r.stopped_by));
  if (r.interrupted) h += "<p class=\"bad\">Interrupted: all figures are of the time until then</p>";
  h += "<h2>Identity</h2>" + texts(r.identity);
  return h + lanes(r) + slots(r) + how_often(r) + worst_case(r) + what_else(r) + memory(r) +
         "</body></html>\n";
}

}  // namespace roborun::report
