#include "stages/planning/ompl_backend/planner_for_ompl.hpp"

#include <ompl/base/OptimizationObjective.h>
#include <ompl/base/goals/GoalState.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/geometric/PathGeometric.h>
#include <ompl/util/Exception.h>

#include <limits>
#include <vector>

#include "stages/planning/ompl_backend/ompl_space.hpp"

namespace roborun::stages {
namespace {

namespace ob = ompl::base;

class ConditionBudget final : public core::StageBudget {
 public:
  explicit ConditionBudget(const ob::PlannerTerminationCondition& condition) : condition_(condition) {}
  [[nodiscard]] bool spent(const core::Work&) noexcept override { return condition_(); }

 private:
  const ob::PlannerTerminationCondition& condition_;
};

class PlannerForOmpl final : public ob::Planner {
 public:
  PlannerForOmpl(const ob::SpaceInformationPtr& info, const MapView& view, double radius_m,
                 const RrtStar::Config& config)
      : ob::Planner(info, "roborun_RRTstar"),
        view_(view),
        radius_m_(radius_m),
        block_(RrtStar::arena_bytes(config)),
        arena_(block_),
        planner_(config, arena_) {
    specs_.approximateSolutions = true;
    specs_.optimizingPaths = true;
    specs_.canReportIntermediateSolutions = false;
  }

  ob::PlannerStatus solve(const ob::PlannerTerminationCondition& condition) override {
    checkValidity();
    const auto* goal = dynamic_cast<const ob::GoalState*>(pdef_->getGoal().get());
    if (goal == nullptr) throw ompl::Exception(name_, "the goal must be a state");
    if (pdef_->getStartStateCount() == 0) return ob::PlannerStatus::INVALID_START;
    const ob::RealVectorBounds& bounds = si_->getStateSpace()->as<ob::RealVectorStateSpace>()->getBounds();
    PlanRequest request;
    request.start_W = to_vector(pdef_->getStartState(0));
    request.goal_W = to_vector(goal->getState());
    request.bounds_W.min_W = Vector3(bounds.low[0], bounds.low[1], bounds.low[2]);
    request.bounds_W.max_W = Vector3(bounds.high[0], bounds.high[1], bounds.high[2]);
    request.radius_m = radius_m_;
    request.volume_m3 = std::numeric_limits<double>::infinity();
    request.horizon_m = 2.0 * request.bounds_W.size().norm();
    if (pdef_->hasOptimizationObjective())
      request.satisfied_m = pdef_->getOptimizationObjective()->getCostThreshold().value();
    request.seed = ++seed_;
    ConditionBudget budget(condition);
    PlanResult result;
    const Status status = planner_.plan(request, view_, budget, result);
    if (status == Status::kStartBlocked) return ob::PlannerStatus::INVALID_START;
    if (status == Status::kGoalBlocked) return ob::PlannerStatus::INVALID_GOAL;
    if (result.path_W.size() < 2) return ob::PlannerStatus::TIMEOUT;
    auto path = std::make_shared<ompl::geometric::PathGeometric>(si_);
    ob::ScopedState<ob::RealVectorStateSpace> state(si_);
    for (const Vector3& p_W : result.path_W) {
      for (unsigned i = 0; i < 3; ++i) state[i] = p_W[static_cast<Eigen::Index>(i)];
      path->append(state.get());
    }
    pdef_->addSolutionPath(path, !result.reaches_goal, (result.path_W.back() - request.goal_W).norm(), name_);
    return {true, !result.reaches_goal};
  }

 private:
  const MapView& view_;
  double radius_m_;
  std::uint64_t seed_{0};
  std::vector<std::byte> block_;
  core::Arena arena_;
  RrtStar planner_;
};

}  // namespace

ob::PlannerPtr make_planner_for_ompl(const ob::SpaceInformationPtr& info, const MapView& view,
                                     double radius_m, const RrtStar::Config& config) {
  return std::make_shared<PlannerForOmpl>(info, view, radius_m, config);
}

}  // namespace roborun::stages
