/// Faults at random moments of flights that an autopilot flies: nobody is hit, and the vehicle ends where the rule of
/// platform/live/README.md says. The world judges; what `roborun run` would do is done by the code that does it there.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/random/counter_rng.hpp"
#include "platform/live/flight_end.hpp"
#include "tests/platform/mission/autopilot_flight.hpp"

namespace roborun::live {

using Mode = sitl::FakeAutopilot::Mode;
using mission::AutopilotFlight;
using mission::AutopilotKind;

enum class Fault : std::uint8_t {
  kRuntimeKilled,
  kLinkCut,
  kCamerasKilled,
  kAutopilotRestarts,
  kPilotHolds,
  kPilotLands
};
inline constexpr std::array<const char*, 6> kFaultNames{"runtime killed",     "link cut",    "cameras killed",
                                                        "autopilot restarts", "pilot holds", "pilot lands"};
inline constexpr std::array<const char*, 5> kModeNames{"manual", "guided", "hold", "return", "land"};

/// How one flight went on after its fault. Goes through a pipe.
struct End {
  Fault fault{};
  Mode mode{};
  bool touched{}, armed{}, on_ground{};
  double at_s{}, from_mps{}, way_m{}, nearest_m{1e9}, last_mps{}, took_s{};
  std::array<char, 24> reason{};
};

/// Null: it ends as it is written.
inline const char* wrong(const End& end, AutopilotKind kind) {
  const bool is_px4 = kind == AutopilotKind::kPx4;
  const std::string_view reason(end.reason.data());
  const bool stands = !end.on_ground && end.armed && end.last_mps < 0.5;
  const bool landed = end.on_ground && !end.armed;
  const Mode stopped = is_px4 ? Mode::kHold : Mode::kGuided;
  if (end.touched) return "COLLISION";
  switch (end.fault) {
    case Fault::kRuntimeKilled:
      return !reason.empty() ? "reason" : end.mode != stopped ? "mode" : stands ? nullptr : "does not stand";
    case Fault::kLinkCut:
      return reason != "lost" ? "reason" : end.mode != stopped ? "mode" : stands ? nullptr : "does not stand";
    case Fault::kCamerasKilled:
      // A second condition during the stop makes the failsafe land at once.
      if (reason != "holding" && reason != "landed") return "reason";
      return landed ? nullptr : "did not land";
    case Fault::kAutopilotRestarts:
      if (end.mode != (is_px4 ? Mode::kHold : Mode::kManual)) return "mode";
      return reason != "pilot" ? "reason" : stands ? nullptr : "does not stand";
    case Fault::kPilotHolds:
      return reason != "pilot"         ? "reason"
             : end.mode != Mode::kHold ? "mode"
             : stands                  ? nullptr
                                       : "does not stand";
    case Fault::kPilotLands:
      return reason != "pilot"         ? "reason"
             : end.mode != Mode::kLand ? "mode"
             : landed                  ? nullptr
                                       : "did not land";
  }
  return "fault";
}

/// The fault happens to `flight` now; then the rest of it, with the end of `roborun run`.
class FaultyRest {
 public:
  FaultyRest(const sitl::World& world, AutopilotFlight& flight, Fault fault)
      : world_(world), flight_(flight), from_W_(flight.truth().p_WB) {
    end_.fault = fault;
    end_.at_s = flight.now_s();
    end_.from_mps = flight.truth().v_WB.norm();
    begin(fault);
  }

  End fly() {
    constexpr int kWatch = 20;          // frames: 50 ms
    constexpr int kMost = 400 * 150;    // frames
    constexpr int kWatched = 400 * 20;  // after the end of the runtime
    int left = end_.fault == Fault::kRuntimeKilled ? kWatched : kMost;
    for (int k = 0; left > 0; ++k, --left) {
      flight_.step();
      judge();
      if (k % kWatch == 0 && runs_ && watch()) left = kWatched;
    }
    const sitl::VehicleState& s = flight_.truth();
    sitl::FakeAutopilot& fake = flight_.aircraft().fake();
    end_.mode = fake.mode();
    end_.armed = fake.armed();
    end_.on_ground = s.on_ground;
    end_.last_mps = s.v_WB.norm();
    std::strncpy(end_.reason.data(), over_.reason().c_str(), end_.reason.size() - 1);
    return end_;
  }

 private:
  void begin(Fault fault) {
    sitl::FakeAutopilot& fake = flight_.aircraft().fake();
    switch (fault) {
      case Fault::kRuntimeKilled:
        runs_ = false;
        return flight_.kill_runtime();
      case Fault::kLinkCut:
        return flight_.cut(true);
      case Fault::kCamerasKilled:
        return flight_.kill_cameras();
      case Fault::kAutopilotRestarts:
        return fake.reboot(flight_.now());
      case Fault::kPilotHolds:
        return fake.pilot_takes(Mode::kHold);
      case Fault::kPilotLands:
        return fake.pilot_takes(Mode::kLand);
    }
  }

  /// As LiveRun::fly(). True: the runtime has ended.
  bool watch() {
    flight_seen_.see(flight_.now());
    decisions_seen_.see();
    const FlightEnd::Order order = over_.step(flight_.now_s());
    if (order == FlightEnd::Order::kLand) flight_.system().flight_program().ask_to_land();
    if (order != FlightEnd::Order::kEnd) return false;
    end_.took_s = flight_.now_s() - end_.at_s;
    flight_.aircraft().companion().let_go();
    flight_.kill_runtime();
    runs_ = false;
    return true;
  }

  /// As the judge of `roborun plant`.
  void judge() {
    constexpr double kHardTouchdown_mps = 2.0;
    constexpr double kUneven_m = 0.3;
    const sitl::VehicleState& s = flight_.truth();
    const double radius_m = flight_.config().vehicle.radius_m;
    Vector3 body_W = s.p_WB;
    body_W.z() = std::max(body_W.z(), flight_.ground_m() + radius_m + kUneven_m);
    if (!s.on_ground) {
      const double clearance_m = world_.clearance_m(body_W, 5.0) - radius_m;
      end_.nearest_m = std::min(end_.nearest_m, clearance_m);
      end_.touched = end_.touched || clearance_m < 0.0;
    }
    end_.touched = end_.touched || (s.on_ground && sink_mps_ > kHardTouchdown_mps);
    sink_mps_ = s.on_ground ? 0.0 : -s.v_WB.z();
    end_.way_m = std::max(end_.way_m, (s.p_WB - from_W_).head<2>().norm());
  }

  const sitl::World& world_;
  AutopilotFlight& flight_;
  Vector3 from_W_;
  End end_{};
  bool runs_{true};
  double sink_mps_{0.0};
  Seen seen_;
  SeenFlight flight_seen_{flight_.system(), flight_.aircraft(), seen_};
  SeenDecisions decisions_seen_{flight_.system(), seen_};
  const std::function<bool()> never_{};
  FlightEnd over_{seen_, never_, 3600.0, true, world_.goal_W()};
};

/// The rest of the flight in a process of its own: this one flies on as if nothing had happened.
inline End rest_of(const sitl::World& world, AutopilotFlight& flight, Fault fault) {
  std::array<int, 2> pipe_fd{};
  EXPECT_EQ(pipe(pipe_fd.data()), 0);
  std::fflush(stdout);
  const pid_t child = fork();
  if (child == 0) {
    const End end = std::make_unique<FaultyRest>(world, flight, fault)->fly();
    const bool written = write(pipe_fd[1], &end, sizeof end) == static_cast<ssize_t>(sizeof end);
    _exit(written ? 0 : 1);
  }
  close(pipe_fd[1]);
  End end{};
  EXPECT_EQ(read(pipe_fd[0], &end, sizeof end), static_cast<ssize_t>(sizeof end)) << "the child died";
  close(pipe_fd[0]);
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
  return end;
}

inline void print(const End& end, AutopilotKind kind, std::uint64_t seed) {
  const char* const why = wrong(end, kind);
  std::printf(
      "%s, world %llu, %5.1f s, %.1f m/s, %-18s: %-8s %s %s, %.1f m on, then %.2f m/s, nearest %.2f m%s%s\n",
      mission::to_string(kind), static_cast<unsigned long long>(seed), end.at_s, end.from_mps,
      kFaultNames.at(static_cast<std::size_t>(end.fault)), end.reason.data(),
      kModeNames.at(static_cast<std::size_t>(end.mode)),
      end.on_ground ? (end.armed ? "down, armed" : "down") : "in the air", end.way_m, end.last_mps,
      end.nearest_m, why != nullptr ? "  WRONG: " : "", why != nullptr ? why : "");
}

/// Every fault at each of the moments in each of the worlds, which `world_of` makes of a seed.
inline void expect_as_written(const mission::MissionConfig& config,
                              const std::function<sitl::World(std::uint64_t)>& world_of,
                              const std::vector<std::uint64_t>& seeds, int moments, double last_s) {
  const AutopilotKind kind = config.autopilot->kind;
  std::array<int, kFaultNames.size()> flights{}, right{};
  std::array<double, kFaultNames.size()> longest_m{}, nearest_m{};
  nearest_m.fill(1e9);
  double fastest_mps = 0.0;
  int touched = 0;
  for (const std::uint64_t seed : seeds) {
    const sitl::World world = world_of(seed);
    core::CounterRng rng(100 + seed);
    std::vector<double> at_s;
    for (int i = 0; i < moments; ++i) at_s.push_back(rng.uniform(10.0, last_s));
    std::sort(at_s.begin(), at_s.end());
    const auto flight = std::make_unique<AutopilotFlight>(world, config);
    for (const double moment_s : at_s) {
      while (flight->now_s() < moment_s) flight->step();
      ASSERT_EQ(flight->stage(), firmware_if::AutopilotStage::kOurs);
      for (std::size_t i = 0; i < kFaultNames.size(); ++i) {
        const End end = rest_of(world, *flight, static_cast<Fault>(i));
        print(end, kind, seed);
        EXPECT_EQ(wrong(end, kind), nullptr) << kFaultNames.at(i) << ", world " << seed << ", " << moment_s;
        ++flights.at(i);
        right.at(i) += wrong(end, kind) == nullptr ? 1 : 0;
        touched += end.touched ? 1 : 0;
        fastest_mps = std::max(fastest_mps, end.from_mps);
        longest_m.at(i) = std::max(longest_m.at(i), end.way_m);
        nearest_m.at(i) = std::min(nearest_m.at(i), end.nearest_m);
      }
    }
  }
  for (std::size_t i = 0; i < kFaultNames.size(); ++i)
    std::printf("| %s | %s | %d of %d | %.1f m | %.2f m |\n", mission::to_string(kind), kFaultNames.at(i),
                right.at(i), flights.at(i), longest_m.at(i), nearest_m.at(i));
  std::printf("%s: %d collisions, fastest %.1f m/s\n", mission::to_string(kind), touched, fastest_mps);
  EXPECT_EQ(touched, 0);
  EXPECT_GT(fastest_mps, 1.0) << "there was something to stop";
}

}  // namespace roborun::live
