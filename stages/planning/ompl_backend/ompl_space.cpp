#include "stages/planning/ompl_backend/ompl_space.hpp"

#include <ompl/base/objectives/PathLengthOptimizationObjective.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/geometric/planners/est/BiEST.h>
#include <ompl/geometric/planners/est/EST.h>
#include <ompl/geometric/planners/fmt/BFMT.h>
#include <ompl/geometric/planners/fmt/FMT.h>
#include <ompl/geometric/planners/informedtrees/ABITstar.h>
#include <ompl/geometric/planners/informedtrees/AITstar.h>
#include <ompl/geometric/planners/informedtrees/BITstar.h>
#include <ompl/geometric/planners/kpiece/BKPIECE1.h>
#include <ompl/geometric/planners/kpiece/KPIECE1.h>
#include <ompl/geometric/planners/kpiece/LBKPIECE1.h>
#include <ompl/geometric/planners/pdst/PDST.h>
#include <ompl/geometric/planners/prm/LazyPRM.h>
#include <ompl/geometric/planners/prm/LazyPRMstar.h>
#include <ompl/geometric/planners/prm/PRM.h>
#include <ompl/geometric/planners/prm/PRMstar.h>
#include <ompl/geometric/planners/prm/SPARS.h>
#include <ompl/geometric/planners/prm/SPARStwo.h>
#include <ompl/geometric/planners/rlrt/BiRLRT.h>
#include <ompl/geometric/planners/rlrt/RLRT.h>
#include <ompl/geometric/planners/rrt/BiTRRT.h>
#include <ompl/geometric/planners/rrt/InformedRRTstar.h>
#include <ompl/geometric/planners/rrt/LBTRRT.h>
#include <ompl/geometric/planners/rrt/LazyRRT.h>
#include <ompl/geometric/planners/rrt/RRT.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/geometric/planners/rrt/RRTXstatic.h>
#include <ompl/geometric/planners/rrt/RRTsharp.h>
#include <ompl/geometric/planners/rrt/RRTstar.h>
#include <ompl/geometric/planners/rrt/SORRTstar.h>
#include <ompl/geometric/planners/rrt/TRRT.h>
#include <ompl/geometric/planners/sbl/SBL.h>
#include <ompl/geometric/planners/sst/SST.h>
#include <ompl/geometric/planners/stride/STRIDE.h>

#include <array>

#include "stages/perception/swept_ball.hpp"

namespace roborun::stages {
namespace {

namespace ob = ompl::base;
namespace og = ompl::geometric;

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

using Allocate = ob::PlannerPtr (*)(const ob::SpaceInformationPtr&);
template <typename PlannerType>
ob::PlannerPtr allocate(const ob::SpaceInformationPtr& info) {
  return std::make_shared<PlannerType>(info);
}

// Left out: planners that start threads (pRRT, pSBL, CForest), that need experience, a vector field or
// several spaces (Lightning, Thunder, VFRRT, TSRRT, QRRT, XXL), ProjEST, which needs a projection of its own,
// and LazyLBTRRT, whose assertion in LPAstarOnGraph::removeEdge fails (OMPL 1.5.2).
constexpr std::size_t kCount = 31;
constexpr std::array<std::string_view, kCount> kName{
    "RRTstar",  "InformedRRTstar", "SORRTstar",  "RRTsharp", "RRTXstatic", "LBTRRT",
    "RRT",      "LazyRRT",         "RRTConnect", "TRRT",     "BiTRRT",     "BITstar",
    "ABITstar", "AITstar",         "FMT",        "BFMT",     "EST",        "BiEST",
    "KPIECE1",  "BKPIECE1",        "LBKPIECE1",  "PDST",     "PRM",        "PRMstar",
    "LazyPRM",  "LazyPRMstar",     "SPARS",      "SPARStwo", "SBL",        "SST",
    "STRIDE"};
constexpr std::array<Allocate, kCount> kAllocate{allocate<og::RRTstar>,    allocate<og::InformedRRTstar>,
                                                 allocate<og::SORRTstar>,  allocate<og::RRTsharp>,
                                                 allocate<og::RRTXstatic>, allocate<og::LBTRRT>,
                                                 allocate<og::RRT>,        allocate<og::LazyRRT>,
                                                 allocate<og::RRTConnect>, allocate<og::TRRT>,
                                                 allocate<og::BiTRRT>,     allocate<og::BITstar>,
                                                 allocate<og::ABITstar>,   allocate<og::AITstar>,
                                                 allocate<og::FMT>,        allocate<og::BFMT>,
                                                 allocate<og::EST>,        allocate<og::BiEST>,
                                                 allocate<og::KPIECE1>,    allocate<og::BKPIECE1>,
                                                 allocate<og::LBKPIECE1>,  allocate<og::PDST>,
                                                 allocate<og::PRM>,        allocate<og::PRMstar>,
                                                 allocate<og::LazyPRM>,    allocate<og::LazyPRMstar>,
                                                 allocate<og::SPARS>,      allocate<og::SPARStwo>,
                                                 allocate<og::SBL>,        allocate<og::SST>,
                                                 allocate<og::STRIDE>};

}  // namespace

Vector3 to_vector(const ob::State* state) {
  const auto* p = state->as<ob::RealVectorStateSpace::StateType>();
  return {(*p)[0], (*p)[1], (*p)[2]};
}

ob::SpaceInformationPtr make_ompl_space(const MapView& view, const Aabb& bounds_W, double radius_m,
                                        std::uint64_t& lookups) {
  const auto space = std::make_shared<ob::RealVectorStateSpace>(3);
  ob::RealVectorBounds bounds(3);
  for (unsigned i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    bounds.setLow(i, bounds_W.min_W[axis]);
    bounds.setHigh(i, bounds_W.max_W[axis]);
  }
  space->setBounds(bounds);
  auto info = std::make_shared<ob::SpaceInformation>(space);
  info->setStateValidityChecker([&view, &lookups, radius_m](const ob::State* s) {
    return is_ball_free(view, to_vector(s), radius_m, lookups);
  });
  info->setMotionValidator(std::make_shared<SegmentValidator>(info.get(), view, radius_m, lookups));
  info->setup();
  return info;
}

ob::ProblemDefinitionPtr make_ompl_problem(const ob::SpaceInformationPtr& info, const Vector3& start_W,
                                           const Vector3& goal_W, double tolerance_m) {
  auto problem = std::make_shared<ob::ProblemDefinition>(info);
  ob::ScopedState<ob::RealVectorStateSpace> start(info);
  ob::ScopedState<ob::RealVectorStateSpace> goal(info);
  for (unsigned i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    start[i] = start_W[axis];
    goal[i] = goal_W[axis];
  }
  problem->setStartAndGoalStates(start, goal, tolerance_m);
  problem->setOptimizationObjective(std::make_shared<ob::PathLengthOptimizationObjective>(info));
  return problem;
}

ob::PlannerPtr allocate_ompl_planner(std::string_view name, const ob::SpaceInformationPtr& info) {
  for (std::size_t i = 0; i < kCount; ++i) {
    if (kName[i] == name) return kAllocate[i](info);
  }
  return nullptr;
}

std::span<const std::string_view> ompl_planner_names() noexcept { return kName; }

}  // namespace roborun::stages
