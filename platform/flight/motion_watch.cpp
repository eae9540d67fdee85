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
constexpr double kComes_mps = 2.0;  // what a body nears by while the vehicle brakes: slow ones 1, fast ones 3
// Points of one body may lie so much above each other: far away the pixels of an upright one are farther apart than it is wide.
constexpr double kHigh_m = 1.5;
constexpr Nanos kMemory{3'000'000'000};
constexpr Nanos kTraceMemory{10'000'000'000};  // as long as the map may remember what has gone

/// Points that appeared, by place.
class Appeared {
 public:
  struct Place {
    Vector3 p_W;
    int points;
    Vector3 sum_W;
    int ahead;
  };
  explicit Appeared(const MotionWatch::Input& in) noexcept : in_(in) {}
  void add(const Vector3& p_W) noexcept {
    const bool behind = (p_W - in_.p_WB).dot(in_.v_WB) < 0.0 && in_.v_WB.norm() > kStanding_mps;
    const auto place = std::find_if(places_.begin(), places_.end(), [&p_W](const Place& other) {
      const Vector3 apart = other.p_W - p_W;
      return core::hypot2(apart.x(), apart.y()) < kBodyReach_m && std::fabs(apart.z()) < kHigh_m;
    });
    if (place != places_.end()) {
      ++place->points;
      place->sum_W += p_W;
      place->ahead += behind ? 0 : 1;
    } else {
      (void)places_.push_back({p_W, 1, p_W, behind ? 0 : 1});
    }
  }
  [[nodiscard]] const core::StaticVector<Place, MotionWatch::kTraces / 4>& places() const noexcept {
    return places_;
  }

 private:
  const MotionWatch::Input& in_;
  core::StaticVector<Place, MotionWatch::kTraces / 4> places_;
};

}  // namespace

DepthError point_error(std::span<const stages::PosedDepthFrame> frames) noexcept {
  constexpr double kSigma = 0.577;  // of half a pixel: anywhere in it
  DepthError worst{.constant_m = 0.0, .quadratic_per_m = 0.0};
  for (const stages::PosedDepthFrame& posed : frames) {
    worst.constant_m = std::fmax(worst.constant_m, posed.error.constant_m);
    worst.quadratic_per_m = std::fmax(worst.quadratic_per_m, posed.error.quadratic_per_m);
    if (!posed.is_cloud || posed.frame.width == 0) continue;
    const double half_pixel_rad = static_cast<double>(posed.frame.tan_half_width) / posed.frame.width;
    worst.angle_rad = std::fmax(worst.angle_rad, kSigma * half_pixel_rad);
  }
  return worst;
}

void MotionWatch::sense(const Input& in, std::span<const stages::CloudPoint> points,
                        const stages::OccupancyMap& map, core::StageBudget& budget,
                        core::Work& work) noexcept {
  const stages::PolledView known(map.view(), budget, work);
  Appeared appeared(in);
  // What the map does not know to have been free: the images of a moment ago may, though they are as noisy as these.
  core::StaticVector<Vector3, 64> unsure_W;
  const auto ask = [&] {
    const std::uint64_t free =
        known.spent() ? 0 : map.saw_through(in.now, {unsure_W.begin(), unsure_W.size()});
    work.units += unsure_W.size();
    for (std::size_t i = 0; i < unsure_W.size(); ++i)
      if (((free >> i) & 1U) != 0) appeared.add(unsure_W[i]);
    unsure_W.clear();
  };
  for (const stages::CloudPoint& point : points) {
    const double distance_m = (point.p_W - in.p_WB).norm();
    if (distance_m > kReach_m || !in.relevant_W.contains(point.p_W)) continue;
    const double around_m = kAppeared_m + kSigmas * in.error.of_point_m(distance_m);
    if (known.is_free_at_finest(Aabb::around(point.p_W, around_m), work.units)) {
      appeared.add(point.p_W);
      continue;
    }
    (void)unsure_W.push_back(point.p_W);  // there is room: it asks as soon as there is none
    if (unsure_W.size() == unsure_W.capacity()) ask();
  }
  ask();
  const double v_mps = in.v_WB.norm();
  const double brakes_s = v_mps > kStanding_mps ? 2.0 * in.stop_m / v_mps : 0.0;
  const double near_m = std::fmax(kNear_m, in.stop_m + kComes_mps * brakes_s);
  // A body is in one place; pixels between two depths lie here and there.
  appeared_W_.clear();
  for (const Appeared::Place& place : appeared.places()) {
    if (place.points < kLeastPoints) continue;
    const Vector3 seen_W = place.sum_W / place.points;
    (void)appeared_W_.push_back(surface_middle_W(seen_W, points).value_or(seen_W));
    if (place.ahead < kLeastPoints) continue;
    if ((seen_W - in.p_WB).norm() < near_m) startled_until_ = in.now + kMemory;
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
