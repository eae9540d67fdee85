/// A planner that plans ROBORUN_REPEATS times and says ROBORUN_SAYS of the work that it did.
#include "platform/board/plugin.hpp"
#include "platform/flight/example/own_planner.hpp"

namespace roborun::board {
namespace {

class BusyPlanner final : public stages::Planner {
 public:
  [[nodiscard]] Status plan(const stages::PlanRequest& request, const stages::MapView& view,
                            core::StageBudget& budget, stages::PlanResult& result) noexcept override {
    Status status = Status::kNoPath;
    for (int i = 0; i < ROBORUN_REPEATS; ++i) status = straight_.plan(request, view, budget, result);
    result.work.units = static_cast<std::uint64_t>(ROBORUN_SAYS * static_cast<double>(result.work.units));
    result.work.volume_m3 *= ROBORUN_SAYS;
    return status;
  }

 private:
  example::StraightPlanner straight_;
};

}  // namespace
}  // namespace roborun::board

ROBORUN_PLUGIN_PLANNER(roborun::board::BusyPlanner)
