/// Lockstep charges a map and a planner for the work that they say they did: one that says little is fast.
/// So each of their calls is timed, beside the flight: the time decides nothing in it, but what a part says and
/// what it took are compared afterwards.
///
/// The rule: over a flight no part may take more than kMostUnderstated times as long as its counted work is
/// worth, at the prices of the profile that is flown and at those of this machine. Without a word about its
/// work (a path that costs nothing at the flown prices) a planner that did not ship is refused at once.
#pragma once

#include <span>
#include <vector>

#include "core/executive/cost_profile.hpp"
#include "platform/flight/flight_system.hpp"
#include "platform/report/mission_result.hpp"

namespace roborun::mission {

/// Those that ship took 0.8 to 1.8 times what they counted (platform/mission/DECISIONS.md says where); the rest is
/// room for other machines, and for planners that think between their looks at the map.
inline constexpr double kMostUnderstated = 5.0;

/// False where the counted work is worth less than the time it took, by more than the rule allows. Less than
/// 50 ms in a whole flight is never too much.
[[nodiscard]] bool is_believable(const report::WorkRecord& work) noexcept;

/// What one part said and took.
struct PartWork {
  double measured_s{};
  std::vector<double> counted_s;  ///< By price list.
  bool silent{false};             ///< It gave an answer that costs nothing at the first prices.
};

/// The map and the planner of a flight, which they do not change: same calls, same answers.
class TimedMap final : public stages::OccupancyMap {
 public:
  TimedMap(stages::OccupancyMap& map, std::span<const core::CostProfile> prices)
      : map_(map),
        prices_(prices),
        integrate_{0.0, std::vector<double>(prices.size()), false},
        export_{integrate_} {}
  [[nodiscard]] Status integrate(const stages::IntegrationRequest& request, core::StageBudget& budget,
                                 stages::IntegrationResult& result) noexcept override;
  [[nodiscard]] Status export_view(const stages::ExportRequest& request, core::StageBudget& budget,
                                   core::Work& work) noexcept override;
  void forget() noexcept override { map_.forget(); }
  [[nodiscard]] const stages::MapView& view() const noexcept override { return map_.view(); }
  [[nodiscard]] std::uint64_t saw_through(MonotonicTime now,
                                          std::span<const Vector3> center_W) const noexcept override {
    return map_.saw_through(now, center_W);
  }
  [[nodiscard]] double known_volume_m3() const noexcept override { return map_.known_volume_m3(); }
  [[nodiscard]] std::size_t bytes() const noexcept override { return map_.bytes(); }
  [[nodiscard]] std::uint64_t digest() const noexcept override { return map_.digest(); }
  [[nodiscard]] std::uint64_t refusals() const noexcept override { return map_.refusals(); }
  [[nodiscard]] const PartWork& integrated() const noexcept { return integrate_; }
  [[nodiscard]] const PartWork& exported() const noexcept { return export_; }

 private:
  stages::OccupancyMap& map_;
  std::span<const core::CostProfile> prices_;
  PartWork integrate_, export_;
};

class TimedPlanner final : public stages::Planner {
 public:
  TimedPlanner(stages::Planner& planner, std::span<const core::CostProfile> prices)
      : planner_(planner), prices_(prices), work_{0.0, std::vector<double>(prices.size()), false} {}
  [[nodiscard]] Status plan(const stages::PlanRequest& request, const stages::MapView& view,
                            core::StageBudget& budget, stages::PlanResult& result) noexcept override;
  [[nodiscard]] const PartWork& work() const noexcept { return work_; }

 private:
  stages::Planner& planner_;
  std::span<const core::CostProfile> prices_;
  PartWork work_;
};

/// Of map, export and planner, for the report.
[[nodiscard]] std::vector<report::WorkRecord> work_of(const TimedMap& map, const TimedPlanner& planner);

}  // namespace roborun::mission
