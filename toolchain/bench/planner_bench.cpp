// Our RRT* beside OMPL's planners: same space, same checker, same problems. The last line of output is JSON; with
// --profile N our planner alone solves N problems.
#include <fmt/format.h>
#include <ompl/base/OptimizationObjective.h>
#include <ompl/base/PlannerTerminationCondition.h>
#include <ompl/geometric/PathGeometric.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <limits>
#include <string>
#include <vector>

#include "stages/planning/ompl_backend/ompl_space.hpp"
#include "stages/planning/rrt_star.hpp"
#include "stages/planning/way_memory.hpp"
#include "tests/support/no_alloc_scope.hpp"
#include "toolchain/bench/planner_problems.hpp"

namespace {

using namespace roborun;
using namespace roborun::stages;
using bench::Problem;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRadius_m = 0.9;
constexpr double kAnytime_s = 0.05;
constexpr double kMost_s = 1.0;  // for a first solution
constexpr std::uint64_t kMaxPolls = 20'000'000;

/// Time of this thread alone: the machine may be shared.
double cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Ends by time and by count; the clock is read at every eighth poll.
class Deadline {
 public:
  explicit Deadline(double span_s) : end_s_(cpu_s() + span_s) {}
  [[nodiscard]] bool over() {
    if (++polls_ % 8 == 0) over_ = over_ || polls_ > kMaxPolls || cpu_s() > end_s_;
    return over_;
  }

 private:
  double end_s_;
  std::uint64_t polls_{0};
  bool over_{false};
};

class CpuBudget final : public core::StageBudget {
 public:
  explicit CpuBudget(double span_s) : deadline_(span_s) {}
  [[nodiscard]] bool spent(const core::Work&) noexcept override { return deadline_.over(); }

 private:
  Deadline deadline_;
};

struct Outcome {
  double first_s{kInfinity};
  double cost_m{kInfinity};
  std::uint64_t allocations{0};  ///< While it planned for 50 ms.
  std::uint64_t lookups{0};      ///< Boxes checked until the first solution.
};

class Own {
 public:
  Own() : block_(RrtStar::arena_bytes(config())), arena_(block_), planner_(config(), arena_) {}
  Outcome run(const Problem& p) {
    Outcome o;
    PlanRequest first = p.request;
    first.satisfied_m = kInfinity;
    CpuBudget most(kMost_s);
    PlanResult result;
    const double begin_s = cpu_s();
    const Status status = planner_.plan(first, p.view, most, result);
    const double end_s = cpu_s();
    check(p, result);
    if (status == Status::kOk && result.reaches_goal) o.first_s = end_s - begin_s;
    o.lookups = result.work.units;
    CpuBudget budget(kAnytime_s);
    const test::NoAllocScope scope;
    (void)planner_.plan(p.request, p.view, budget, result);
    o.allocations = scope.count();
    check(p, result);
    if (result.reaches_goal) o.cost_m = result.cost_m;
    return o;
  }

 private:
  static RrtStar::Config config() {
    RrtStar::Config c;
    c.max_nodes = 20000;
    c.max_samples = 1000000;
    c.patience = 1000000;
    return c;
  }
  static void check(const Problem& p, const PlanResult& result) {
    std::uint64_t lookups = 0;
    double length_m = 0.0;
    for (std::size_t i = 0; i + 1 < result.path_W.size(); ++i) {
      length_m += (result.path_W[i + 1] - result.path_W[i]).norm();
      if (!is_segment_free(p.view, result.path_W[i], result.path_W[i + 1], kRadius_m, lookups)) std::abort();
    }
    if (std::fabs(length_m - result.cost_m) > 1e-6) std::abort();
  }
  std::vector<std::byte> block_;
  core::Arena arena_;
  RrtStar planner_;
};

struct Hung {};

/// A planner that no longer asks its termination condition still checks motions, and is thrown out of its loop there.
class WatchedMotions final : public ompl::base::MotionValidator {
 public:
  WatchedMotions(ompl::base::SpaceInformation* info, ompl::base::MotionValidatorPtr motions, double span_s)
      : MotionValidator(info), motions_(std::move(motions)), deadline_(span_s) {}
  bool checkMotion(const ompl::base::State* a, const ompl::base::State* b) const override {
    if (deadline_.over()) throw Hung{};
    return motions_->checkMotion(a, b);
  }
  bool checkMotion(const ompl::base::State* a, const ompl::base::State* b,
                   std::pair<ompl::base::State*, double>& last) const override {
    if (deadline_.over()) throw Hung{};
    return motions_->checkMotion(a, b, last);
  }

 private:
  ompl::base::MotionValidatorPtr motions_;
  mutable Deadline deadline_;
};

/// One solve. Without `anytime`, any solution satisfies the planner: it returns with its first one.
struct Solve {
  double time_s{kInfinity};
  double cost_m{kInfinity};
  std::uint64_t lookups{0};
  std::uint64_t allocations{0};
};
Solve solve(const std::string& name, const Problem& p, bool anytime) {
  Solve s;
  const auto info = make_ompl_space(p.view, p.request.bounds_W, kRadius_m, s.lookups);
  info->setMotionValidator(
      std::make_shared<WatchedMotions>(info.get(), info->getMotionValidator(), 2.0 * kMost_s));
  const auto problem = make_ompl_problem(info, p.request.start_W, p.request.goal_W, kPublishedCell_m);
  if (!anytime) problem->getOptimizationObjective()->setCostThreshold(ompl::base::Cost(kInfinity));
  const auto planner = allocate_ompl_planner(name, info);
  planner->setProblemDefinition(problem);
  planner->setup();
  s.lookups = 0;
  Deadline deadline(anytime ? kAnytime_s : kMost_s);
  const ompl::base::PlannerTerminationCondition stop([&deadline] { return deadline.over(); });
  const test::NoAllocScope scope;
  const double begin_s = cpu_s();
  try {
    (void)planner->solve(stop);
  } catch (const Hung&) {
    fmt::print("{} hung and was stopped by the watchdog\n", name);
    return s;
  }
  const double end_s = cpu_s();
  s.allocations = scope.count();
  if (!problem->hasExactSolution()) return s;
  s.time_s = end_s - begin_s;
  s.cost_m = problem->getSolutionPath()->length();
  return s;
}

Outcome run_peer(const std::string& name, const Problem& p) {
  const Solve first = solve(name, p, false);
  const Solve anytime = solve(name, p, true);
  return {first.time_s, anytime.cost_m, anytime.allocations, first.lookups};
}

double quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(std::ceil(q * static_cast<double>(values.size() - 1)))];
}

struct Row {
  double first_median_s, first_p90_s, cost_median_m, cost_p90_m;
  int solved{};
  std::uint64_t allocations{};
};

Row summary(const std::string& name, const std::vector<Outcome>& outcomes) {
  std::vector<double> first_s, cost_m, lookups;
  std::uint64_t allocations = 0;
  int solved = 0;
  for (const Outcome& o : outcomes) {
    first_s.push_back(o.first_s);
    cost_m.push_back(o.cost_m);
    lookups.push_back(static_cast<double>(o.lookups));
    allocations += o.allocations;
    solved += o.first_s <= kMost_s ? 1 : 0;
  }
  const Row row{quantile(first_s, 0.5),
                quantile(first_s, 0.9),
                quantile(cost_m, 0.5),
                quantile(cost_m, 0.9),
                solved,
                allocations};
  fmt::print("{:<16} {:>10.3f} {:>10.3f} {:>10.0f} {:>10.2f} {:>10.2f} {:>8} {:>14.0f}\n", name,
             1e3 * row.first_median_s, 1e3 * row.first_p90_s, quantile(lookups, 0.5), row.cost_median_m,
             row.cost_p90_m, solved,
             static_cast<double>(allocations) / static_cast<double>(outcomes.size()) / kAnytime_s);
  std::fflush(stdout);
  return row;
}

/// What the memory of ways takes of a decision: a look at 24 m around the start, all of it new and then all of it known, and the search for the
/// ways to the goal through what was seen.
void print_ways(const std::vector<Problem>& set) {
  constexpr double kReach_m = 24.0;
  std::vector<double> new_s, known_s, solve_s;
  for (const Problem& p : set) {
    WayMemory::Config config;
    config.bounds_W = p.request.bounds_W;
    config.radius_m = config.body_m = kRadius_m;
    if (!WayMemory::fits(config)) continue;
    std::vector<std::byte> block(WayMemory::arena_bytes(config));
    core::Arena arena(block);
    WayMemory ways(config, arena);
    core::UnlimitedBudget unlimited;
    core::Work work;
    const auto timed = [](std::vector<double>& all_s, auto&& call) {
      const double begin_s = cpu_s();
      (void)call();
      all_s.push_back(cpu_s() - begin_s);
    };
    const Vector3& start_W = p.request.start_W;
    const auto look = [&] { return ways.look(p.view, start_W, kReach_m, unlimited, work); };
    timed(new_s, look);
    timed(known_s, look);
    timed(solve_s, [&] { return ways.solve(start_W, p.request.goal_W, unlimited, work); });
  }
  fmt::print(
      "memory of ways, ms (median, p90): look {:.2f} {:.2f}, look at what is known {:.2f} {:.2f}, search "
      "{:.2f} {:.2f}\n",
      1e3 * quantile(new_s, 0.5), 1e3 * quantile(new_s, 0.9), 1e3 * quantile(known_s, 0.5),
      1e3 * quantile(known_s, 0.9), 1e3 * quantile(solve_s, 0.5), 1e3 * quantile(solve_s, 0.9));
}

/// Our planner alone, on problems with other numbers than those that are reported: to choose by, and for a profiler.
int alone(const std::string& kind, std::uint64_t count) {
  Own own;
  std::vector<Outcome> outcomes;
  for (std::uint64_t n = 0; n < count; ++n) outcomes.push_back(own.run(bench::problem_of(kind, 1000 + n)));
  (void)summary("roborun", outcomes);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 4 && std::strcmp(argv[1], "--alone") == 0)
    return alone(argv[2], std::strtoull(argv[3], nullptr, 10));
  const bool few = argc >= 3 && std::strcmp(argv[1], "--problems") == 0;
  const std::uint64_t most = few ? std::strtoull(argv[2], nullptr, 10) : UINT64_MAX;
  ompl::msg::setLogLevel(ompl::msg::LOG_NONE);
  ompl::RNG::setSeed(20210);
  double cost_median = 0.0, cost_p90 = 0.0;
  std::uint64_t allocations = 0;
  std::string json;
  for (const bench::Kind& kind : bench::kinds()) {
    std::vector<Problem> set;
    for (std::uint64_t n = 0; n < std::min(kind.problems, most); ++n)
      set.push_back(bench::problem_of(kind.name, n));
    fmt::print("{}: {} problems\n{:<16} {:>10} {:>10} {:>10} {:>10} {:>10} {:>8} {:>14}\n", kind.name,
               set.size(), "", "first ms", "p90", "boxes", "50 ms: m", "p90", "solved", "allocations/s");
    std::vector<Outcome> outcomes;
    outcomes.reserve(set.size());
    Own own;
    for (const Problem& p : set) outcomes.push_back(own.run(p));
    const Row ours = summary("roborun", outcomes);
    allocations += ours.allocations;
    print_ways(set);
    Row best{kInfinity, kInfinity, kInfinity, kInfinity};
    for (const std::string name :
         {"RRTstar", "InformedRRTstar", "BITstar", "ABITstar", "AITstar", "RRTConnect"}) {
      outcomes.clear();
      for (const Problem& p : set) outcomes.push_back(run_peer(name, p));
      const Row row = summary(name, outcomes);
      best.solved = std::max(best.solved, row.solved);
      best.first_median_s = std::fmin(best.first_median_s, row.first_median_s);
      best.cost_median_m = std::fmin(best.cost_median_m, row.cost_median_m);
      best.cost_p90_m = std::fmin(best.cost_p90_m, row.cost_p90_m);
    }
    if (std::isfinite(best.cost_median_m))
      cost_median = std::fmax(cost_median, ours.cost_median_m / best.cost_median_m);
    if (std::isfinite(best.cost_p90_m)) cost_p90 = std::fmax(cost_p90, ours.cost_p90_m / best.cost_p90_m);
    json += fmt::format(R"("{}":{{"solved":{},"best_peer_solved":{},"first_vs_best_peer":{:.3f}}},)",
                        kind.name, ours.solved, best.solved, ours.first_median_s / best.first_median_s);
  }
  fmt::print(R"({{{}"cost_50ms_vs_best_median":{:.4f},"cost_50ms_vs_best_p90":{:.4f},"allocations":{}}})"
             "\n",
             json, cost_median, cost_p90, allocations);
  return 0;
}
