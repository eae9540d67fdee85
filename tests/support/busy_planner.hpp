/// A planner that plans several times over, and says a share of the work that it did.
#pragma once

#include <cstdint>

#include "platform/flight/example/own_planner.hpp"

namespace roborun::test {

class BusyPlanner : public stages::Planner {
 public:
  BusyPlanner(int repeats, double share) noexcept : repeats_(repeats), share_(share) {}
  [[nodiscard]] Status plan(const stages::PlanRequest& request, const stages::MapView& view,
                            core::StageBudget& budget, stages::PlanResult& result) noexcept override {
    Status status = Status::kNoPath;
    for (int i = 0; i < repeats_; ++i) status = straight_.plan(request, view, budget, result);
    result.work.units = static_cast<std::uint64_t>(share_ * static_cast<double>(result.work.units));
    result.work.volume_m3 *= share_;
    return status;
  }

 private:
  example::StraightPlanner straight_;
  int repeats_;
  double share_;
};

}  // namespace roborun::test
