#include "platform/mission/work_check.hpp"

#include <algorithm>

#include "platform/board/thread_time.hpp"

namespace roborun::mission {
namespace {

void account(double begin_s, core::StageId id, const core::Work& said,
             std::span<const core::CostProfile> prices, PartWork& work) noexcept {
  work.measured_s += board::thread_time_s() - begin_s;
  for (std::size_t i = 0; i < prices.size(); ++i) work.counted_s[i] += seconds(prices[i].cost(id, said));
}

}  // namespace

bool is_believable(const report::WorkRecord& work) noexcept {
  constexpr double kTooShortToTell_s = 0.05;
  return work.measured_s <= std::max(kTooShortToTell_s, kMostUnderstated * work.counted_s);
}

Status TimedMap::integrate(const stages::IntegrationRequest& request, core::StageBudget& budget,
                           stages::IntegrationResult& result) noexcept {
  const double begin_s = board::thread_time_s();
  const Status status = map_.integrate(request, budget, result);
  account(begin_s, core::StageId::kMap, result.work, prices_, integrate_);
  return status;
}

Status TimedMap::export_view(const stages::ExportRequest& request, core::StageBudget& budget,
                             core::Work& work) noexcept {
  const double begin_s = board::thread_time_s();
  const Status status = map_.export_view(request, budget, work);
  account(begin_s, core::StageId::kExport, work, prices_, export_);
  return status;
}

Status TimedPlanner::plan(const stages::PlanRequest& request, const stages::MapView& view,
                          core::StageBudget& budget, stages::PlanResult& result) noexcept {
  const double begin_s = board::thread_time_s();
  const Status status = planner_.plan(request, view, budget, result);
  account(begin_s, core::StageId::kPlanner, result.work, prices_, work_);
  work_.silent = work_.silent || (result.path_W.size() >= 2 &&
                                  prices_.front().cost(core::StageId::kPlanner, result.work) == Nanos{0});
  return status;
}

std::vector<report::WorkRecord> work_of(const TimedMap& map, const TimedPlanner& planner) {
  std::vector<report::WorkRecord> records;
  for (const auto& [stage, work] :
       {std::pair{core::StageId::kMap, &map.integrated()}, std::pair{core::StageId::kExport, &map.exported()},
        std::pair{core::StageId::kPlanner, &planner.work()}})
    records.push_back({core::to_string(stage), work->measured_s,
                       *std::min_element(work->counted_s.begin(), work->counted_s.end())});
  return records;
}

}  // namespace roborun::mission
