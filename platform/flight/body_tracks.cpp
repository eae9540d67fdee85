#include "platform/flight/body_tracks.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/geometry/math.hpp"
#include "platform/flight/surface_middle.hpp"

namespace roborun::flight {
namespace {

constexpr Nanos kLasts{2'000'000'000};  // without being seen
constexpr int kSure = 3;                // sightings
constexpr double kMoves_mps = 0.4;
// A place is somewhere on a surface, and as wrong as the depths.
constexpr double kLeastWay_m = 0.2;
constexpr double kWaySigmas = 2.0;
constexpr double kFastest_mps = 6.0;
// A sighting is a part of the surface that came into free space: which part, differs by about the body's radius.
constexpr double kGate_m = 1.2;
constexpr double kGateGrows_mps = 1.5;
constexpr double kPositionGain = 0.6;
constexpr double kVelocityGain = 0.35;
constexpr int kProbation = 8;      // sightings in which what appeared is followed though it has not moved
constexpr double kTouch_m = 0.6;   // kBodyReach_m without a reserve
constexpr double kBehind_m = 0.4;  // what is seen of a body is its near side: its middle is farther away
// What constant velocity is wrong by: more while it was estimated from few sightings.
constexpr double kGrows_mps = 0.25;
constexpr double kGrowsAtFirst_mps = 0.8;
constexpr double kGrowsBySightings_mps = 2.0;
constexpr double kHeight_m = 3.0;  // a body may reach so far above and below what was seen of it
constexpr double kStep_s = 0.1;

Vector3 at_most(const Vector3& v_W, double most_mps) noexcept {
  const double norm = v_W.norm();
  return norm > most_mps ? Vector3(v_W * (most_mps / norm)) : v_W;
}

double level_m(const Vector3& way) noexcept { return core::hypot2(way.x(), way.y()); }

Vector3 behind(const Vector3& place_W, const Vector3& p_WB) noexcept {
  const Vector3 sight = place_W - p_WB;
  const double sight_m = level_m(sight);
  if (!(sight_m > 0.0)) return Vector3::Zero();
  return kBehind_m / sight_m * Vector3(sight.x(), sight.y(), 0.0);
}

}  // namespace

bool BodyTracks::is_sure(const Track& track, MonotonicTime now) noexcept {
  return track.sightings >= kSure && now - track.seen <= kLasts && track.v_W.norm() > kMoves_mps &&
         level_m(track.p_W - track.first_W) > track.least_m;
}

bool BodyTracks::is_followed(const Track& track, MonotonicTime now) noexcept {
  if (track.sightings == 0 || now - track.seen > kLasts) return false;
  return track.sightings < kProbation || now <= track.moved + kLasts;
}

BodyTracks::Track* BodyTracks::continued_by(const Vector3& place_W, MonotonicTime now) noexcept {
  Track* nearest = nullptr;
  double nearest_m = 0.0;
  for (Track& track : track_) {
    const Nanos age = now - track.seen;
    if (track.sightings == 0 || age > kLasts || age <= Nanos{0}) continue;
    const double gate_m = kGate_m + kGateGrows_mps * seconds(age);
    const double distance_m = (at_W(track, now) - place_W).norm();
    if (distance_m > gate_m || (nearest != nullptr && distance_m >= nearest_m)) continue;
    nearest = &track;
    nearest_m = distance_m;
  }
  return nearest;
}

void BodyTracks::begin(const Vector3& place_W, const Vector3& p_WB, MonotonicTime now,
                       const DepthError& error) noexcept {
  const auto worth = [now](const Track& track) {
    const bool moves = track.sightings >= kSure && now <= track.moved + kLasts;
    return std::pair((track.sightings > 0 ? 1 : 0) + (moves ? 1 : 0), track.seen);
  };
  Track& least = *std::min_element(track_.begin(), track_.end(),
                                   [&](const Track& a, const Track& b) { return worth(a) < worth(b); });
  least = {.p_W = place_W,
           .seen = now,
           .first_W = place_W,
           .least_m = kLeastWay_m + kWaySigmas * error.of_point_m((place_W - p_WB).norm()),
           .behind_W = behind(place_W, p_WB),
           .sightings = 1};
}

void BodyTracks::observe(MonotonicTime now, const Vector3& p_WB, std::span<const Vector3> places_W,
                         const DepthError& error) noexcept {
  for (const Vector3& place_W : places_W) {
    // A part of a body that was followed to here already says nothing new.
    const bool known = std::any_of(track_.begin(), track_.end(), [&](const Track& track) {
      return track.sightings > 0 && track.seen == now && (track.p_W - place_W).norm() < 2.0 * kBodyReach_m;
    });
    if (known) continue;
    Track* track = continued_by(place_W, now);
    if (track == nullptr) {
      begin(place_W, p_WB, now, error);
      continue;
    }
    see(*track, place_W, p_WB, now);
  }
}

void BodyTracks::see(Track& track, const Vector3& place_W, const Vector3& p_WB, MonotonicTime now) noexcept {
  const double dt_s = seconds(now - track.seen);
  const Vector3 expected_W = at_W(track, now);
  const Vector3 residual = place_W - expected_W;
  const double gain = track.sightings == 1 ? 1.0 : kVelocityGain;
  track.v_W = at_most(track.v_W + (gain / dt_s) * residual, kFastest_mps);
  track.p_W = expected_W + (track.sightings == 1 ? 1.0 : kPositionGain) * residual;
  track.seen = now;
  track.behind_W = behind(place_W, p_WB);
  ++track.sightings;
  if (is_sure(track, now)) track.moved = now;
}

void BodyTracks::follow(MonotonicTime now, const Vector3& p_WB,
                        std::span<const stages::CloudPoint> points) noexcept {
  for (Track& track : track_) {
    if (track.seen >= now || !is_followed(track, now)) continue;
    const auto middle_W = surface_middle_W(at_W(track, now), points);
    if (middle_W) see(track, *middle_W, p_WB, now);
  }
}

bool BodyTracks::near(MonotonicTime now, const Vector3& p_WB, const Vector3& v_WB,
                      double reach_m) const noexcept {
  constexpr double kStanding_mps = 0.5;
  return std::any_of(track_.begin(), track_.end(), [&](const Track& track) {
    const Vector3 way = at_W(track, now) - p_WB;
    const bool behind = way.dot(v_WB) < 0.0 && v_WB.norm() > kStanding_mps;
    return is_sure(track, now) && !behind && way.norm() < reach_m;
  });
}

std::size_t BodyTracks::count(MonotonicTime now) const noexcept {
  return static_cast<std::size_t>(
      std::count_if(track_.begin(), track_.end(), [now](const Track& track) { return is_sure(track, now); }));
}

double BodyTracks::Meeting::score() const noexcept {
  constexpr double kTouchesNot = 1000.0, kStands = 100.0, kOwnStand_mps = 0.2;
  if (near_s == kNever) return kNever;
  if (touch_s == kNever) return kTouchesNot + near_s;
  return touch_s + (own_mps < kOwnStand_mps ? kStands : 0.0);
}

BodyTracks::Meeting BodyTracks::meets(const Trajectory& trajectory, MonotonicTime from, double radius_m,
                                      double body_m) const noexcept {
  Meeting meeting;
  std::array<double, kMost> before_m{};
  before_m.fill(kNever);
  for (int i = 0; static_cast<double>(i) * kStep_s <= kHorizon_s; ++i) {
    const double t_s = static_cast<double>(i) * kStep_s;
    const MonotonicTime time = from + from_seconds(t_s);
    const TrajectoryPoint at = trajectory.at(time);
    for (std::size_t k = 0; k < kMost; ++k) {
      const Track& track = track_[k];
      if (!is_sure(track, from)) continue;
      const Vector3 way = at_W(track, time) + track.behind_W - at.p_W;
      const double distance_m = level_m(way);
      const bool nearer = distance_m < before_m[k];
      before_m[k] = distance_m;
      // The first look has nothing to compare with: the second one says whether they part.
      if (i == 0 || !nearer || std::fabs(way.z()) > kHeight_m) continue;
      const double grows_mps =
          std::clamp(kGrowsBySightings_mps / track.sightings, kGrows_mps, kGrowsAtFirst_mps);
      const double bound_m = radius_m + kBodyReach_m + grows_mps * seconds(time - track.seen);
      if (distance_m < bound_m && meeting.near_s == kNever) meeting.near_s = t_s;
      if (distance_m >= body_m + kTouch_m) continue;
      meeting.touch_s = t_s;
      meeting.own_mps =
          distance_m > 0.0 ? (at.v_W.x() * way.x() + at.v_W.y() * way.y()) / distance_m : level_m(at.v_W);
      return meeting;
    }
  }
  return meeting;
}

}  // namespace roborun::flight
