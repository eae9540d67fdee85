#include "platform/evaluation/sweep_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "platform/evaluation/suite.hpp"
#include "platform/evaluation/worker_processes.hpp"
#include "platform/input/arguments.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/stop_signal.hpp"
#include "platform/mission/flight_setup.hpp"
#include "platform/report/flight_record.hpp"
#include "platform/report/progress_line.hpp"
#include "platform/report/result_line.hpp"
#include "platform/report/suite_summary.hpp"
#include "platform/sitl/world/generator.hpp"

namespace roborun::evaluation {
namespace {

mission::MissionConfig config_of(const SweepPlan& plan, const SweepInputs& inputs,
                                 const SweepMission& mission) {
  mission::MissionConfig config =
      inputs.base.at(is_suite(plan.suite) ? vehicle_of_environment(mission.environment) : std::string{});
  const board::Profile& profile = inputs.profile.at(mission.profile);
  config.profile_name = mission.profile;
  config.flight.costs = profile.costs;
  config.flight.model = profile.model;
  config.flight.design = mission::design_of("--designs", mission.design);
  config.seed = mission.seed;
  config.backends.map = plan.map;
  config.backends.planner = plan.planner;
  return config;
}

sitl::World world_of(const SweepPlan& plan, const SweepMission& mission) {
  return sitl::generate(sitl::environment(mission.environment).knobs, sitl::mission_of(plan.mission),
                        mission.seed);
}

std::string repeat_command(const SweepPlan& plan, const SuiteProblem& problem, const SweepMission& mission) {
  std::string command = problem.make + (problem.make.empty() ? "" : " && ");
  command +=
      fmt::format("roborun fly {} --vehicle {} --seed {} --design {} --profile {}", problem.fly,
                  vehicle_of_environment(mission.environment), mission.seed, mission.design, mission.profile);
  if (plan.map != "own") command += " --map " + plan.map;
  if (plan.planner != "own") command += " --planner " + plan.planner;
  if (!plan.settings.empty()) command += " --settings FILE";
  if (!plan.aim.empty()) command += " --aim " + plan.aim;
  return command;
}

/// Where the vehicle has no room at the start or goal the flight is refused: that is its reason.
report::MissionReport fly_in_suite(const SweepPlan& plan, const SweepInputs& inputs,
                                   const SweepMission& mission) {
  const mission::MissionConfig config = config_of(plan, inputs, mission);
  const double radius_m = config.flight.vehicle.radius_m;
  const SuiteProblem problem =
      suite_problem(plan.suite, inputs.worlds, mission.environment, mission.seed, radius_m);
  report::MissionReport flown;
  const sitl::World world = problem.world();
  const double shortest_m = judged_way_m(world, radius_m);
  try {
    flown = mission::fly_mission(world, config, {});
  } catch (const InputError& error) {
    flown.result.design = mission.design;
    flown.result.profile = mission.profile;
    flown.result.seed = mission.seed;
    flown.result.reason = error.what();
  }
  flown.result.suite = {std::isfinite(shortest_m), shortest_m, repeat_command(plan, problem, mission)};
  return flown;
}

/// The line and, after a line end, the flight if it is drawn.
std::string fly_one(const SweepPlan& plan, const SweepInputs& inputs, const SweepMission& mission) {
  report::MissionReport flown =
      is_suite(plan.suite)
          ? fly_in_suite(plan, inputs, mission)
          : mission::fly_mission(world_of(plan, mission), config_of(plan, inputs, mission), {});
  flown.result.env = mission.environment;
  flown.result.mission = plan.mission;
  return report::to_line(flown.result) + '\n' +
         (is_representative(plan, mission) ? report::to_flight_record(flown) : std::string{});
}

/// Time left, from what missions of the same design took.
class Forecast {
 public:
  Forecast(const std::vector<SweepMission>& missions, int jobs) : missions_(missions), jobs_(jobs) {}
  void started(std::size_t mission, double now_s) { started_s_[mission] = now_s; }
  void ended(std::size_t mission, double now_s) {
    Spent& spent = spent_[missions_[mission].design];
    spent.s += now_s - started_s_[mission];
    ++spent.count;
    started_s_.erase(mission);
  }
  /// Of the missions `left`; negative while nothing is known.
  [[nodiscard]] double left_s(const std::vector<std::size_t>& left, double now_s) const {
    Spent all;
    for (const auto& [design, spent] : spent_) {
      all.s += spent.s;
      all.count += spent.count;
    }
    if (all.count == 0) return -1.0;
    double sum_s = 0.0;
    for (const std::size_t i : left) {
      const auto known = spent_.find(missions_[i].design);
      const Spent& like = known == spent_.end() ? all : known->second;
      const auto running = started_s_.find(i);
      const double done_s = running == started_s_.end() ? 0.0 : now_s - running->second;
      sum_s += std::max(0.0, like.s / like.count - done_s);
    }
    return sum_s / std::min(static_cast<double>(jobs_), std::max(1.0, static_cast<double>(left.size())));
  }

 private:
  struct Spent {
    double s{};
    int count{};
  };
  const std::vector<SweepMission>& missions_;
  int jobs_;
  std::map<std::string, Spent> spent_;
  std::map<std::size_t, double> started_s_;
};

std::string clock_of(double s) {
  if (s < 0.0) return "?";
  const auto whole = std::lround(s);
  return fmt::format("{}:{:02}", whole / 60, whole % 60);
}

std::string bar(std::size_t done, std::size_t all) {
  constexpr std::size_t kWidth = 24;
  const std::size_t full = done * kWidth / all;
  return std::string(full, '#') + std::string(kWidth - full, '.');
}

}  // namespace

void try_sweep(const SweepPlan& plan, const SweepInputs& inputs) {
  const std::vector<SweepMission> missions = missions_of(plan);
  if (missions.empty()) return;
  const std::array<std::size_t, 1> first{0};
  const auto build = [&](std::size_t) -> std::string {
    const SweepMission& mission = missions.front();
    const mission::MissionConfig config = config_of(plan, inputs, mission);
    // Whose vehicle, map and planner are tried, in a world that has room for all.
    const sitl::World world =
        is_suite(plan.suite) ? sitl::generate(sitl::environment("14").knobs, {}, 1) : world_of(plan, mission);
    const mission::FlightSetup setup(flight_config_of(world, config), config.backends, image_limits(config));
    return "ok";
  };
  // In a process of its own, because planners leave their seed behind.
  (void)run_in_processes(first, 1,
                         {build,
                          [](std::size_t, const std::string&) {},
                          [](std::size_t) { throw InputError("--map, --planner: not enough memory"); },
                          {}});
}

bool fly_sweep(SweepStore& store, const SweepInputs& inputs, int jobs) {
  const std::vector<SweepMission>& missions = store.missions();
  std::vector<std::size_t> left;
  for (std::size_t i = 0; i < missions.size(); ++i) {
    if (!store.has(i)) left.push_back(i);
  }
  const input::StopOnSignal stop;
  report::ProgressLine line;
  Forecast forecast(missions, jobs);
  const std::vector<std::size_t> tasks = left;
  // The workers take them in order: task k starts when a place is free.
  std::size_t started = 0;
  const auto start = [&] {
    while (started < tasks.size() && started < tasks.size() - left.size() + static_cast<std::size_t>(jobs))
      forecast.started(tasks[started++], line.elapsed_s());
  };
  int failed = 0;
  int died = 0;
  WorkerCalls calls;
  calls.work = [&](std::size_t i) { return fly_one(store.plan(), inputs, missions[i]); };
  calls.answered = [&](std::size_t i, const std::string& answer) {
    const std::size_t end = answer.find('\n');
    store.add(i, answer.substr(0, end), answer.substr(end + 1));
    forecast.ended(i, line.elapsed_s());
    std::erase(left, i);
    const auto result = report::from_line(answer.substr(0, end));
    failed += result && (result->suite ? !report::failed(*result) : report::counts(*result)) ? 0 : 1;
  };
  calls.died = [&](std::size_t i) {
    fmt::print(stderr, "roborun: {}: its process died; not recorded\n", name_of(missions[i]));
    forecast.ended(i, line.elapsed_s());
    std::erase(left, i);
    ++died;
  };
  calls.go_on = [&] {
    start();
    if (line.due()) {
      const std::size_t done = missions.size() - left.size();
      line.show(fmt::format("[{}] {} of {} missions, {} failed, {} flown, {} left",
                            bar(done, missions.size()), done, missions.size(), failed,
                            clock_of(line.elapsed_s()), clock_of(forecast.left_s(left, line.elapsed_s()))));
    }
    return !input::StopOnSignal::requested();
  };
  start();
  const bool to_the_end = run_in_processes(tasks, jobs, calls);
  store.sort();
  return to_the_end && died == 0;
}

std::vector<report::SweepRow> rows_of(const SweepStore& store) {
  std::vector<report::SweepRow> rows;
  for (report::MissionResult& result : store.results()) {
    const sitl::EnvironmentKnobs knobs = sitl::environment(result.env).knobs;
    rows.push_back({std::move(result), knobs.density_ratio, knobs.spread_m, knobs.centroid_distance_m});
  }
  return rows;
}

}  // namespace roborun::evaluation
