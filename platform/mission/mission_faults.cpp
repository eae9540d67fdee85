#include "platform/mission/mission_faults.hpp"

#include <limits>

namespace roborun::mission {

using sitl::Component;
using sitl::FaultKind;

std::vector<firmware_if::DepthCamera*> MissionFaults::connect(
    std::span<firmware_if::DepthCamera* const> cameras) {
  std::vector<firmware_if::DepthCamera*> all(cameras.begin(), cameras.end());
  if (empty()) return all;
  for (std::size_t i = 0; i < all.size(); ++i)
    all[i] = &camera_.emplace_back(*all[i], static_cast<int>(i), line_);
  return all;
}

bool MissionFaults::advance(MonotonicTime now, governor::Phase phase) {
  line_.advance(now);
  const auto in = static_cast<std::size_t>(phase);
  if (!phase_begin_[in]) phase_begin_[in] = now;
  const bool before = any_;
  for (std::size_t i = 0; i < begun_.size(); ++i) {
    const TimedFault& f = config_.faults[i];
    const auto from = f.phase ? phase_begin_[static_cast<std::size_t>(*f.phase)] : start_;
    if (begun_[i] || !from || seconds(now - *from) < f.at_s) continue;
    begun_[i] = true;
    any_ = true;
    line_.inject(f.fault, from_seconds(f.for_s), from_seconds(f.every_s));
  }
  return any_ && !before;
}

Vector3 MissionFaults::mean_wind_W_mps() const {
  return line_.of(Component::kWind) == FaultKind::kOn ? Vector3(0.0, line_.size(Component::kWind), 0.0)
                                                      : config_.simulator.wind.mean_W_mps;
}

void MissionFaults::refuse_bricks(core::Arena& arena) const noexcept {
  core::PoolRecord* bricks = arena.find("map bricks");
  if (bricks == nullptr) return;
  bricks->fault = line_.of(Component::kMap) == FaultKind::kOff
                      ? core::PoolRecord::Fault{0, std::numeric_limits<std::uint64_t>::max()}
                      : core::PoolRecord::Fault{};
}

flight::Computer MissionFaults::computer(MonotonicTime now) const noexcept {
  const FaultKind cpu = line_.of(Component::kCpu);
  return {.flight_runs = cpu != FaultKind::kOff,
          .decision_runs = cpu != FaultKind::kOff && cpu != FaultKind::kStuck,
          .slower =
              config_.slow_down.slower(now) * (cpu == FaultKind::kSlow ? line_.size(Component::kCpu) : 1.0)};
}

Status FaultyPlanner::plan(const stages::PlanRequest& request, const stages::MapView& view,
                           core::StageBudget& budget, stages::PlanResult& result) noexcept {
  const FaultKind kind = line_.of(Component::kPlanner);
  const bool silent = kind == FaultKind::kOff ||
                      (kind == FaultKind::kIntermittent && line_.loses(Component::kPlanner, 0, request.seed));
  if (!silent) return planner_.plan(request, view, budget, result);
  result = {};
  return Status::kBudgetSpent;
}

}  // namespace roborun::mission
