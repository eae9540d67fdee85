#include "stages/planning/ompl_backend/ompl_backend.hpp"

#include <ompl/base/PlannerTerminationCondition.h>
#include <ompl/geometric/PathGeometric.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "firmware_if/assert.hpp"
#include "stages/perception/swept_ball.hpp"
#include "stages/planning/ompl_backend/ompl_space.hpp"

namespace roborun::stages {
namespace {

namespace ob = ompl::base;
namespace og = ompl::geometric;

constexpr std::uint_fast32_t kSeed = 20210;
constexpr double kExplored_m3 = 4.8 * 4.8 * 4.8;  // of each node, as in the own planner's volume monitor

bool is_over(const PlanRequest& request, core::StageBudget& budget, const core::Work& work) noexcept {
  return work.volume_m3 >= request.volume_m3 || budget.spent(work);
}

class OmplPlanner final : public Planner {
 public:
  OmplPlanner(std::string name, const OmplConfig& config) : name_(std::move(name)), config_(config) {}

  [[nodiscard]] Status plan(const PlanRequest& request, const MapView& view, core::StageBudget& budget,
                            PlanResult& result) noexcept override {
    try {
      return solve(request, view, budget, result);
    } catch (...) {
      return Status::kNoPath;
    }
  }

 private:
  Status solve(const PlanRequest& request, const MapView& view, core::StageBudget& budget,
               PlanResult& result) {
    result = {};
    const Vector3 low =
        request.bounds_W.min_W.cwiseMax(request.start_W - Vector3::Constant(request.horizon_m));
    const Vector3 high =
        request.bounds_W.max_W.cwiseMin(request.start_W + Vector3::Constant(request.horizon_m));
    if (!is_finite(request.start_W) || !is_finite(request.goal_W) || !((high - low).minCoeff() > 0.0) ||
        !(request.radius_m > 0.0)) {
      return Status::kInvalidArgument;
    }
    core::Work& work = result.work;
    if (!is_ball_free(view, request.start_W, request.radius_m, work.units)) return Status::kStartBlocked;
    const bool goal_bad = !request.bounds_W.contains(request.goal_W) ||
                          view.at(request.goal_W, work.units) == CellState::kOccupied;

    const ob::SpaceInformationPtr info = make_ompl_space(view, {low, high}, request.radius_m, work.units);
    // Outside the box or unknown, the goal is moved onto its border: the nearest approximation of it is what
    // is asked for.
    const Vector3 target_W = request.goal_W.cwiseMax(low).cwiseMin(high);
    const ob::ProblemDefinitionPtr problem =
        make_ompl_problem(info, request.start_W, target_W, view.cell_m());
    const ob::PlannerPtr planner = allocate_ompl_planner(name_, info);
    planner->setProblemDefinition(problem);
    planner->setup();

    std::uint32_t checks = 0;
    bool spent = false;
    const ob::PlannerTerminationCondition stop([&] {
      work.volume_m3 = 0.1 * kExplored_m3 * checks;
      spent = is_over(request, budget, work);
      return spent || ++checks > config_.max_iterations ||
             (problem->hasExactSolution() && checks > config_.max_iterations / 4);
    });
    (void)planner->solve(stop);
    const ob::PathPtr solution = problem->getSolutionPath();
    if (!solution) return goal_bad ? Status::kGoalBlocked : Status::kNoPath;
    const auto& path = static_cast<const og::PathGeometric&>(*solution);
    for (std::size_t i = 0; i < path.getStateCount() && i < kMaxWaypoints; ++i) {
      const Vector3 p_W = to_vector(path.getState(static_cast<unsigned>(i)));
      if (!result.path_W.empty()) result.cost_m += (p_W - result.path_W.back()).norm();
      (void)result.path_W.push_back(p_W);
    }
    const Vector3 end_W = result.path_W.back();
    const double gain_m =
        kUnknownWeight * ((request.goal_W - request.start_W).norm() - (request.goal_W - end_W).norm()) -
        result.cost_m;
    if (result.path_W.size() < 2 || gain_m < view.cell_m()) {
      result.path_W.clear();
      return goal_bad ? Status::kGoalBlocked : Status::kNoPath;
    }
    result.reaches_goal = (end_W - request.goal_W).norm() <= view.cell_m();
    if (goal_bad) return Status::kGoalBlocked;
    return spent ? Status::kBudgetSpent : Status::kOk;
  }

  std::string name_;
  OmplConfig config_;
};

}  // namespace

std::unique_ptr<Planner> make_ompl_planner(std::string_view name, const OmplConfig& config) noexcept {
  ROBORUN_ASSERT(config.validate() == Status::kOk);
  try {
    const auto names = ompl_planner_names();
    if (std::find(names.begin(), names.end(), name) == names.end()) return nullptr;
    ompl::msg::setLogLevel(ompl::msg::LOG_NONE);
    ompl::RNG::setSeed(kSeed);
    return std::make_unique<OmplPlanner>(std::string(name), config);
  } catch (...) {
    return nullptr;
  }
}

}  // namespace roborun::stages
