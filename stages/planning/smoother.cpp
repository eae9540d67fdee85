#include "stages/planning/smoother.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace roborun::stages {
namespace {

constexpr double kAtRest = 0.05;  // m/s and m/s2
constexpr double kSameWaypoint_m = 0.25;
constexpr double kLeastPiece_m = 0.03;
constexpr double kMinSegment_s = 0.15;
constexpr double kCruisePiece_m = 5.0;
// Of the acceleration limit: the curve around the profile needs the rest.
constexpr double kProfileShare = 0.60;
constexpr double kCornerCut_m = 0.3;  // how far a corner may be cut: the planner leaves about so much room
constexpr double kLimitTolerance = 1.05;
constexpr int kSamples = 12;  // per segment, for the limits
constexpr int kStretchRounds = 10;
constexpr int kSplitRounds = 6;
constexpr int kSlowRounds = 4;
constexpr double kMaxStart_mps = 50.0;  // a state that is faster is no state of this vehicle

/// The speed limit along a way that climbs or descends: its vertical part keeps that limit, too.
double limit_along_mps(const Vector3& way, double length_m, const MotionLimits& limits) noexcept {
  const double vertical_mps = way.z() > 0.0 ? limits.climb_mps : limits.descent_mps;
  const double rise_m = std::fabs(way.z());
  return rise_m * limits.speed_mps > vertical_mps * length_m ? vertical_mps * length_m / rise_m
                                                             : limits.speed_mps;
}

/// Distance needed to change between two speeds: v1^2 = v0^2 + 2 a s.
double change_m(double from_mps, double to_mps, double a_mps2) noexcept {
  return std::fabs(to_mps * to_mps - from_mps * from_mps) / (2.0 * a_mps2);
}

/// The speed at which an arc that cuts the corner by kCornerCut_m needs no more than a_mps2 across. With h half
/// the turn, an arc of radius r leaves the corner by r (1 / cos h - 1), and v^2 = a r; so
///   v^2 = a cut cos h / (1 - cos h)
/// Straight on: +infinity.
double corner_speed_mps(const Vector3& before, const Vector3& after, double a_mps2) noexcept {
  const double cosine = std::clamp(before.normalized().dot(after.normalized()), -1.0, 1.0);
  const double half = std::sqrt(0.5 * (1.0 + cosine));  // cosine of half the turn
  if (half > 0.9999) return std::numeric_limits<double>::infinity();
  return std::sqrt(a_mps2 * kCornerCut_m * half / (1.0 - half));
}

/// The most of a segment: squares, whose roots are taken once.
struct Motion {
  double speed2{}, acceleration2{}, jerk2{};
  double climb_mps{}, descent_mps{};
};

/// Raises what is most to what is at one instant.
void add_motion(const PolynomialSegment& segment, double at_s, Motion& most) noexcept {
  Vector3 v_W = Vector3::Zero();
  Vector3 a_W = Vector3::Zero();
  Vector3 half_j_W = Vector3::Zero();
  for (std::size_t k = PolynomialSegment::kCoefficients; k-- > 1;) {
    half_j_W = half_j_W * at_s + a_W;
    a_W = a_W * at_s + v_W;
    v_W = v_W * at_s + static_cast<double>(k) * segment.coefficient[k];
  }
  most.speed2 = std::max(most.speed2, v_W.squaredNorm());
  most.acceleration2 = std::max(most.acceleration2, a_W.squaredNorm());
  most.jerk2 = std::max(most.jerk2, 4.0 * half_j_W.squaredNorm());
  most.climb_mps = std::max(most.climb_mps, v_W.z());
  most.descent_mps = std::max(most.descent_mps, -v_W.z());
}

bool is_well_posed(const SmoothRequest& request) noexcept {
  return is_finite(request.start) && request.limits.validate() == Status::kOk && request.radius_m > 0.0 &&
         request.start.v_W.norm() <= kMaxStart_mps;
}

/// In narrow places: without this point, near the one before, the straight line to the next is blocked.
bool is_needed(const MapView& view, const SmoothRequest& request, const Vector3& before_W, std::size_t i,
               std::uint64_t& lookups) noexcept {
  return i + 1 < request.path_W.size() && (request.path_W[i] - before_W).norm() > kLeastPiece_m &&
         is_finite(request.path_W[i + 1]) &&
         !is_segment_free(view, before_W, request.path_W[i + 1], request.radius_m, lookups);
}

using Speeds = std::array<double, MinimumSnap::kMaxKnots>;

/// Steps 1 and 2 of allocate(): the highest speed at each point of the path from which every later corner, and
/// the stop at the end, can still be braked for: v_i^2 <= v_(i+1)^2 + 2 a length.
void limit_speeds(std::span<const Vector3> path_W, const TrajectoryPoint& start, const MotionLimits& limits,
                  double a_mps2, Speeds& speed_mps) noexcept {
  const std::size_t n = path_W.size();
  const Vector3 first = (path_W[1] - path_W[0]).normalized();
  speed_mps[0] = std::max(start.v_W.dot(first), 0.0);
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const Vector3 before = path_W[i] - path_W[i - 1];
    const Vector3 after = path_W[i + 1] - path_W[i];
    speed_mps[i] =
        std::min({limit_along_mps(before, before.norm(), limits),
                  limit_along_mps(after, after.norm(), limits), corner_speed_mps(before, after, a_mps2)});
  }
  speed_mps[n - 1] = 0.0;
  for (std::size_t i = n - 1; i-- > 1;) {
    const double length_m = (path_W[i + 1] - path_W[i]).norm();
    speed_mps[i] =
        std::min(speed_mps[i], std::sqrt(speed_mps[i + 1] * speed_mps[i + 1] + 2.0 * a_mps2 * length_m));
  }
}

}  // namespace

/// The trapezoidal speed profile of one straight piece: up to a peak, cruise, down.
struct Smoother::SpeedProfile {
  double up_m, cruise_m, down_m;
  double up_s, cruise_s, down_s;

  /// Without a limit, up and down meet where (peak^2 - v0^2) / 2a + (peak^2 - v1^2) / 2a = length, that is
  /// at peak^2 = a length + (v0^2 + v1^2) / 2. Times are distances over mean speeds.
  SpeedProfile(double length_m, double v0, double v1, double limit_mps, double a_mps2) noexcept {
    const double peak = std::max(
        {std::min(limit_mps, std::sqrt(std::max(a_mps2 * length_m + 0.5 * (v0 * v0 + v1 * v1), 0.0))), v1,
         0.05});
    up_m = std::min(change_m(v0, peak, a_mps2), length_m);
    down_m = std::min(change_m(peak, v1, a_mps2), length_m - up_m);
    cruise_m = std::max(length_m - up_m - down_m, 0.0);
    up_s = 2.0 * up_m / (v0 + peak);
    cruise_s = cruise_m / peak;
    down_s = 2.0 * down_m / (peak + v1);
  }
};

bool Smoother::Plan::add(const Vector3& p_W, double duration_s) noexcept {
  if (count == kMaxKnots) return false;
  knot_W[count] = p_W;
  time_s[count++] = std::max(duration_s, kMinSegment_s);
  return true;
}

/// Step 4 of allocate(): knots where the speed profile bends, if the pieces are long enough to be worth one.
bool Smoother::Plan::add_piece(const Vector3& from_W, const Vector3& to_W, const SpeedProfile& p,
                               bool last) noexcept {
  const Vector3 way = to_W - from_W;
  const double length_m = way.norm();
  double pending_s = p.up_s;  // since the last knot
  if (p.up_m > 1.5 && p.cruise_m + p.down_m > 1.5) {
    if (!add(from_W + way * (p.up_m / length_m), p.up_s)) return false;
    pending_s = 0.0;
    // Long cruises are held by way-points: a single polynomial would sag between its ends.
    const int pieces = std::min(static_cast<int>(p.cruise_m / kCruisePiece_m), 6);
    for (int k = 1; k <= pieces; ++k) {
      const double share = static_cast<double>(k) / (pieces + 1);
      if (!add(from_W + way * ((p.up_m + share * p.cruise_m) / length_m), p.cruise_s / (pieces + 1)))
        return false;
    }
    pending_s += p.cruise_s / (pieces + 1);
  } else {
    pending_s += p.cruise_s;
  }
  // Where braking begins. The final braking is worth a knot sooner: the tail is flown when a decision is late.
  if (p.down_m > (last ? 0.3 : 1.5) && p.cruise_m + p.up_m > 1.0 && pending_s > kMinSegment_s &&
      (p.cruise_m > 0.3 || pending_s > p.cruise_s)) {
    if (!add(from_W + way * ((p.up_m + p.cruise_m) / length_m), pending_s)) return false;
    pending_s = 0.0;
  }
  if (last) brake_knot = count - 1;
  return add(to_W, pending_s + p.down_s);
}

/// Times for the path under the limits:
///  1. the speed at each corner,
///  2. backwards: no faster than what can be braked to the next point's speed,
///  3. forwards: no faster than what can be reached from the point before,
///  4. between them a trapezoidal profile, with knots where it bends.
bool Smoother::allocate(std::span<const Vector3> path_W, const TrajectoryPoint& start,
                        const MotionLimits& limits, Plan& plan) noexcept {
  const std::size_t n = path_W.size();
  const double a_mps2 = kProfileShare * limits.acceleration_mps2;
  Speeds speed_mps{};
  limit_speeds(path_W, start, limits, a_mps2, speed_mps);
  plan.count = 0;
  if (!plan.add(path_W[0], 0.0)) return false;
  for (std::size_t i = 0; i + 1 < n; ++i) {
    const double length_m = (path_W[i + 1] - path_W[i]).norm();
    const double v0 = speed_mps[i];
    speed_mps[i + 1] = std::min(speed_mps[i + 1], std::sqrt(v0 * v0 + 2.0 * a_mps2 * length_m));
    const double limit_mps = limit_along_mps(path_W[i + 1] - path_W[i], length_m, limits);
    const SpeedProfile profile(length_m, v0, speed_mps[i + 1], limit_mps, a_mps2);
    if (!plan.add_piece(path_W[i], path_W[i + 1], profile, i + 2 == n)) return false;
  }
  return true;
}

bool Smoother::solve(const Plan& plan, const TrajectoryPoint& start, Trajectory& out) const noexcept {
  if (!minimum_snap_.solve({plan.knot_W.data(), plan.count}, {plan.time_s.data(), plan.count}, start, out))
    return false;
  out.brake_begin_s = 0.0;
  for (std::size_t k = 0; k < plan.brake_knot; ++k) out.brake_begin_s += plan.time_s[k + 1];
  return true;
}

bool Smoother::stretch_to_limits(const Task& task, const MotionLimits& limits, Plan& plan,
                                 Trajectory& out) const noexcept {
  const SmoothRequest& request = task.request;
  const double speed_limit = std::max(limits.speed_mps * kLimitTolerance, request.start.v_W.norm() + 0.01);
  const double acceleration_limit =
      std::max(limits.acceleration_mps2 * kLimitTolerance, request.start.a_W.norm() + 0.01);
  const double climb_limit = std::max(limits.climb_mps * kLimitTolerance, request.start.v_W.z() + 0.01);
  const double descent_limit = std::max(limits.descent_mps * kLimitTolerance, 0.01 - request.start.v_W.z());
  const double jerk_limit = std::max(limits.jerk_mps3 * kLimitTolerance, request.start.j_W.norm() + 0.01);
  for (int round = 0; round < kStretchRounds && !task.budget.spent(task.work); ++round) {
    if (!solve(plan, request.start, out)) return false;
    bool fine = true;
    for (std::size_t k = 0; k < out.segment_count; ++k) {
      Motion most;
      for (int i = 0; i <= kSamples; ++i)
        add_motion(out.segment[k], out.segment[k].duration_s * i / kSamples, most);
      // A time that is k times as long divides speed by k, acceleration by k^2 and jerk by k^3. The cube root
      // of the jerk's excess is near enough to its power 3/8, which square roots can make.
      const double jerk_root = std::sqrt(std::sqrt(std::sqrt(std::sqrt(most.jerk2) / jerk_limit)));
      const double worst = std::max({1.0, std::sqrt(most.speed2) / speed_limit,
                                     std::sqrt(std::sqrt(most.acceleration2) / acceleration_limit),
                                     jerk_root * jerk_root * jerk_root, most.climb_mps / climb_limit,
                                     most.descent_mps / descent_limit});
      if (worst > 1.0) {
        fine = false;
        plan.time_s[k + 1] *= std::min(1.0 + 1.1 * (worst - 1.0) + 0.02, 1.5);
      }
    }
    if (fine) return true;
  }
  return false;
}

bool Smoother::split(const Plan& plan, std::size_t segment, Path& path_W) noexcept {
  const Vector3 middle_W = 0.5 * (plan.knot_W[segment] + plan.knot_W[segment + 1]);
  std::size_t piece = 0;
  double nearest_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + 1 < path_W.size(); ++i) {
    const Vector3 way = path_W[i + 1] - path_W[i];
    const double along = std::clamp((middle_W - path_W[i]).dot(way) / way.squaredNorm(), 0.0, 1.0);
    const double distance_m = (path_W[i] + along * way - middle_W).norm();
    if (distance_m < nearest_m) {
      nearest_m = distance_m;
      piece = i;
    }
  }
  if ((path_W[piece + 1] - path_W[piece]).norm() < 4.0 * kSameWaypoint_m) return false;
  Path finer;
  bool fits = true;
  for (std::size_t i = 0; i < path_W.size(); ++i) {
    fits = finer.push_back(path_W[i]) && fits;
    if (i == piece) fits = finer.push_back(0.5 * (path_W[i] + path_W[i + 1])) && fits;
  }
  if (fits) path_W = finer;
  return fits;
}

Status Smoother::curve(const Task& task, const Path& path_W, const MotionLimits& limits,
                       Trajectory& out) const noexcept {
  Path path = path_W;
  Plan plan;
  for (int round = 0; round <= kSplitRounds; ++round) {
    if (task.budget.spent(task.work)) return Status::kBudgetSpent;
    if (!allocate({path.begin(), path.size()}, task.request.start, limits, plan)) return Status::kNoPath;
    if (!stretch_to_limits(task, limits, plan, out)) return Status::kNoPath;
    std::size_t bad = 0;
    if (is_trajectory_free(task.view, out, 0.0, task.request.radius_m, task.work.units, &bad))
      return Status::kOk;
    if (!split(plan, bad, path)) return Status::kNoPath;
  }
  return Status::kNoPath;
}

Status Smoother::straight_pieces(const Task& task, const Path& path_W, Trajectory& out) noexcept {
  const SmoothRequest& request = task.request;
  if (request.start.v_W.norm() > kAtRest || request.start.a_W.norm() > kAtRest) return Status::kNoPath;
  out.segment_count = 0;
  for (std::size_t i = 0; i + 1 < path_W.size(); ++i) {
    if (!append_rest_to_rest(path_W[i], path_W[i + 1], request.limits, out)) return Status::kNoPath;
  }
  if (is_trajectory_free(task.view, out, 0.0, request.radius_m, task.work.units)) return Status::kOk;
  return task.view.spent() ? Status::kBudgetSpent : Status::kNoPath;
}

Status Smoother::smooth(const SmoothRequest& request, const MapView& map, core::StageBudget& budget,
                        SmoothResult& result) noexcept {
  // 1. The path from the start state on, without points that stand for the same place.
  result.work = {};
  if (!is_well_posed(request)) return Status::kInvalidArgument;
  const PolledView view(map, budget, result.work);
  Path path;
  for (std::size_t i = 0; i < request.path_W.size(); ++i) {
    const Vector3& p_W = request.path_W[i];
    if (!is_finite(p_W)) return Status::kInvalidArgument;
    if (!path.empty() && (p_W - path.back()).norm() < kSameWaypoint_m &&
        !is_needed(view, request, path.back(), i, result.work.units))
      continue;
    if (!path.push_back(path.empty() ? request.start.p_W : p_W)) break;
  }
  if (path.size() < 2) return Status::kInvalidArgument;

  // 2. A curve; slower if there is none.
  const Task task{request, view, budget, result.work};
  MotionLimits limits = request.limits;
  Trajectory candidate;
  candidate.start_time = request.start_time;
  for (int slow = 0; slow < kSlowRounds; ++slow, limits.speed_mps *= 0.6) {
    const Status status = curve(task, path, limits, candidate);
    if (status == Status::kBudgetSpent) return status;
    if (status != Status::kOk) continue;
    result.trajectory = candidate;
    return Status::kOk;
  }
  if (budget.spent(result.work)) return Status::kBudgetSpent;

  // 3. The last resort.
  const Status status = straight_pieces(task, path, candidate);
  if (status == Status::kOk) result.trajectory = candidate;
  return status;
}

Status Smoother::brake(const TrajectoryPoint& start, MonotonicTime start_time, const MotionLimits& limits,
                       Trajectory& out) const noexcept {
  const double speed_mps = start.v_W.norm();
  if (!is_finite(start) || speed_mps > kMaxStart_mps || !(limits.acceleration_mps2 > 0.0))
    return Status::kInvalidArgument;
  if (speed_mps < 0.02) {
    out = Trajectory::hold(start.p_W, start_time);
    return Status::kOk;
  }
  // Acceleration goes straight to its limit against the motion, stays there, and goes straight to zero.
  const double ramp_in_s = (start.a_W.norm() + limits.acceleration_mps2) / limits.jerk_mps3;
  const double ramp_out_s = limits.acceleration_mps2 / limits.jerk_mps3;
  const Vector3 to_lose = start.v_W + 0.5 * ramp_in_s * start.a_W;
  const double ramps_s = 0.5 * (ramp_in_s + ramp_out_s);
  const double braking_mps2 = std::min(limits.acceleration_mps2, to_lose.norm() / ramps_s);
  const double hold_s = std::max(to_lose.norm() / limits.acceleration_mps2 - ramps_s, 0.0);
  const Vector3 a_W = braking_mps2 > 0.0 ? Vector3(-braking_mps2 * to_lose.normalized()) : Vector3::Zero();
  const Vector3 none = Vector3::Zero();
  Trajectory stop;
  stop.start_time = start_time;
  TrajectoryPoint at = start;
  for (const auto& [time_s, end_a_W] :
       {std::pair{ramp_in_s, a_W}, std::pair{hold_s, a_W}, std::pair{ramp_out_s, none}}) {
    PolynomialSegment& segment = stop.segment[stop.segment_count++];
    const Vector3 jerk = time_s > 0.0 ? Vector3((end_a_W - at.a_W) / time_s) : none;
    segment.duration_s = time_s;
    segment.coefficient[0] = at.p_W;
    segment.coefficient[1] = at.v_W;
    segment.coefficient[2] = 0.5 * at.a_W;
    segment.coefficient[3] = jerk / 6.0;
    at.p_W += time_s * (at.v_W + time_s * (0.5 * at.a_W + time_s / 6.0 * jerk));
    at.v_W += time_s * (at.a_W + 0.5 * time_s * jerk);
    at.a_W = end_a_W;
  }
  out = stop;
  return Status::kOk;
}

bool append_rest_to_rest(const Vector3& from_W, const Vector3& to_W, const MotionLimits& limits,
                         Trajectory& trajectory) noexcept {
  if (trajectory.segment_count == Trajectory::kMaxSegments) return false;
  // The polynomial of degree 9 from 0 to 1 with four derivatives zero at both ends, its greatest speed,
  // acceleration and jerk. Without a limit on jerk, short hops ask for attitudes that the vehicle overshoots.
  constexpr std::array<double, 5> kRatio{126.0, -420.0, 540.0, -315.0, 70.0};
  constexpr double kPeakSpeed = 2.4609;
  constexpr double kPeakAcceleration = 9.3723;
  constexpr double kPeakJerk = 78.75;
  const Vector3 way = to_W - from_W;
  const double length_m = way.norm();
  const double before_s = trajectory.duration_s();
  PolynomialSegment& segment = trajectory.segment[trajectory.segment_count++];
  segment = {};
  segment.duration_s = std::max({kPeakSpeed * length_m / limit_along_mps(way, length_m, limits),
                                 std::sqrt(kPeakAcceleration * length_m / limits.acceleration_mps2), 0.1});
  for (int i = 0; i < 32; ++i) {
    const double cubed = segment.duration_s * segment.duration_s * segment.duration_s;
    if (kPeakJerk * length_m <= limits.jerk_mps3 * cubed) break;
    segment.duration_s *= 1.1;
  }
  segment.coefficient[0] = from_W;
  const double T = segment.duration_s;
  double power = T * T * T * T;
  for (std::size_t i = 0; i < kRatio.size(); ++i) {
    power *= T;
    segment.coefficient[5 + i] = kRatio[i] / power * way;
  }
  trajectory.brake_begin_s = before_s + 0.5 * T;
  return true;
}

namespace {

/// Of the curve between two times, along a chord. Around a slanting chord there is more than the vehicle touches, around
/// parts of it there is less.
bool is_chord_free(const MapView& view, const Trajectory& trajectory, double from_s, double to_s,
                   double radius_m, std::uint64_t& lookups) noexcept {
  constexpr int kParts = 8;
  const Vector3 r = Vector3::Constant(radius_m);
  const auto is_swept_free = [&](const Vector3& a_W, const Vector3& b_W) {
    return view.is_free({a_W.cwiseMin(b_W) - r, a_W.cwiseMax(b_W) + r}, lookups);
  };
  Vector3 last_W = trajectory.at_s(from_s).p_W;
  if (is_swept_free(last_W, trajectory.at_s(to_s).p_W)) return true;
  for (int part = 1; part <= kParts; ++part) {
    const Vector3 p_W = trajectory.at_s(from_s + (to_s - from_s) * part / kParts).p_W;
    if (!is_swept_free(last_W, p_W)) return false;
    last_W = p_W;
  }
  return true;
}

}  // namespace

double free_until_s(const MapView& view, const Trajectory& trajectory, double from_s, double radius_m,
                    std::uint64_t& lookups, std::size_t* segment) noexcept {
  constexpr double kForEver = std::numeric_limits<double>::infinity();
  const double start_s = from_s > 0.0 ? from_s : 0.0;
  if (trajectory.segment_count == 0)
    return view.is_free(Aabb::around(trajectory.hold_W, radius_m), lookups) ? kForEver : start_s;
  double segment_begin_s = 0.0;
  for (std::size_t k = 0; k < trajectory.segment_count; ++k) {
    const double duration_s = trajectory.segment[k].duration_s;
    const double first_s = std::max(start_s - segment_begin_s, 0.0);
    if (first_s <= duration_s) {
      // Chords of about the vehicle's radius; at 6 m/s the curve leaves such a chord by less than 2 cm.
      const Vector3 from_W = trajectory.at_s(segment_begin_s + first_s).p_W;
      const double length_m = (trajectory.at_s(segment_begin_s + duration_s).p_W - from_W).norm() + 0.1;
      const int count = std::clamp(static_cast<int>(2.0 * length_m / radius_m), 6, 200);
      const double step_s = (duration_s - first_s) / count;
      for (int i = 0; i < count; ++i) {
        const double at_s = segment_begin_s + first_s + i * step_s;
        if (is_chord_free(view, trajectory, at_s, at_s + step_s, radius_m, lookups)) continue;
        if (segment != nullptr) *segment = k;
        return at_s;
      }
    }
    segment_begin_s += duration_s;
  }
  return kForEver;
}

}  // namespace roborun::stages
