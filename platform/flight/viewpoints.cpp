#include "platform/flight/viewpoints.hpp"

#include <array>
#include <cmath>

#include "core/geometry/math.hpp"

namespace roborun::flight {
namespace {

// A cell that was looked at from as near as this, and within 23 degrees, is not seen better.
constexpr double kNear_m = 5.0;
constexpr double kSameWay = 0.92;
constexpr std::array<double, 3> kAway_m{1.0, 2.0, 3.0};
constexpr int kDirections = 16;
constexpr std::array<double, 5> kElevations_rad{-0.4, -0.2, 0.0, 0.2, 0.4};

bool has_free_neighbour(const stages::MapView& view, const Vector3& p_W, std::uint64_t& lookups) noexcept {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double by_m : {-view.finest_m(), view.finest_m()}) {
      Vector3 q_W = p_W;
      q_W[axis] += by_m;
      if (view.at(q_W, lookups) == stages::CellState::kFree) return true;
    }
  }
  return false;
}

/// Free from outside the vehicle to the cell beside it.
bool sees(const stages::MapView& view, const Vector3& from_W, const Vector3& cell_W, double radius_m,
          std::uint64_t& lookups) noexcept {
  const double step_m = 0.5 * view.finest_m();
  const Vector3 way = cell_W - from_W;
  const double length_m = way.norm();
  for (double at_m = radius_m; at_m < length_m - 1.8 * step_m; at_m += step_m) {
    if (view.at(from_W + at_m / length_m * way, lookups) != stages::CellState::kFree) return false;
  }
  return true;
}

}  // namespace

Viewpoints::Cells Viewpoints::unknown_around(const stages::PolledView& view, const Question& question,
                                             std::uint64_t& lookups) noexcept {
  const double cell_m = view.finest_m();
  // An opening that it just fits through, to its far end.
  const double reach_m = std::fmin(3.0 * question.radius_m + 2.0 * cell_m, 16.0 * cell_m);
  const int reach = static_cast<int>(reach_m / cell_m);
  Vector3 middle_W;
  for (int axis = 0; axis < 3; ++axis)
    middle_W[axis] = cell_m * (std::floor(question.place_W[axis] / cell_m) + 0.5);
  Cells cells_W;
  std::size_t every = 1, met = 0;
  for (int z = -reach; z <= reach; ++z) {
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        const Vector3 offset = cell_m * Vector3(x, y, z);
        const Vector3 p_W = middle_W + offset;
        if (offset.squaredNorm() > reach_m * reach_m || view.spent() ||
            view.at(p_W, lookups) != stages::CellState::kUnknown || !has_free_neighbour(view, p_W, lookups) ||
            met++ % every != 0)
          continue;
        if (cells_W.push_back(p_W)) continue;
        // Full: every other one of them, and from here on of what follows.
        Cells half_W;
        for (std::size_t i = 0; i < cells_W.size(); i += 2) (void)half_W.push_back(cells_W[i]);
        (void)half_W.push_back(p_W);
        cells_W = half_W;
        every *= 2;
      }
    }
  }
  return cells_W;
}

bool Viewpoints::was_looked_at(const Vector3& cell_W, const Vector3& from_W) const noexcept {
  const Vector3 way = (cell_W - from_W).normalized();
  for (const Vector3& q_W : answered_W_) {
    const Vector3 before = cell_W - q_W;
    if (before.norm() < kNear_m && way.dot(before) > kSameWay * before.norm()) return true;
  }
  return false;
}

std::optional<Vector3> Viewpoints::next(const stages::PolledView& view, const Question& question,
                                        std::uint64_t& lookups) noexcept {
  const Cells cells_W = unknown_around(view, question, lookups);
  std::optional<Vector3> best_W;
  std::size_t most = 0;
  for (const double away_m : kAway_m) {
    for (int i = 0; i < kDirections * static_cast<int>(kElevations_rad.size()); ++i) {
      const auto level = core::sin_cos(2.0 * core::kPi / kDirections * (i % kDirections));
      const auto up = core::sin_cos(kElevations_rad[static_cast<std::size_t>(i / kDirections)]);
      const Vector3 p_W = question.place_W + (question.radius_m + away_m) *
                                                 Vector3(level.cos * up.cos, level.sin * up.cos, up.sin);
      if (!question.bounds_W.contains(p_W) ||
          !stages::is_segment_free(view, question.place_W, p_W, question.radius_m, lookups))
        continue;
      std::size_t seen = 0;
      for (const Vector3& cell_W : cells_W) {
        const Vector3 way = cell_W - p_W;
        if (std::fabs(way.z()) <= question.level_view_ratio * core::hypot2(way.x(), way.y()) &&
            !was_looked_at(cell_W, p_W) && sees(view, p_W, cell_W, question.radius_m, lookups))
          ++seen;
      }
      if (seen > most) most = seen, best_W = p_W;
    }
  }
  if (!best_W) return best_W;
  if (!answered_W_.push_back(*best_W)) {
    answered_W_[oldest_] = *best_W;
    oldest_ = (oldest_ + 1) % kRemembered;
  }
  return best_W;
}

}  // namespace roborun::flight
