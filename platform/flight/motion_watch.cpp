#include "platform/flight/motion_watch.hpp"

#include <algorithm>

#include "stages/perception/polled_view.hpp"

namespace roborun::flight {
namespace {

constexpr double kAppeared_m = 0.15;  // around a point, known to be free: depth noise is less
constexpr int kLeastPoints = 3;
constexpr double kStanding_mps = 0.5;
constexpr double kSpacing_m = 0.6;  // of two traces
constexpr Nanos kMemory{3'000'000'000};
constexpr Nanos kTraceMemory{10'000'000'000};  // as long as the map may remember what has gone

}  // namespace

void MotionWatch::sense(const Input& in, std::span<const stages::CloudPoint> points,
                        const stages::MapView& known_view, core::StageBudget& budget,
                        core::Work& work) noexcept {
  const stages::PolledView known(known_view, budget, work);
  core::StaticVector<Vector3, kTraces / 4> appeared_W;
  int appeared = 0;
  for (const stages::CloudPoint& point : points) {
    const Vector3 offset = point.p_W - in.p_WB;
    const bool behind = offset.dot(in.v_WB) < 0.0 && in.v_WB.norm() > kStanding_mps;
    if (offset.norm() > kReach_m || behind || !in.relevant_W.contains(point.p_W)) continue;
    if (!known.is_free_at_finest(Aabb::around(point.p_W, kAppeared_m), work.units)) continue;
    ++appeared;
    const bool noted = std::any_of(appeared_W.begin(), appeared_W.end(), [&point](const Vector3& other_W) {
      return (other_W - point.p_W).squaredNorm() < kSpacing_m * kSpacing_m;
    });
    if (!noted && !appeared_W.push_back(point.p_W)) break;
  }
  if (appeared < kLeastPoints) return;
  moving_until_ = in.now + kMemory;
  for (const Vector3& p_W : appeared_W) {
    trace_[next_trace_] = {p_W, in.now + kTraceMemory};
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
