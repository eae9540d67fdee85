#include "stages/planning/smoother.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/memory/static_vector.hpp"
#include "stages/perception/swept_ball.hpp"
#include "stages/planning/curve.hpp"

namespace roborun::stages {
namespace {

constexpr double kAtRest = 1e-6;  // m/s and m/s2
constexpr double kSameWaypoint_m = 0.25;
constexpr double kLeastPiece_m = 0.03;
constexpr double kPieceTime_s = 0.15;   // of a chord: at 4 m/s2 the curve leaves it by 1.1 cm
constexpr double kMaxStart_mps = 50.0;  // a state that is faster is no state of this vehicle

/// The speed limit along a way that climbs or descends: its vertical part keeps that limit, too.
double limit_along_mps(const Vector3& way, double length_m, const MotionLimits& limits) noexcept {
  const double vertical_mps = way.z() > 0.0 ? limits.climb_mps : limits.descent_mps;
  const double rise_m = std::fabs(way.z());
  return rise_m * limits.speed_mps > vertical_mps * length_m ? vertical_mps * length_m / rise_m
                                                             : limits.speed_mps;
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

Vector3 position_W(const PolynomialSegment& segment, double at_s) noexcept {
  Vector3 p_W = Vector3::Zero();
  for (std::size_t k = PolynomialSegment::kCoefficients; k-- > 0;) p_W = p_W * at_s + segment.coefficient[k];
  return p_W;
}

/// What a turn may take of the room at its corner, one after the other; at last a stop.
constexpr std::array<double, 5> kShares{1.0, 0.6, 0.3, 0.1, 0.0};

/// How the start state is left, one after the other: without the first corner (if it is near) or with it, and the share of
/// the speed that the first change may lead to. 0: a stop.
struct Departure {
  bool skips;
  double share;
};
constexpr std::array<Departure, 7> kDepartures{
    {{true, 1.0}, {false, 1.0}, {false, 0.6}, {false, 0.3}, {true, 0.5}, {false, 0.0}, {true, 0.0}}};

/// How the path is flown, and what is tried next.
class Tries {
 public:
  Tries(std::span<const Vector3> path_W, const TrajectoryPoint& start, const MotionLimits& limits) noexcept
      : path_W_(path_W),
        moves_(start.v_W.norm() > kAtRest || start.a_W.norm() > kAtRest),
        last_(path_W.size()) {
    const double stop_m = change_m(start.v_W.norm(), 0.0, {limits.acceleration_mps2, limits.jerk_mps3});
    if (last_ < 3 || (path_W[1] - path_W[0]).norm() > stop_m) departure_ = 1;
  }

  [[nodiscard]] Course course() const noexcept {
    Course course;
    const std::size_t skipped = skips() ? 1 : 0;
    for (std::size_t i = 0; i + skipped < last_; ++i) {
      (void)course.point_W.push_back(path_W_[i == 0 ? 0 : i + skipped]);
      course.share[i] = kShares[tighter_[i == 0 ? 0 : i + skipped]];
    }
    course.start_share = moves_ ? kDepartures[departure_].share : 1.0;
    return course;
  }
  /// After a course of which this part is not free. False: that was all.
  [[nodiscard]] bool next_after(std::size_t part) noexcept {
    const std::size_t i = part / 2 + (skips() ? 1 : 0);
    // Straight pieces are the path's own: no other turn makes them free.
    if (part == 0 || part % 2 == 1 || tighter_[i] + 1 == kShares.size()) return leave_otherwise(false);
    ++tighter_[i];
    return true;
  }
  /// `too_fast`: no speed leads from the start state to the first corner.
  [[nodiscard]] bool leave_otherwise(bool too_fast) noexcept {
    if (!moves_) return false;
    left_otherwise_ = true;
    const Departure before = kDepartures[departure_];
    do {
      if (++departure_ == kDepartures.size()) return false;
    } while (
        (kDepartures[departure_].skips && last_ < 3) ||
        (too_fast && kDepartures[departure_].share > 0.0 && kDepartures[departure_].skips == before.skips));
    return true;
  }
  /// Since it was asked last.
  [[nodiscard]] bool has_left_otherwise() noexcept { return std::exchange(left_otherwise_, false); }
  /// False: there is only one piece left.
  [[nodiscard]] bool shorten() noexcept { return --last_ >= (skips() ? 3U : 2U); }

 private:
  [[nodiscard]] bool skips() const noexcept { return moves_ && kDepartures[departure_].skips; }

  std::span<const Vector3> path_W_;
  bool moves_, left_otherwise_{false};
  std::size_t last_;  ///< Points that are flown.
  std::size_t departure_{0};
  std::array<std::size_t, Smoother::kMaxPoints> tighter_{};  ///< By point: index into kShares.
};

/// The chords of a segment that keep free, from `first_s` of it on. `at_s`: where one does not.
bool is_rest_free(const MapView& view, const PolynomialSegment& segment, double first_s, double radius_m,
                  std::uint64_t& lookups, double& at_s) noexcept;

/// The straight pieces of the course, as whoever found the path checks them. Where the box along a piece touches what is not free
/// at two corners, as paths over a lattice do, the box around another chord across that place does not fit; the ball does, if what is
/// not free are whole cells of the view.
class StraightPieces {
 public:
  StraightPieces(const Course& course, double radius_m) noexcept : course_(course), radius_m_(radius_m) {}
  /// True if from .. to is what is flown of this part, on a piece of the course that is free.
  [[nodiscard]] bool is_free(const MapView& view, std::size_t part, const Vector3& from_W,
                             const Vector3& to_W, std::uint64_t& lookups) const noexcept {
    if (part % 2 == 0) return false;
    const Vector3& a_W = course_.point_W[part / 2];
    const Vector3& b_W = course_.point_W[part / 2 + 1];
    return is_between(from_W, a_W, b_W) && is_between(to_W, a_W, b_W) &&
           is_segment_free(view, a_W, b_W, radius_m_, lookups);
  }

 private:
  static bool is_between(const Vector3& p_W, const Vector3& a_W, const Vector3& b_W) noexcept {
    constexpr double kRounding_m = 1e-7;  // the first piece after a change begins beside it
    const Vector3 way = b_W - a_W;
    const double share = std::clamp((p_W - a_W).dot(way) / way.squaredNorm(), 0.0, 1.0);
    return (p_W - a_W - share * way).norm() <= kRounding_m;
  }

  const Course& course_;
  double radius_m_;
};

/// Remembers which parts of the curve before were free: from one to the next, most are the same.
class CheckedParts {
 public:
  /// The first part that is not free, or none.
  [[nodiscard]] std::optional<std::size_t> find_blocked(const MapView& view, const Trajectory& trajectory,
                                                        const SegmentParts& part,
                                                        const StraightPieces& straight, double radius_m,
                                                        std::uint64_t& lookups) noexcept {
    std::size_t end = 0;
    for (std::size_t first = 0; first < trajectory.segment_count; first = end) {
      for (end = first; end < trajectory.segment_count && part[end] == part[first];) ++end;
      const Vector3& begin_W = trajectory.segment[first].coefficient[0];
      const PolynomialSegment& last = trajectory.segment[end - 1];
      const Ends ends{begin_W, position_W(last, last.duration_s), true};
      Ends& before = free_[part[first]];
      if (before.known && before.begin_W == ends.begin_W && before.end_W == ends.end_W) continue;
      before.known = false;
      double at_s = 0.0;
      bool is_free = true;
      for (std::size_t k = first; k < end && is_free; ++k)
        is_free = is_rest_free(view, trajectory.segment[k], 0.0, radius_m, lookups, at_s);
      if (!is_free && !straight.is_free(view, part[first], ends.begin_W, ends.end_W, lookups))
        return part[first];
      before = ends;
    }
    return std::nullopt;
  }
  /// Points have other numbers now.
  void forget() noexcept { free_ = {}; }

 private:
  struct Ends {
    Vector3 begin_W = Vector3::Zero(), end_W = Vector3::Zero();
    bool known{};
  };
  std::array<Ends, 2 * Smoother::kMaxPoints> free_{};
};

}  // namespace

Status Smoother::smooth(const SmoothRequest& request, const MapView& map, core::StageBudget& budget,
                        SmoothResult& result) noexcept {
  // 1. The path from the start state on, without points that stand for the same place.
  result.work = {};
  if (!is_well_posed(request)) return Status::kInvalidArgument;
  const PolledView view(map, budget, result.work);
  core::StaticVector<Vector3, kMaxPoints> path_W;
  for (std::size_t i = 0; i < request.path_W.size(); ++i) {
    const Vector3& p_W = request.path_W[i];
    if (!is_finite(p_W)) return Status::kInvalidArgument;
    if (!path_W.empty() && (p_W - path_W.back()).norm() < kSameWaypoint_m &&
        !is_needed(view, request, path_W.back(), i, result.work.units))
      continue;
    if (!path_W.push_back(path_W.empty() ? request.start.p_W : p_W)) break;
  }
  if (path_W.size() < 2) return Status::kInvalidArgument;

  // 2. A curve; tighter where it is not free.
  Tries tries({path_W.begin(), path_W.size()}, request.start, request.limits);
  CheckedParts checked;
  Trajectory candidate;
  candidate.start_time = request.start_time;
  for (int round = 0; round < kRounds; ++round) {
    if (budget.spent(result.work)) return Status::kBudgetSpent;
    SegmentParts part{};
    const Course course = tries.course();
    const CurveFit fit = fit_curve(course, request.start, request.limits, candidate, part);
    bool goes_on = false;
    if (fit == CurveFit::kOk) {
      const auto blocked =
          checked.find_blocked(view, candidate, part, StraightPieces(course, request.radius_m),
                               request.radius_m, result.work.units);
      if (!blocked) {
        result.trajectory = candidate;
        return Status::kOk;
      }
      if (view.spent()) return Status::kBudgetSpent;
      goes_on = tries.next_after(*blocked);
    } else {
      goes_on = fit == CurveFit::kTooManyPoints ? tries.shorten() : tries.leave_otherwise(true);
    }
    if (!goes_on) return Status::kNoPath;
    if (tries.has_left_otherwise()) checked.forget();
  }
  return Status::kNoPath;
}

namespace {

/// Acceleration goes straight to a_W, stays there, and goes straight to zero.
struct StopProfile {
  Vector3 a_W = Vector3::Zero();
  double ramp_in_s{}, hold_s{}, ramp_out_s{};
};

/// After a first ramp of this time the velocity that is left is L long. With deceleration b, jerk j and the limit not reached,
/// b (ramp_in + b/j) / 2 = L.
StopProfile stop_after(double ramp_in_s, const TrajectoryPoint& start, const MotionLimits& limits) noexcept {
  const double j = limits.jerk_mps3;
  const Vector3 left_W = start.v_W + 0.5 * ramp_in_s * start.a_W;
  const double left_mps = left_W.norm();
  if (!(left_mps > 0.0)) return {.ramp_in_s = ramp_in_s};
  const double b_mps2 =
      std::min(4.0 * left_mps / (ramp_in_s + std::sqrt(ramp_in_s * ramp_in_s + 8.0 * left_mps / j)),
               limits.acceleration_mps2);
  return {-b_mps2 / left_mps * left_W, ramp_in_s,
          std::max(left_mps / b_mps2 - 0.5 * (ramp_in_s + b_mps2 / j), 0.0), b_mps2 / j};
}

/// The shortest first ramp that is within the limit of jerk. One that reaches the limit of acceleration from any direction always is,
/// but where the speed is too low for it, it takes many times as long as the stop needs, and who stops anew with each
/// decision never stands.
StopProfile find_stop(const TrajectoryPoint& start, const MotionLimits& limits) noexcept {
  constexpr int kHalvings = 32;
  double within_s = (start.a_W.norm() + limits.acceleration_mps2) / limits.jerk_mps3, beyond_s = 0.0;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle_s = 0.5 * (within_s + beyond_s);
    const double change_mps2 = (stop_after(middle_s, start, limits).a_W - start.a_W).norm();
    (change_mps2 <= limits.jerk_mps3 * middle_s ? within_s : beyond_s) = middle_s;
  }
  return stop_after(within_s, start, limits);
}

}  // namespace

Status Smoother::brake(const TrajectoryPoint& start, MonotonicTime start_time, const MotionLimits& limits,
                       Trajectory& out) const noexcept {
  const double speed_mps = start.v_W.norm();
  if (!is_finite(start) || speed_mps > kMaxStart_mps || !(limits.acceleration_mps2 > 0.0))
    return Status::kInvalidArgument;
  if (speed_mps < 0.02) {
    out = Trajectory::hold(start.p_W, start_time);
    return Status::kOk;
  }
  const StopProfile profile = find_stop(start, limits);
  const Vector3 none = Vector3::Zero();
  Trajectory stop;
  stop.start_time = start_time;
  TrajectoryPoint at = start;
  for (const auto& [time_s, end_a_W] :
       {std::pair{profile.ramp_in_s, profile.a_W}, std::pair{profile.hold_s, profile.a_W},
        std::pair{profile.ramp_out_s, none}}) {
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

/// Of a segment between two times: the box around its chord, or the ball along parts of it, from which the curve is nowhere apart.
bool is_chord_free(const MapView& view, const PolynomialSegment& segment, double from_s, double to_s,
                   double radius_m, std::uint64_t& lookups) noexcept {
  constexpr int kParts = 8;
  const Vector3 r = Vector3::Constant(radius_m);
  Vector3 last_W = position_W(segment, from_s);
  const Vector3 end_W = position_W(segment, to_s);
  if (view.is_free({last_W.cwiseMin(end_W) - r, last_W.cwiseMax(end_W) + r}, lookups)) return true;
  for (int part = 1; part <= kParts; ++part) {
    const Vector3 p_W = position_W(segment, from_s + (to_s - from_s) * part / kParts);
    if (!is_swept_free(view, last_W, p_W, radius_m, lookups)) return false;
    last_W = p_W;
  }
  return true;
}

bool is_rest_free(const MapView& view, const PolynomialSegment& segment, double first_s, double radius_m,
                  std::uint64_t& lookups, double& at_s) noexcept {
  // Chords of about half the vehicle's radius, or less where it turns slowly.
  const double rest_s = segment.duration_s - first_s;
  const double length_m =
      (position_W(segment, segment.duration_s) - position_W(segment, first_s)).norm() + 0.1;
  const double chords = std::max(2.0 * length_m / radius_m, rest_s / kPieceTime_s);
  const int count = std::clamp(static_cast<int>(chords) + 1, 1, 200);
  const double step_s = rest_s / count;
  for (int i = 0; i < count; ++i) {
    at_s = first_s + i * step_s;
    if (!is_chord_free(view, segment, at_s, at_s + step_s, radius_m, lookups)) return false;
  }
  return true;
}

}  // namespace

double free_until_s(const MapView& view, const Trajectory& trajectory, double from_s, double radius_m,
                    std::uint64_t& lookups) noexcept {
  constexpr double kForEver = std::numeric_limits<double>::infinity();
  const double start_s = from_s > 0.0 ? from_s : 0.0;
  if (trajectory.segment_count == 0)
    return is_ball_free(view, trajectory.hold_W, radius_m, lookups) ? kForEver : start_s;
  double segment_begin_s = 0.0;
  for (std::size_t k = 0; k < trajectory.segment_count; ++k) {
    const double duration_s = trajectory.segment[k].duration_s;
    const double first_s = std::max(start_s - segment_begin_s, 0.0);
    double at_s = 0.0;
    if (first_s <= duration_s && !is_rest_free(view, trajectory.segment[k], first_s, radius_m, lookups, at_s))
      return segment_begin_s + at_s;
    segment_begin_s += duration_s;
  }
  return kForEver;
}

}  // namespace roborun::stages
