/// What a timing audit found: its JSON, its table, its comparison with another one.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/executive/slot_statistics.hpp"
#include "platform/report/mission_result.hpp"
#include "platform/report/pwcet.hpp"

namespace roborun::report {

/// Of a duration, microseconds. `exceedance`: (duration, share of all that took longer), for plots.
struct TimingSummary {
  std::uint64_t count{};
  double min_us{}, median_us{}, p99_us{}, p999_us{}, p9999_us{}, max_us{};
  std::vector<std::pair<double, double>> exceedance;
};
[[nodiscard]] TimingSummary summarise(const core::DurationHistogram& histogram);

struct AuditSlot {
  std::string name, lane, policy;
  TimingSummary time;
  double budget_us{};     ///< Of the frame with the least margin.
  double margin_ratio{};  ///< Least (budget - time) / budget.
  std::uint64_t overruns{}, reactions{}, skipped{};
  core::Cause longest;
  std::uint32_t block_frames{};  ///< Frames whose maximum is one block of the fit.
  Pwcet pwcet;
};

struct AuditLane {
  std::string name;
  int cpu{}, priority{};
  std::uint64_t frames{}, slips{}, deadline_misses{};
  TimingSummary jitter, overhead, response;
  std::uint64_t minor_faults{}, major_faults{}, voluntary_switches{}, involuntary_switches{}, migrations{};
  bool migrations_known{};
  std::size_t stack_bytes{}, stack_high_water_bytes{};
};

struct AuditTraceEvent {
  std::size_t slot{};  ///< Row of the frame table.
  std::uint64_t frame{};
  double begin_us{}, spent_us{};
  bool overrun{};
};

/// How throttles reached the ESCs over a real bus. The last of those sent may be neither heard nor lost.
struct CommandPath {
  std::array<std::string, 2> interfaces;  ///< The vehicle's, the ESCs'.
  std::uint64_t sent{}, refused{}, heard{}, lost{};
  std::uint64_t late{};  ///< Older than a minor frame when they came.
  TimingSummary age;     ///< From the minor frame that made them to the ESCs.
  TimingSummary gap;     ///< Between two at the ESCs.
};

/// What the contacts of a real kill switch said, sample by sample.
struct KillSwitchLog {
  std::array<std::string, 2> lines;  ///< Normally open, normally closed.
  std::uint64_t samples{}, pressed{}, faults{}, glitches{};
  bool killed{};
};

struct AuditReport {
  double seconds{};
  double rate_Hz{};    ///< Of the flight lane.
  bool best_effort{};  ///< Asked for, and needed: `missing` says why.
  std::vector<std::string> missing;
  bool load{};
  std::uint64_t heap_calls_after_start{};
  bool heap_sealed{};  ///< False in builds that cannot count.
  std::vector<std::pair<std::string, std::uint64_t>> heap_sites;
  std::uint64_t locked_bytes{};
  std::uint64_t decisions{}, decisions_too_late{}, exposures_dropped{}, offers_refused{};
  std::uint64_t decision_stalls{};  ///< Times that the watchdog found the decision lane hanging.
  std::string stalled_in;           ///< The slot of the last one.
  double flown_m{}, least_clearance_m{}, speed_mps{};  ///< The speed is that of the end.
  std::string stopped_by;                    ///< The slot whose overruns ended the run; empty if none did.
  std::optional<CommandPath> commands;       ///< Nothing over the simulated bus.
  std::optional<KillSwitchLog> kill_switch;  ///< Nothing of the simulated one.
  std::vector<AuditLane> lanes;
  std::vector<AuditSlot> slots;
  std::vector<PoolUse> pools;
  std::vector<std::pair<std::string, std::string>> identity;
  std::vector<AuditTraceEvent> trace;
};

/// Of the real-time lanes, not of the background.
[[nodiscard]] std::uint64_t minor_faults(const AuditReport& report);
[[nodiscard]] std::uint64_t major_faults(const AuditReport& report);

/// One line. Numbers that are not finite become null.
[[nodiscard]] std::string to_json(const AuditReport& report);
/// For a person, at most 110 columns, plain ASCII.
[[nodiscard]] std::string audit_table(const AuditReport& report);
/// One HTML file that needs nothing else: tables, and for each lane and slot the share of frames that took
/// longer.
[[nodiscard]] std::string audit_html(const AuditReport& report);
/// The trace-event format that Perfetto and chrome://tracing read.
[[nodiscard]] std::string perfetto_trace(const AuditReport& report);

/// The regression gate between two audits' JSON: heap calls, faults, deadline misses, and for each slot and
/// lane median, p99 and maximum. `worse` is empty if `after` is no worse than `before` times
/// `tolerance_ratio` (and 10 us). Throws std::invalid_argument with one line for text that is no audit.
struct Comparison {
  std::string table;
  std::vector<std::string> worse;
  std::vector<std::string> notes;  ///< Why the two should not be compared: another machine, other flags.
};
[[nodiscard]] Comparison compare_audits(const std::string& before_json, const std::string& after_json,
                                        double tolerance_ratio);

}  // namespace roborun::report
