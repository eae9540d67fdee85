/// What a timing audit found: its parts, its JSON, its table, its page.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/executive/lane_executive.hpp"
#include "core/executive/slot_statistics.hpp"
#include "platform/report/mission_result.hpp"
#include "platform/report/pwcet.hpp"

namespace roborun::report {

/// A percentile is given only where so many samples lie beyond it: p99 from 1,000 samples on, p99.9 from
/// 10,000, p99.99 from 100,000.
inline constexpr double kSamplesBeyond = 10.0;

/// Of a duration, microseconds.
struct TimingSummary {
  std::uint64_t count{};
  double min_us{}, median_us{}, max_us{};
  std::optional<double> p99_us, p999_us, p9999_us;  ///< Nothing where the count does not carry it.
  /// (duration, share of all that took longer), for plots.
  std::vector<std::pair<double, double>> exceedance;
  /// (at most so many whole us and more than in the row before, how many), rows with none left out. 1 us wide up
  /// to 64 us, 1/64 of the duration above.
  std::vector<std::pair<std::uint64_t, std::uint64_t>> histogram;
};
[[nodiscard]] TimingSummary summarise(const core::DurationHistogram& histogram);

/// The frame in which a slot took longest, and what went into it.
struct WorstFrame {
  core::Cause cause;
  bool known{};                  ///< Of what follows.
  std::uint64_t decision{};      ///< The newest one that had begun, counted from 1; 0: none yet.
  std::uint64_t seed{};          ///< Of the run.
  std::array<double, 3> p_WB{};  ///< Flight lane: of the simulated vehicle, m.
  double speed_mps{};            ///< Flight lane.
  std::string again;             ///< Command that flies up to that frame again, and traces it.
};

struct AuditSlot {
  std::string name, lane, policy;
  TimingSummary time;
  double budget_us{};     ///< Of the frame with the least margin.
  double margin_ratio{};  ///< Least (budget - time) / budget.
  std::uint64_t overruns{}, reactions{}, skipped{};
  WorstFrame longest;
  std::uint32_t block_frames{};  ///< Frames whose maximum is one block of the fit.
  Pwcet pwcet;
  std::optional<std::uint64_t> instructions;  ///< At its worst knobs, counted elsewhere (--instructions).
};

/// One stretch of a run; a run has kTimeColumns of them.
struct TimeColumn {
  double worst_jitter_us{}, worst_response_us{};
  std::uint64_t frames{}, misses{};
};
inline constexpr std::size_t kTimeColumns = 240;

struct AuditLane {
  std::string name;
  int cpu{}, priority{};
  std::uint64_t frames{}, slips{}, deadline_misses{};
  double period_us{};  ///< Between releases; the decision lane's frames are whole multiples.
  TimingSummary jitter, overhead, response;
  std::uint64_t minor_faults{}, major_faults{}, voluntary_switches{}, involuntary_switches{}, migrations{};
  bool migrations_known{};
  std::size_t stack_bytes{}, stack_high_water_bytes{};
  std::vector<TimeColumn> time_line;
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

/// What else the machine did during the run. Nothing: the machine does not say.
struct Interference {
  std::string name;  ///< Such as "cpu 1: stolen by the hypervisor".
  std::string unit;
  std::optional<double> total;
  std::optional<double> worst_second;  ///< Where it was read every second.
};

/// One requirement and what became of it.
struct JudgedRequirement {
  std::string name;             ///< As in --require: NAME, or LANE.NAME.
  double limit{};               ///< At most; infinity: taken back by --require NAME=none.
  bool is_default{};            ///< The limit is the one written down, nobody's own.
  std::optional<double> value;  ///< Nothing: it could not be known, and that is no pass.
  std::string why_unknown;
  [[nodiscard]] bool pass() const noexcept { return std::isinf(limit) || (value && *value <= limit); }
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
  bool interrupted{};                        ///< Somebody ended the run before its time.
  std::optional<CommandPath> commands;       ///< Nothing over the simulated bus.
  std::optional<KillSwitchLog> kill_switch;  ///< Nothing of the simulated one.
  std::vector<AuditLane> lanes;
  std::vector<AuditSlot> slots;
  std::vector<PoolUse> pools;
  std::vector<Interference> interference;
  std::vector<std::pair<std::string, std::string>> identity;
  std::vector<JudgedRequirement> requirements;  ///< By judge(): what the verdict stands on.
  std::uint64_t events_lost{};                  ///< That time line, trace and samples lack.
  std::vector<core::TraceEvent> trace;
};

/// Of the real-time lanes, not of the background.
[[nodiscard]] std::uint64_t minor_faults(const AuditReport& report);
[[nodiscard]] std::uint64_t major_faults(const AuditReport& report);
/// "-" for nothing.
[[nodiscard]] std::string or_dash(const std::optional<double>& value);
/// "PASS" or "FAIL" of each lane that has a requirement, and of the "whole run".
[[nodiscard]] std::vector<std::pair<std::string, std::string>> verdict_by_lane(const AuditReport& report);
/// True if requirements were stated and all of them are met.
[[nodiscard]] bool passes(const AuditReport& report);

/// One line. Numbers that are not finite become null.
[[nodiscard]] std::string to_json(const AuditReport& report);
/// For a person, at most 120 columns, plain ASCII; the verdict comes first.
[[nodiscard]] std::string audit_table(const AuditReport& report);
/// One HTML file that needs nothing else: the verdict, tables, and plots of how often what took how long.
[[nodiscard]] std::string audit_html(const AuditReport& report);
/// The trace-event format that Perfetto and chrome://tracing read: on each lane's track its frames, and within
/// them the pieces of its slots. Slices of one track nest and never overlap.
[[nodiscard]] std::string perfetto_trace(const AuditReport& report);
/// Every event as an array of NumPy's format 1.0 (`numpy.load`), 32 bytes each: frame, lane, slot (255: the frame
/// itself), overrun, and release, begin and end in ns since the start.
[[nodiscard]] std::string sample_file(const AuditReport& report);

}  // namespace roborun::report
