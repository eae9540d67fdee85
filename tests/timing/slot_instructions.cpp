/// Every slot of the frame table at its worst knobs (finest cells, all volume, no budget) on the way into
/// environment 27, all lanes in lockstep. Each run of a slot is a call of a function of its own, so that
/// callgrind counts each run apart. Deterministic: the same program gives the same number of instructions.
#include <array>
#include <cstdio>
#include <limits>
#include <memory>
#include <utility>

#include "core/executive/lane_meter.hpp"
#include "platform/flight/watchdog_program.hpp"
#include "platform/mission/flight_setup.hpp"
#include "platform/mission/mission_config.hpp"
#include "platform/sitl/aircraft/camera_rig.hpp"
#include "platform/sitl/world/generator.hpp"

namespace roborun {
namespace {

using core::LaneId;
using core::SlotId;

constexpr std::size_t kRuns = 400;        // of each slot that are told apart: a second of the flight lane
constexpr std::uint64_t kDecisions = 16;  // half of them in the climb
constexpr std::int64_t kMostFrames = 8000;
// A decision that took over during the hover at the top of the climb would be the last one for long.
constexpr Nanos kDeadline = 400 * core::kMinorFrame;

/// What follows the call keeps it a call, and `run` keeps the linker from folding the bodies into one.
template <SlotId slot, std::size_t run>
[[gnu::noinline]] void slot_run(core::LaneProgram& program, core::LaneExecutive& lane) {
  program.run(slot, lane);
  asm volatile("# %c0" ::"i"(run));
}

using SlotRun = void (*)(core::LaneProgram&, core::LaneExecutive&);

template <SlotId slot, std::size_t... run>
constexpr std::array<SlotRun, kRuns> runs_of(std::index_sequence<run...>) {
  return {&slot_run<slot, run>...};
}
template <std::size_t... slot>
constexpr std::array<std::array<SlotRun, kRuns>, core::kSlotCount> all_runs(std::index_sequence<slot...>) {
  return {runs_of<static_cast<SlotId>(slot)>(std::make_index_sequence<kRuns>{})...};
}
constexpr auto kSlotRuns = all_runs(std::make_index_sequence<core::kSlotCount>{});

/// The program of a lane, each run counted apart once `counts`.
class Counted final : public core::LaneProgram {
 public:
  Counted(core::LaneProgram& program, const bool& counts) : program_(program), counts_(counts) {}
  void run(SlotId slot, core::LaneExecutive& lane) noexcept override {
    const auto i = static_cast<std::size_t>(slot);
    if (!counts_ || runs_[i] == kRuns) return program_.run(slot, lane);
    kSlotRuns[i][runs_[i]++](program_, lane);
  }

 private:
  core::LaneProgram& program_;
  const bool& counts_;
  std::array<std::size_t, core::kSlotCount> runs_{};
};

/// The governor works as ever; what it decides is not obeyed.
class WorstKnobs final : public governor::DecisionPolicy {
 public:
  explicit WorstKnobs(const governor::GovernorConfig& config) noexcept : governor_(config) {}
  [[nodiscard]] governor::Decision decide(const SpaceProfile& profile,
                                          const governor::Situation& situation) noexcept override {
    governor::Decision decision = governor_.decide(profile, situation);
    OperatingPoint& point = decision.point;
    point.p0_level = point.p1_level = 0;
    point.v0_m3 = point.v1_m3 = point.v2_m3 = std::numeric_limits<double>::max();
    point.deadline = kDeadline;
    return decision;
  }
  void observe(core::StageId, double, double) noexcept override {}
  [[nodiscard]] double v_max_mps() const noexcept override { return governor_.v_max_mps(); }

 private:
  governor::Governor governor_;
};

int fly() {
  const sitl::World world = sitl::generate(sitl::environment("27").knobs, sitl::Mission::kPackageDelivery, 1);
  const mission::MissionConfig config;
  const flight::FlightConfig flight = mission::flight_config_of(world, config);
  board::OwnParts own;
  own.policy = [](const flight::FlightConfig& f) {
    return std::make_unique<WorstKnobs>(flight::governor_config(f));
  };
  sitl::CameraServer cameras(world, config.simulator, config.seed);
  sitl::SimulatedAircraft aircraft(flight.vehicle, config.simulator, mission::ground_below(world),
                                   config.seed, flight.minor_frame, cameras);
  mission::FlightSetup setup(flight, config.backends, mission::image_limits(config), own);
  core::VirtualClock clock;
  core::ClockMeter meter;  // on a clock that stands still while a slot runs: no budget is ever spent
  const auto system =
      std::make_unique<flight::FlightSystem>(flight, meter, aircraft, cameras.cameras(),
                                             setup.parts(cameras.watched()), setup.arena(), cameras.lidars());
  setup.check();
  flight::WatchdogProgram watchdog;
  core::Reactions reactions;
  bool flying = false, airborne = false;
  std::array<Counted, core::kLaneCount> program{Counted{system->flight_program(), airborne},
                                                Counted{system->decision_program(), flying},
                                                Counted{cameras, flying}, Counted{watchdog, flying}};
  std::array<core::LaneExecutive, core::kLaneCount> lane{
      core::LaneExecutive{LaneId::kFlight, clock, program[0], reactions, nullptr},
      core::LaneExecutive{LaneId::kDecision, clock, program[1], reactions, nullptr},
      core::LaneExecutive{LaneId::kBackground, clock, program[2], reactions, nullptr},
      core::LaneExecutive{LaneId::kWatchdog, clock, program[3], reactions, nullptr}};
  meter.attach(lane[1]);
  watchdog.watch(lane[0], lane[1]);
  const flight::DecisionProgram& decisions = system->decision_program();
  for (std::int64_t frame = 1; frame <= kMostFrames && decisions.decisions() < kDecisions; ++frame) {
    const MonotonicTime now{frame * flight.minor_frame};
    clock.set(now);
    for (core::LaneExecutive& l : lane) {
      if (frame == 1) l.start(now, flight.minor_frame);
      while (l.release() <= now) l.run_frame();
    }
    flying = system->control().flying();
    airborne = system->control().airborne();
  }
  const bool flew = airborne && system->control().committed_number() >= 2 && !reactions.stopping();
  std::printf("%llu decisions, trajectory %llu flown\n",
              static_cast<unsigned long long>(decisions.decisions()),
              static_cast<unsigned long long>(system->control().committed_number()));
  return flew ? 0 : 1;
}

}  // namespace
}  // namespace roborun

int main() { return roborun::fly(); }
