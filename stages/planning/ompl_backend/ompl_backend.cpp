#include "stages/planning/ompl_backend/ompl_backend.hpp"

#include <ompl/base/PlannerTerminationCondition.h>
#include <ompl/base/SpaceInformation.h>
#include <ompl/base/objectives/PathLengthOptimizationObjective.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/geometric/PathGeometric.h>
#include <ompl/geometric/planners/informedtrees/BITstar.h>
#include <ompl/geometric/planners/rrt/InformedRRTstar.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/geometric/planners/rrt/RRTstar.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace roborun::stages {
namespace {

namespace ob = ompl::base;
namespace og = ompl::geometric;

constexpr std::uint_fast32_t kSeed = 20210;
constexpr double kExplored_m3 = 4.8 * 4.8 * 4.8;  // of each node, as in the own planner's volume monitor

Vector3 to_vector(const ob::State* state) {
  const auto* p = state->as<ob::RealVectorStateSpace::StateType>();
  return {(*p)[0], (*p)[1], (*p)[2]};
}

/// Straight motions, checked by the same function as the own planner's.
class SegmentValidator final : public ob::MotionValidator {
 public:
  SegmentValidator(ob::SpaceInformation* info, const MapView& view, double radius_m, std::uint64_t& lookups)
      : ob::MotionValidator(info), view_(view), radius_m_(radius_m), lookups_(lookups) {}
  bool checkMotion(const ob::State* a, const ob::State* b) const override {
    return is_segment_free(view_, to_vector(a), to_vector(b), radius_m_, lookups_);
  }
  bool checkMotion(const ob::State* a, const ob::State* b,
                   std::pair<ob::State*, double>& last) const override {
    if (checkMotion(a, b)) return true;
    last.second = 0.0;
    if (last.first != nullptr) si_->copyState(last.first, a);
    return false;
  }

 private:
  const MapView& view_;
  double radius_m_;
  std::uint64_t& lookups_;
};

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
  [[nodiscard]] ob::PlannerPtr make(const ob::SpaceInformationPtr& info) const {
    if (name_ == "RRTstar") return std::make_shared<og::RRTstar>(info);
    if (name_ == "InformedRRTstar") return std::make_shared<og::InformedRRTstar>(info);
    if (name_ == "RRTConnect") return std::make_shared<og::RRTConnect>(info);
    return std::make_shared<og::BITstar>(info);
  }

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
    if (!view.is_free(Aabb::around(request.start_W, request.radius_m), work.units))
      return Status::kStartBlocked;
    const bool goal_bad = !request.bounds_W.contains(request.goal_W) ||
                          view.at(request.goal_W, work.units) == CellState::kOccupied;

    const auto space = std::make_shared<ob::RealVectorStateSpace>(3);
    ob::RealVectorBounds bounds(3);
    for (unsigned i = 0; i < 3; ++i) {
      bounds.setLow(i, low[i]);
      bounds.setHigh(i, high[i]);
    }
    space->setBounds(bounds);
    const auto info = std::make_shared<ob::SpaceInformation>(space);
    info->setStateValidityChecker([&](const ob::State* s) {
      return view.is_free(Aabb::around(to_vector(s), request.radius_m), work.units);
    });
    info->setMotionValidator(
        std::make_shared<SegmentValidator>(info.get(), view, request.radius_m, work.units));
    info->setup();

    const auto problem = std::make_shared<ob::ProblemDefinition>(info);
    ob::ScopedState<ob::RealVectorStateSpace> start(space);
    ob::ScopedState<ob::RealVectorStateSpace> goal(space);
    // Outside the box or unknown, the goal is moved onto its border: the nearest approximation of it is what
    // is asked for.
    const Vector3 target_W = request.goal_W.cwiseMax(low).cwiseMin(high);
    for (unsigned i = 0; i < 3; ++i) {
      start[i] = request.start_W[i];
      goal[i] = target_W[i];
    }
    problem->setStartAndGoalStates(start, goal, view.cell_m());
    problem->setOptimizationObjective(std::make_shared<ob::PathLengthOptimizationObjective>(info));
    const ob::PlannerPtr planner = make(info);
    planner->setProblemDefinition(problem);
    planner->setup();

    std::uint32_t checks = 0;
    bool spent = false;
    const ob::PlannerTerminationCondition stop([&] {
      work.volume_m3 = std::min(request.volume_m3, 0.1 * kExplored_m3 * checks);
      spent = budget.spent(work);
      return spent || ++checks > config_.max_iterations ||
             (problem->hasExactSolution() && checks > config_.max_iterations / 4);
    });
    (void)planner->solve(stop);
    const ob::PathPtr solution = problem->getSolutionPath();
    if (!solution) return goal_bad ? Status::kGoalBlocked : Status::kNoPath;
    const auto& path = static_cast<const og::PathGeometric&>(*solution);
    for (std::size_t i = 0; i < path.getStateCount() && i < PlanResult::kMaxWaypoints; ++i) {
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
  try {
    if (name != "RRTstar" && name != "InformedRRTstar" && name != "RRTConnect" && name != "BITstar")
      return nullptr;
    ompl::msg::setLogLevel(ompl::msg::LOG_NONE);
    ompl::RNG::setSeed(kSeed);
    return std::make_unique<OmplPlanner>(std::string(name), config);
  } catch (...) {
    return nullptr;
  }
}

}  // namespace roborun::stages
