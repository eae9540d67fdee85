#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "platform/report/audit_report.hpp"
#include "platform/report/svg.hpp"

namespace roborun::report {
namespace {

/// Share of frames that took longer, over duration, both logarithmic.
std::string plot(const std::string& title, const TimingSummary& t, double budget_us) {
  constexpr double kWidth = 420, kHeight = 220, kLeft = 48, kBottom = 30, kTop = 22;
  if (t.count == 0) return {};
  const double low = std::floor(std::log10(std::max(t.min_us, 0.1)));
  const double high = std::ceil(std::log10(std::max({t.max_us, budget_us, 1.0})) + 1e-9);
  const double decades = std::max(1.0, std::ceil(std::log10(static_cast<double>(t.count))));
  const auto x = [&](double us) {
    return kLeft + (kWidth - kLeft - 10) * (std::log10(std::max(us, 0.1)) - low) / std::max(high - low, 1.0);
  };
  const auto y = [&](double share) {
    return kTop + (kHeight - kTop - kBottom) * (-std::log10(share) / decades);
  };
  std::string svg = fmt::format(
      "<svg viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\"><text x=\"{2}\" y=\"14\" "
      "class=\"t\">{3}</text>",
      kWidth, kHeight, kLeft, xml_escape(title));
  for (double d = low; d <= high; ++d)
    svg += fmt::format(
        "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\" class=\"g\"/><text x=\"{0:.1f}\" "
        "y=\"{3}\" "
        "text-anchor=\"middle\">{4:g} us</text>",
        x(std::pow(10.0, d)), kTop, kHeight - kBottom, kHeight - kBottom + 14, std::pow(10.0, d));
  for (double d = 0; d <= decades; ++d)
    svg += fmt::format(
        "<line x1=\"{0}\" x2=\"{1}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\" class=\"g\"/><text x=\"{3}\" "
        "y=\"{4:.1f}\" "
        "text-anchor=\"end\">1e-{5:.0f}</text>",
        kLeft, kWidth - 10, y(std::pow(10.0, -d)), kLeft - 4, y(std::pow(10.0, -d)) + 4, d);
  if (budget_us > 0)
    svg += fmt::format("<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\" class=\"b\"/>",
                       x(budget_us), kTop, kHeight - kBottom);
  svg += "<polyline class=\"p\" points=\"";
  for (const auto& [us, share] : t.exceedance) svg += fmt::format("{:.1f},{:.1f} ", x(us), y(share));
  svg += fmt::format("{:.1f},{:.1f}\"/>", x(t.max_us), y(std::pow(10.0, -decades)));
  return svg + "</svg>\n";
}

std::string row(const std::vector<std::string>& cells, const char* tag = "td") {
  std::string out = "<tr>";
  for (const std::string& cell : cells) out += fmt::format("<{0}>{1}</{0}>", tag, xml_escape(cell));
  return out + "</tr>\n";
}

std::string one(double value) { return fmt::format("{:.1f}", value); }

}  // namespace

std::string audit_html(const AuditReport& r) {
  std::string h =
      "<!DOCTYPE html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>roborun timing "
      "audit</title><style>"
      "body{font:14px "
      "sans-serif;margin:24px;max-width:1300px;color:#222}table{border-collapse:collapse;margin:8px 0 "
      "24px}th,td{border:1px solid #ccc;padding:3px "
      "8px;text-align:right}th:first-child,td:first-child{text-align:left}"
      "th{background:#f2f2f2}svg{margin:4px;border:1px solid #eee;font:10px "
      "sans-serif}.t{font-weight:bold;font-size:"
      "12px}.g{stroke:#ddd}.b{stroke:#c33;stroke-dasharray:4 "
      "3}.p{fill:none;stroke:#26c;stroke-width:1.5}.bad{color:"
      "#c33;font-weight:bold}</style></head><body><h1>roborun timing audit</h1>\n";
  h += fmt::format("<p>{:.0f} s at {:g} Hz{}, {} decisions ({} too late), {:.0f} m flown.</p>", r.seconds,
                   r.rate_Hz, r.load ? " under load" : "", r.decisions, r.decisions_too_late, r.flown_m);
  for (const std::string& why : r.missing)
    h += fmt::format("<p class=\"bad\">Not real time (best effort): {}</p>", xml_escape(why));
  if (r.decision_stalls > 0)
    h += fmt::format("<p class=\"bad\">The decision lane hung {} times, the last time in {}</p>",
                     r.decision_stalls, xml_escape(r.stalled_in));
  if (!r.stopped_by.empty())
    h += fmt::format("<p class=\"bad\">Stopped by the overruns of {}</p>", xml_escape(r.stopped_by));
  h += "<table>" + row({"memory", ""}, "th");
  h += row({"heap calls after start",
            r.heap_sealed ? fmt::format("{}", r.heap_calls_after_start) : "not counted"});
  h += row({"page faults, flight and decision lane",
            fmt::format("{} minor, {} major", minor_faults(r), major_faults(r))});
  h += row({"locked", fmt::format("{:.1f} MiB", static_cast<double>(r.locked_bytes) / 1048576.0)});
  for (const auto& [name, count] : r.heap_sites) h += row({"heap: " + name, fmt::format("{}", count)});
  h += "</table><table>" + row({"lane", "cpu", "priority", "frames", "slips", "missed", "jitter median us",
                                "p99", "p99.9", "p99.99", "max", "overhead median us", "voluntary switches",
                                "involuntary", "migrations", "stack"},
                               "th");
  for (const AuditLane& l : r.lanes)
    h += row({l.name, fmt::format("{}", l.cpu), fmt::format("{}", l.priority), fmt::format("{}", l.frames),
              fmt::format("{}", l.slips), fmt::format("{}", l.deadline_misses), one(l.jitter.median_us),
              one(l.jitter.p99_us), one(l.jitter.p999_us), one(l.jitter.p9999_us), one(l.jitter.max_us),
              one(l.overhead.median_us), fmt::format("{}", l.voluntary_switches),
              fmt::format("{}", l.involuntary_switches),
              l.migrations_known ? fmt::format("{}", l.migrations) : "unknown",
              fmt::format("{} of {} KiB", l.stack_high_water_bytes / 1024, l.stack_bytes / 1024)});
  h += "</table><table>" + row({"slot", "lane", "count", "min us", "median", "p99", "p99.9", "p99.99", "max",
                                "budget", "margin", "overruns", "policy", "longest: frame", "at s", "work"},
                               "th");
  for (const AuditSlot& s : r.slots)
    h += row({s.name, s.lane, fmt::format("{}", s.time.count), one(s.time.min_us), one(s.time.median_us),
              one(s.time.p99_us), one(s.time.p999_us), one(s.time.p9999_us), one(s.time.max_us),
              one(s.budget_us), fmt::format("{:.0f} %", 100.0 * s.margin_ratio),
              fmt::format("{}", s.overruns), s.policy, fmt::format("{}", s.longest.frame),
              fmt::format("{:.3f}", seconds(s.longest.at.time_since_epoch())),
              fmt::format("{} units, level {}", s.longest.work.units, s.longest.work.level)});
  h += "</table><h2>How often it took longer</h2><p>Share of frames (vertical) that took longer than a "
       "duration "
       "(horizontal). Red: the budget.</p>\n";
  for (const AuditLane& l : r.lanes) h += plot(l.name + ": wake-up jitter", l.jitter, 0.0);
  for (const AuditSlot& s : r.slots) h += plot(s.name, s.time, s.budget_us);
  h += "<h2>Probabilistic worst case</h2><p>Supporting evidence: extrapolated from what was measured, silent "
       "on paths "
       "that never ran.</p><table>";
  h += row({"slot", "verdict", "exceeded by one block in 1e9, us", "frames a block"}, "th");
  for (const AuditSlot& s : r.slots)
    h += row({s.name, s.pwcet.verdict, s.pwcet.fitted ? one(s.pwcet.exceeded_1e9_us) : "-",
              fmt::format("{}", s.block_frames)});
  h += "</table><h2>Memory plan</h2><table>" +
       row({"pool", "element bytes", "count", "bytes", "high water"}, "th");
  for (const PoolUse& p : r.pools)
    h += row({p.name, fmt::format("{}", p.element_bytes), fmt::format("{}", p.count),
              fmt::format("{}", p.element_bytes * p.count),
              p.tells_use ? fmt::format("{}", p.high_water) : "-"});
  h += "</table><h2>Identity</h2><table>";
  for (const auto& [key, value] : r.identity) h += row({key, value});
  return h + "</table></body></html>\n";
}

}  // namespace roborun::report
