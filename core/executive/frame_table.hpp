/// The frame table: every slot of every lane, in the order in which it runs. This file is the schedule.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/executive/stage_budget.hpp"
#include "firmware_if/time.hpp"

namespace roborun::core {

/// flight: fixed minor frame. decision: its frame is the granted deadline, in whole minor frames. background:
/// not real-time. watchdog: looks whether the first two still come round.
enum class LaneId : std::uint8_t { kFlight, kDecision, kBackground, kWatchdog };
inline constexpr std::size_t kLaneCount = 4;

/// What happens when a slot takes longer than its budget, `overruns_to_act` times in a row.
enum class OverrunPolicy : std::uint8_t {
  kSkip,     ///< The slot sits out its next frame: it pays its time back.
  kDegrade,  ///< The slot gets half of its budget in the next frame, and does its best with it.
  kBrake,  ///< No new trajectory is taken until the slot is in time again: the committed one ends in a stop.
  kStop,   ///< The run ends.
};

enum class SlotId : std::uint8_t {
  kWorld,
  kSense,
  kCommit,
  kTrack,
  kPublish,
  kLook,
  kGather,
  kPointCloud,
  kGovernor,
  kMap,
  kExport,
  kPlanner,
  kSmoother,
  kHandOver,
  kCameras,
  kWatch,
};
inline constexpr std::size_t kSlotCount = 16;

struct LaneSpec {
  LaneId id;
  const char* name;
  /// Between releases, which lie on a grid of this, counted from the first one; the decision lane's program
  /// makes its frames whole multiples. kMinorFrame stands for the run's own.
  Nanos period;
  int priority;           ///< SCHED_FIFO, 0: not real-time.
  std::size_t cpu_index;  ///< Among the CPUs that the process may use, counted from the last one.
  std::size_t stack_bytes;
};

struct SlotSpec {
  SlotId id;
  const char* name;
  LaneId lane;
  Nanos budget;  ///< Ceiling; the governor grants the decision lane's stages less.
  OverrunPolicy on_overrun;
  std::uint32_t overruns_to_act;
  bool is_stage;  ///< What is not a stage is the executive's own work, and is reported as its overhead.
};

/// How long after the end of its budget a slot that still runs, or a lane that has not woken up, is overdue.
inline constexpr Nanos kWatchdogPatience{100'000'000};

/// Of the flight lane, unless a run asks for another rate.
inline constexpr Nanos kMinorFrame{2'500'000};

/// The rates at which the flight lane may run: 100 to 400 Hz with a minor frame of whole microseconds, hence
/// 100, 125, 160, 200, 250, 320 and 400. No faster: the budgets below fill three quarters of 2.5 ms, ESC commands leave
/// at 400 Hz at most (firmware_if/transmit_gate.hpp), and the estimator remembers 200 samples. No slower: not
/// flown (Mission.FliesAtEveryRateOfTheFlightLane).
[[nodiscard]] constexpr bool is_flight_rate(int rate_Hz) noexcept {
  return rate_Hz >= 100 && rate_Hz <= 400 && 1'000'000 % rate_Hz == 0;
}
/// Precondition: is_flight_rate(rate_Hz).
[[nodiscard]] constexpr Nanos minor_frame_of(int rate_Hz) noexcept { return Nanos{1'000'000'000 / rate_Hz}; }

namespace frame_table_units {
constexpr Nanos us(std::int64_t n) noexcept { return Nanos{n * 1000}; }
constexpr Nanos ms(std::int64_t n) noexcept { return Nanos{n * 1'000'000}; }
constexpr std::size_t kib(std::size_t n) noexcept { return n * 1024; }
}  // namespace frame_table_units

// clang-format off
inline constexpr std::array<LaneSpec, kLaneCount> kLanes = [] {
  using namespace frame_table_units;
  return std::array<LaneSpec, kLaneCount>{{
    // lane                  name          period       priority  cpu  stack
    {LaneId::kFlight,       "flight",      kMinorFrame,       80,   0, kib(256)},
    {LaneId::kDecision,     "decision",    kMinorFrame,       60,   1, kib(512)},
    {LaneId::kBackground,   "background",  ms(5),              0,   1, kib(256)},
    {LaneId::kWatchdog,     "watchdog",    ms(20),            90,   1, kib(64)},   // above them all, beside the decision lane
  }};
}();

inline constexpr std::array<SlotSpec, kSlotCount> kFrameTable = [] {
  using namespace frame_table_units;
  using L = LaneId;
  using P = OverrunPolicy;
  return std::array<SlotSpec, kSlotCount>{{
    // slot                 name           lane             budget   policy   in a row  stage
    {SlotId::kWorld,       "world",        L::kFlight,      us(400), P::kSkip,    1000, true},   // simulator only
    {SlotId::kSense,       "sense",        L::kFlight,      us(400), P::kBrake,      3, true},   // inputs, estimator
    {SlotId::kCommit,      "commit",       L::kFlight,      us(100), P::kBrake,      3, false},  // takes trajectories
    {SlotId::kTrack,       "track",        L::kFlight,      us(200), P::kStop,     400, true},   // tracker, mixer, motors
    {SlotId::kPublish,     "publish",      L::kFlight,      us(200), P::kSkip,       1, false},  // to the other lanes
    {SlotId::kLook,        "look",         L::kFlight,      us(600), P::kSkip,       1, false},  // between two decisions, at what is near

    {SlotId::kGather,      "gather",       L::kDecision,    ms(20),  P::kDegrade,    1, false},  // newest frames and state
    {SlotId::kPointCloud,  "point_cloud",  L::kDecision,    ms(1500), P::kDegrade,   1, true},   // four times the slowest board known
    {SlotId::kGovernor,    "governor",     L::kDecision,    ms(400), P::kDegrade,    1, true},
    {SlotId::kMap,         "map",          L::kDecision,    ms(15000), P::kDegrade,  1, true},
    {SlotId::kExport,      "export",       L::kDecision,    ms(15000), P::kDegrade,  1, true},
    {SlotId::kPlanner,     "planner",      L::kDecision,    ms(15000), P::kDegrade,  1, true},
    {SlotId::kSmoother,    "smoother",     L::kDecision,    ms(600), P::kDegrade,    1, true},
    {SlotId::kHandOver,    "hand_over",    L::kDecision,    ms(5),   P::kBrake,      3, false},  // offers the result

    {SlotId::kCameras,     "cameras",      L::kBackground,  ms(400), P::kDegrade,    1, true},   // simulator, log

    {SlotId::kWatch,       "watch",         L::kWatchdog,    us(200), P::kSkip,       1, false},
  }};
}();
// clang-format on

[[nodiscard]] constexpr const LaneSpec& lane(LaneId id) noexcept {
  return kLanes[static_cast<std::size_t>(id)];
}
[[nodiscard]] constexpr const SlotSpec& slot(SlotId id) noexcept {
  return kFrameTable[static_cast<std::size_t>(id)];
}
/// The slot in which a stage of the decision lane runs.
[[nodiscard]] constexpr SlotId slot_of(StageId id) noexcept {
  return static_cast<SlotId>(static_cast<std::size_t>(SlotId::kPointCloud) + static_cast<std::size_t>(id));
}

/// Rows in the order of their ids, lanes in one piece each, positive budgets, and the flight lane's budgets
/// fit into its minor frame.
[[nodiscard]] constexpr bool is_sound() noexcept {
  Nanos flight{0};
  for (std::size_t i = 0; i < kSlotCount; ++i) {
    const SlotSpec& s = kFrameTable[i];
    if (static_cast<std::size_t>(s.id) != i || s.budget <= Nanos{0} || s.overruns_to_act == 0) return false;
    if (i > 0 && s.lane < kFrameTable[i - 1].lane) return false;
    if (s.lane == LaneId::kFlight) flight += s.budget;
  }
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    if (static_cast<std::size_t>(kLanes[i].id) != i || kLanes[i].period <= Nanos{0}) return false;
  }
  return flight <= kMinorFrame && slot_of(StageId::kSmoother) == SlotId::kSmoother;
}
static_assert(is_sound());

}  // namespace roborun::core
