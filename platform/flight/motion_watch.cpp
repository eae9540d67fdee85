#include "platform/flight/motion_watch.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/math.hpp"
#include "platform/flight/surface_middle.hpp"
#include "stages/perception/polled_view.hpp"

namespace roborun::flight {
namespace {

// Around a point, known to be free: so much, and what depths are wrong by.
constexpr double kAppeared_m = 0.05;
constexpr double kSigmas = 3.0;
constexpr int kLeastPoints = 3;
constexpr double kStanding_mps = 0.5;
// Points of one body may lie so much above each other: far away the pixels of an upright one are farther apart than it is wide.
constexpr double kHigh_m = 1.5;
constexpr Nanos kMemory{3'000'000'000};
constexpr Nanos kTraceMemory{10'000'000'000};  // as long as the map may remember what has gone

}  // namespace

void MotionWatch::sense(const Input& in, std::span<const stages::CloudPoint> points,
                        const stages::MapView& known_view, core::StageBudget& budget,
                        core::Work& work) noexcept {
  const stages::PolledView known(known_view, budget, work);
  struct Place {
    Vector3 p_W;
    int points;
    Vector3 sum_W;
    int ahead;
  };
  core::StaticVector<Place, kTraces / 4> appeared;
  for (const stages::CloudPoint& point : points) {
    const Vector3 offset = point.p_W - in.p_WB;
    const bool behind = offset.dot(in.v_WB) < 0.0 && in.v_WB.norm() > kStanding_mps;
    if (offset.norm() > kReach_m || !in.relevant_W.contains(point.p_W)) continue;
    const double around_m = kAppeared_m + kSigmas * in.error.at_m(offset.norm());
    if (!known.is_free_at_finest(Aabb::around(point.p_W, around_m), work.units)) continue;
    const auto place = std::find_if(appeared.begin(), appeared.end(), [&point](const Place& other) {
      const Vector3 apart = other.p_W - point.p_W;
      return core::hypot2(apart.x(), apart.y()) < kBodyReach_m && std::fabs(apart.z()) < kHigh_m;
    });
    if (place != appeared.end()) {
      ++place->points;
      place->sum_W += point.p_W;
      place->ahead += behind ? 0 : 1;
    } else if (!appeared.push_back({point.p_W, 1, point.p_W, behind ? 0 : 1})) {
      break;
    }
  }
  // A body is in one place; pixels between two depths lie here and there.
  appeared_W_.clear();
  for (const Place& place : appeared) {
    if (place.points < kLeastPoints) continue;
    const Vector3 seen_W = place.sum_W / place.points;
    (void)appeared_W_.push_back(surface_middle_W(seen_W, points).value_or(seen_W));
    if (place.ahead < kLeastPoints) continue;
    moving_until_ = in.now + kMemory;
    trace_[next_trace_] = {place.p_W, in.now + kTraceMemory};
    next_trace_ = (next_trace_ + 1) % kTraces;
  }
}

MotionWatch::Places MotionWatch::places_W(MonotonicTime now) const noexcept {
  Places places_W;
  for (const Trace& trace : trace_) {
    if (now < trace.until) (void)places_W.push_back(trace.p_W);
  }
  return places_W;
}

}  // namespace roborun::flight
