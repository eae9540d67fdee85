#include "stages/perception/space_profiler.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/geometry/math.hpp"
#include "firmware_if/assert.hpp"
#include "stages/perception/polled_view.hpp"

namespace roborun::stages {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kSectors = 72;
constexpr double kSameObstacle_m = 3.0;

struct Sector {
  double range_m{kInfinity};
  double x_m{};
  double y_m{};
};

double distance_m(const Sector& a, const Sector& b) noexcept {
  return core::hypot2(a.x_m - b.x_m, a.y_m - b.y_m);
}

/// False if the budget was spent before the last point.
bool profile_points(const SpaceProfilerConfig& config, std::span<const CloudPoint> points,
                    const Vector3& p_WB, const Aabb& relevant_W, core::StageBudget& budget,
                    const core::Work& work, SpaceProfile& profile) noexcept {
  std::array<Sector, kSectors> sector{};
  profile.closest_obstacle_m = kInfinity;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i % 1024 == 0 && budget.spent(work)) return false;
    const CloudPoint& point = points[i];
    const Vector3 offset = point.p_W - p_WB;
    if (relevant_W.contains(point.p_W))
      profile.closest_obstacle_m = std::fmin(profile.closest_obstacle_m, offset.norm());
    const double range_m = core::hypot2(offset.x(), offset.y());
    if (std::fabs(offset.z()) > config.height_band_m || range_m > config.gap_reach_m || !(range_m > 0.0))
      continue;
    const double turn = (core::atan2(offset.y(), offset.x()) + core::kPi) / (2.0 * core::kPi);
    Sector& s =
        sector[static_cast<std::size_t>(std::clamp(static_cast<int>(turn * kSectors), 0, kSectors - 1))];
    if (range_m < s.range_m) s = {range_m, offset.x(), offset.y()};
  }
  double sum_m = 0.0;
  int count = 0;
  const auto first =
      std::find_if(sector.begin(), sector.end(), [](const Sector& s) { return s.range_m < kInfinity; });
  if (first != sector.end()) {
    const auto begin = static_cast<std::size_t>(first - sector.begin());
    Sector last = *first;
    std::size_t last_at = 0;
    for (std::size_t i = 1; i <= kSectors; ++i) {
      const Sector& s = sector[(begin + i) % kSectors];
      if (s.range_m == kInfinity) continue;
      const double gap_m = distance_m(last, s);
      const bool same_obstacle = i - last_at == 1 && std::fabs(s.range_m - last.range_m) < kSameObstacle_m;
      last_at = i;
      if (!same_obstacle && gap_m >= config.vehicle_width_m && gap_m <= config.widest_gap_m) {
        sum_m += gap_m;
        ++count;
      }
      last = s;
    }
  }
  profile.gap_average_m = count > 0 ? sum_m / count : kInfinity;
  return true;
}

void profile_outlook(const SpaceProfilerConfig& config, const MapView& view, const Trajectory& committed,
                     MonotonicTime now, double radius_m, SpaceProfile& profile,
                     std::uint64_t& lookups) noexcept {
  const double begin_s = std::fmax(seconds(now - committed.start_time), 0.0);
  const double rest_s = std::fmax(committed.duration_s() - begin_s, 0.0);
  double step_s = config.outlook_step_s;
  for (int i = 0; i < 16 && rest_s / step_s > static_cast<double>(SpaceProfile::kMaxOutlook - 1); ++i)
    step_s *= 2.0;
  profile.outlook_count = 0;
  for (std::size_t i = 0; i < SpaceProfile::kMaxOutlook; ++i) {
    const double ahead_s = static_cast<double>(i) * step_s;
    if (ahead_s > rest_s) break;
    const TrajectoryPoint point = committed.at_s(begin_s + ahead_s);
    const double speed_mps = point.v_W.norm();
    const double visible_m = speed_mps > 0.05 ? free_distance_m(view, point.p_W, point.v_W, radius_m,
                                                                config.max_visible_m, lookups)
                                              : config.max_visible_m;
    profile.outlook[profile.outlook_count++] = {ahead_s, speed_mps, visible_m};
  }
}

}  // namespace

CloudNeed needed_points(const SpaceProfilerConfig& config, const Vector3& p_WB,
                        const Aabb& relevant_W) noexcept {
  return {p_WB, core::hypot2(config.gap_reach_m, config.height_band_m),
          std::fmin(relevant_W.min_W.z(), p_WB.z() - config.height_band_m),
          std::fmax(relevant_W.max_W.z(), p_WB.z() + config.height_band_m), relevant_W};
}

Status profile_space(const SpaceProfilerConfig& config, std::span<const CloudPoint> points,
                     const MapView& map, const Trajectory& committed, MonotonicTime now, const Vector3& p_WB,
                     const Vector3& v_WB, const Vector3& goal_W, const Aabb& relevant_W, double radius_m,
                     SpaceProfile& profile, core::StageBudget& budget, core::Work& work) noexcept {
  ROBORUN_ASSERT(config.validate() == Status::kOk);
  const PolledView view(map, budget, work);
  const bool all = profile_points(config, points, p_WB, relevant_W, budget, work, profile);
  if (!all) {
    profile.closest_obstacle_m = 0.0;
    profile.gap_average_m = config.vehicle_width_m;
  }
  profile.speed_mps = v_WB.norm();
  const Vector3 ahead_W = profile.speed_mps > 0.2 ? v_WB : Vector3(goal_W - p_WB);
  profile.closest_unknown_m =
      free_distance_m(view, p_WB, ahead_W, radius_m, config.max_visible_m, work.units);
  profile_outlook(config, view, committed, now, radius_m, profile, work.units);
  return all && !view.spent() ? Status::kOk : Status::kBudgetSpent;
}

}  // namespace roborun::stages
