#include "core/executive/cost_profile.hpp"

#include <algorithm>

#include "core/range.hpp"

namespace roborun::core {

StageCost slower(const StageCost& cost, double factor) noexcept {
  StageCost result = cost;
  result.per_unit_s *= factor;
  for (double& s : result.fixed_s) s *= factor;
  for (double& s : result.per_m3_s) s *= factor;
  return result;
}

CostProfile slower(const CostProfile& profile, double factor) noexcept {
  CostProfile result = profile;
  for (StageCost& cost : result.stage) cost = slower(cost, factor);
  return result;
}

Status StageCost::validate() const noexcept {
  constexpr double kMost_s = 1e6;
  bool ok = within(per_unit_s, 0.0, kMost_s);
  for (const double s : fixed_s) ok = ok && within(s, 0.0, kMost_s);
  for (const double s : per_m3_s) ok = ok && within(s, 0.0, kMost_s);
  return ok ? Status::kOk : Status::kInvalidArgument;
}

Status CostProfile::validate() const noexcept {
  const bool ok = std::all_of(stage.begin(), stage.end(),
                              [](const StageCost& cost) { return cost.validate() == Status::kOk; });
  return ok ? Status::kOk : Status::kInvalidArgument;
}

Nanos CostProfile::cost(StageId id, const Work& work) const noexcept {
  const StageCost& c = of(id);
  const auto level = static_cast<std::size_t>(std::clamp(work.level, 0, kPrecisionLevels - 1));
  const double total_s = c.fixed_s[level] + static_cast<double>(work.units) * c.per_unit_s +
                         std::max(work.volume_m3, 0.0) * c.per_m3_s[level];
  return from_seconds(std::max(total_s, 0.0));
}

CostProfile paper_profile() noexcept {
  constexpr std::array<double, kPrecisionLevels> kMap_s{1.26,   0.188,  0.031,
                                                        0.0114, 0.0081, 0.0058};  // per 10,000 m3
  constexpr std::array<double, kPrecisionLevels> kExport_s{0.074, 0.026, 0.013,
                                                           0.005, 0.005, 0.005};  // per 10,000 m3
  constexpr double kPlannerFinest_s = 0.37;
  constexpr double kPlannerPerOctave = 0.42275;  // (0.005 / 0.37)^(1/5)
  constexpr std::array<double, kPrecisionLevels> kHandOver_s{0.25, 0.12, 0.05, 0.03, 0.02, 0.01};
  constexpr double kPerVolume = 1e-4;

  CostProfile profile;
  StageArray<StageCost>& stage = profile.stage;
  stage[StageId::kPointCloud].fixed_s.fill(0.21 + 0.07 + 0.09);
  stage[StageId::kGovernor].fixed_s.fill(0.10);
  stage[StageId::kSmoother].fixed_s.fill(0.01);
  double planner_s = kPlannerFinest_s;
  for (std::size_t level = 0; level < kPrecisionLevels; ++level, planner_s *= kPlannerPerOctave) {
    stage[StageId::kMap].fixed_s[level] = kHandOver_s[level];
    stage[StageId::kExport].fixed_s[level] = kHandOver_s[level];
    stage[StageId::kMap].per_m3_s[level] = kPerVolume * kMap_s[level];
    stage[StageId::kExport].per_m3_s[level] = kPerVolume * kExport_s[level];
    stage[StageId::kPlanner].per_m3_s[level] = kPerVolume * planner_s;
  }
  return profile;
}

std::array<double, kPrecisionLevels> on_lattice(const std::array<double, kPrecisionLevels>& published,
                                                const PrecisionLattice& lattice) noexcept {
  constexpr PrecisionLattice kPublished{};
  std::array<double, kPrecisionLevels> result{};
  for (int level = 0; level < kPrecisionLevels; ++level) {
    const double edge_m = lattice.cell_size_m(level);
    double low_m = kPublished.finest_m, low = published[0], high = published[1];
    if (edge_m >= low_m) {
      const int below = std::min(kPublished.coarsest_level_within(edge_m), kPrecisionLevels - 2);
      low_m = kPublished.cell_size_m(below);
      low = published[static_cast<std::size_t>(below)];
      high = published[static_cast<std::size_t>(below) + 1];
    }
    const double ratio = high > 0.0 ? std::max(low / high, 1.0) : 1.0;
    for (; edge_m < low_m; low_m *= 0.5) {
      high = low;
      low *= ratio;
    }
    result[static_cast<std::size_t>(level)] = low + (high - low) * std::min(edge_m / low_m - 1.0, 1.0);
  }
  return result;
}

CostProfile on_lattice(const CostProfile& published, const PrecisionLattice& lattice) noexcept {
  CostProfile result = published;
  if (lattice.finest_m == kPublishedCell_m) return result;
  for (StageCost& cost : result.stage) {
    cost.fixed_s = on_lattice(cost.fixed_s, lattice);
    cost.per_m3_s = on_lattice(cost.per_m3_s, lattice);
  }
  return result;
}

}  // namespace roborun::core
