#include "stages/planning/curve.hpp"

#include <algorithm>
#include <cmath>

namespace roborun::stages {
namespace {

constexpr double kAtRest = 1e-6;   // m/s and m/s2
constexpr double kShort_s = 1e-9;  // no segment
constexpr double kSlack_m = 1e-9;
constexpr double kHere_m = 0.05;  // a stop that ends so near to the last point has reached it
constexpr int kHalvings = 20;     // of a speed: 6 m/s to 6e-6
constexpr int kBeginHalvings = 10;
// Rounds for the direction after the first change, and how near it comes: while the speed is looked for, and then.
struct Aim {
  int rounds;
  double error;
};
constexpr Aim kRough{12, 1e-4};
constexpr Aim kExact{40, 1e-10};

/// The highest speed up to `most_mps` for which `fits` holds, if it holds for all lower ones. 0 if for none.
template <typename Fits>
double highest_mps(double most_mps, const Fits& fits, int halvings = kHalvings) noexcept {
  if (fits(most_mps)) return most_mps;
  double low = 0.0, high = most_mps;
  for (int i = 0; i < halvings; ++i) {
    const double middle = 0.5 * (low + high);
    (fits(middle) ? low : high) = middle;
  }
  return low;
}

/// The same from `least_mps` on, which fits; that, where it is beyond `most_mps`.
template <typename Fits>
double highest_mps_from(double least_mps, double most_mps, const Fits& fits,
                        int halvings = kHalvings) noexcept {
  return least_mps + highest_mps(
                         std::max(most_mps - least_mps, 0.0),
                         [&](double more_mps) { return fits(least_mps + more_mps); }, halvings);
}

/// A straight piece between two points of the course.
struct Leg {
  Vector3 direction = Vector3::Zero();
  double length_m{};
  double limit_mps{};
  ChangeLimits braking;
  ChangeLimits faster;  ///< Where the speed goes up.
};

/// A corner of the course.
struct Turn {
  double bend{};  ///< Change of direction: the norm of the difference.
  ChangeLimits limits;
  /// What it takes of both legs.
  [[nodiscard]] double way_m(double speed_mps) const noexcept {
    const double delta_mps = speed_mps * bend;
    return delta_mps > 0.0 ? 0.5 * speed_mps * change_s(delta_mps, limits) : 0.0;
  }
};

/// The change at the start, up to where the first leg begins.
struct Beginning {
  Vector3 v_W = Vector3::Zero();
  double speed_mps{};
  Leg leg{};  ///< What is left of the first one.
};

class Fitter {
 public:
  Fitter(const Course& course, const MotionLimits& limits, Trajectory& out, SegmentParts& part) noexcept
      : course_(course),
        limits_(limits),
        faster_mps2_(std::min(limits.acceleration_mps2, limits.speeding_up_mps2)),
        out_(out),
        part_(part) {}

  CurveFit fit(const TrajectoryPoint& start) noexcept;

 private:
  static constexpr std::size_t kMaxPoints = Course::kMaxPoints;

  [[nodiscard]] Leg leg_between(const Vector3& from_W, const Vector3& to_W) const noexcept;
  /// Within `most_mps2`, for a change of velocity along `way`: what is up or down of it keeps the vertical limit.
  [[nodiscard]] ChangeLimits limits_along(const Vector3& way, double most_mps2) const noexcept;
  [[nodiscard]] Turn turn_between(const Vector3& from_direction, const Vector3& to_direction) const noexcept {
    const Vector3 way = to_direction - from_direction;
    return {way.norm(), limits_along(way, limits_.acceleration_mps2)};
  }
  void limit_corners() noexcept;
  /// At corner i, with this turn: no faster than what can be braked to the next point's speed.
  [[nodiscard]] double braked_mps(std::size_t i, const Turn& turn) const noexcept;
  void limit_backwards() noexcept;
  void limit_forwards() noexcept;
  [[nodiscard]] bool begin(const TrajectoryPoint& start) noexcept;
  /// Where the first change to this speed leads. False if the corner after it cannot be flown from there.
  [[nodiscard]] bool leads_on(const TrajectoryPoint& start, double speed_mps, const Aim& aim,
                              Beginning& out) const noexcept;
  [[nodiscard]] ChangeLimits first_change(const TrajectoryPoint& start, const Vector3& v_W) const noexcept;
  [[nodiscard]] bool add(const VelocityChange& change, std::size_t part) noexcept;
  [[nodiscard]] bool add(const VelocityChange::Piece& piece, std::size_t part) noexcept;
  [[nodiscard]] bool add_change(const Vector3& v_W, const ChangeLimits& limits, std::size_t part) noexcept;
  [[nodiscard]] CurveFit add_leg(std::size_t i) noexcept;
  [[nodiscard]] CurveFit add_all() noexcept;

  const Course& course_;
  const MotionLimits& limits_;
  double faster_mps2_;  ///< Where the speed goes up.
  Trajectory& out_;
  SegmentParts& part_;
  TrajectoryPoint at_;  ///< Where the curve is so far.
  double now_s_{};
  std::size_t count_{};  ///< Points.
  Vector3 from_W_ = Vector3::Zero();
  std::array<Leg, kMaxPoints> leg_;
  std::array<Turn, kMaxPoints> turn_;       ///< At the corners.
  std::array<double, kMaxPoints> speed_{};  ///< At the points.
};

ChangeLimits Fitter::limits_along(const Vector3& way, double most_mps2) const noexcept {
  const double rise_m = std::fabs(way.z()), length_m = way.norm();
  if (rise_m * most_mps2 > limits_.vertical_mps2 * length_m)
    most_mps2 = limits_.vertical_mps2 * length_m / rise_m;
  return {most_mps2, limits_.jerk_mps3};
}

Leg Fitter::leg_between(const Vector3& from_W, const Vector3& to_W) const noexcept {
  Leg leg;
  const Vector3 way = to_W - from_W;
  leg.length_m = way.norm();
  leg.direction = leg.length_m > 0.0 ? Vector3(way / leg.length_m) : Vector3::Zero();
  const double vertical_mps = way.z() > 0.0 ? limits_.climb_mps : limits_.descent_mps;
  const double rise = std::fabs(leg.direction.z());
  leg.limit_mps = rise * limits_.speed_mps > vertical_mps ? vertical_mps / rise : limits_.speed_mps;
  leg.braking = limits_along(way, limits_.acceleration_mps2);
  leg.faster = limits_along(way, faster_mps2_);
  return leg;
}

/// Speeds at the corners for which both turns of a leg find room on it. Where they do not at the speeds that the
/// limits allow, each gets its part of the leg.
void Fitter::limit_corners() noexcept {
  std::array<double, kMaxPoints> wanted_m{};
  for (std::size_t i = 1; i + 1 < count_; ++i) {
    turn_[i] = turn_between(leg_[i - 1].direction, leg_[i].direction);
    speed_[i] = course_.share[i] > 0.0 ? std::min(leg_[i - 1].limit_mps, leg_[i].limit_mps) : 0.0;
    wanted_m[i] = turn_[i].way_m(speed_[i]);
  }
  const auto room_m = [&](std::size_t leg, std::size_t i, std::size_t other) {
    const double both_m = wanted_m[i] + wanted_m[other];
    return both_m > leg_[leg].length_m ? leg_[leg].length_m * wanted_m[i] / both_m : wanted_m[i];
  };
  for (std::size_t i = 1; i + 1 < count_; ++i) {
    const double most_m = course_.share[i] * std::min(room_m(i - 1, i, i - 1), room_m(i, i, i + 1));
    speed_[i] = highest_mps(speed_[i], [&](double v) { return turn_[i].way_m(v) <= most_m; });
  }
  speed_[count_ - 1] = 0.0;
}

double Fitter::braked_mps(std::size_t i, const Turn& turn) const noexcept {
  const double left_m = leg_[i].length_m - turn_[i + 1].way_m(speed_[i + 1]);
  return highest_mps(speed_[i], [&](double v) {
    return turn.way_m(v) + (v > speed_[i + 1] ? change_m(v, speed_[i + 1], leg_[i].braking) : 0.0) <= left_m;
  });
}

void Fitter::limit_backwards() noexcept {
  for (std::size_t i = count_ - 1; i-- > 1;) speed_[i] = braked_mps(i, turn_[i]);
}

/// No faster than what can be reached from the point before. Never slower than there: the least difference takes a way
/// of its own.
void Fitter::limit_forwards() noexcept {
  for (std::size_t i = 1; i + 1 < count_; ++i) {
    const double before_mps = speed_[i - 1];
    if (speed_[i] <= before_mps) continue;
    const double left_m = leg_[i - 1].length_m - (i > 1 ? turn_[i - 1].way_m(before_mps) : 0.0);
    speed_[i] = highest_mps_from(before_mps, speed_[i], [&](double v) {
      return turn_[i].way_m(v) + change_m(before_mps, v, leg_[i - 1].faster) <= left_m;
    });
  }
}

ChangeLimits Fitter::first_change(const TrajectoryPoint& start, const Vector3& v_W) const noexcept {
  const bool speeds_up = v_W.norm() > start.v_W.norm();
  return limits_along(v_W - start.v_W, speeds_up ? faster_mps2_ : limits_.acceleration_mps2);
}

/// The direction of the leg depends on where the change ends, and that on the direction: a few rounds.
bool Fitter::leads_on(const TrajectoryPoint& start, double speed_mps, const Aim& aim,
                      Beginning& out) const noexcept {
  const Vector3& to_W = course_.point_W[1];
  Vector3 direction = leg_[0].direction;
  bool aimed = false;
  for (int i = 0; i < aim.rounds && !aimed; ++i) {
    out.v_W = speed_mps * direction;
    const VelocityChange change(start, out.v_W, first_change(start, out.v_W));
    out.leg = leg_between(start.p_W + change.way_W(), to_W);
    aimed = (out.leg.direction - direction).squaredNorm() < aim.error * aim.error;
    direction = out.leg.direction;
  }
  out.speed_mps = speed_mps;
  const Vector3 flown = speed_mps > kAtRest ? Vector3(out.v_W / speed_mps) : direction;
  if (!aimed && !((direction - flown).norm() < kRough.error)) return false;
  if (speed_mps > out.leg.limit_mps * 1.0000001) return false;
  if (count_ == 2) return change_m(speed_mps, 0.0, out.leg.braking) <= out.leg.length_m + kSlack_m;
  // The corner bends otherwise than where its speed was looked for: the first leg comes from elsewhere.
  const Turn turn = turn_between(direction, leg_[1].direction);
  const double least_mps = std::min(braked_mps(1, turn), speed_mps);
  return turn.way_m(least_mps) + change_m(speed_mps, least_mps, out.leg.braking) <=
         out.leg.length_m + kSlack_m;
}

bool Fitter::begin(const TrajectoryPoint& start) noexcept {
  Beginning beginning;
  const auto fits = [&](double v) { return leads_on(start, v, kRough, beginning); };
  const double most_mps = course_.start_share * std::max(leg_[0].limit_mps, 0.0);
  // To brake from the speed at which the acceleration has gone to zero takes less way than to slow down first and then brake: where
  // it fits, slower ones need not, and what is looked for lies above it.
  const double settles_s = start.a_W.norm() / limits_.jerk_mps3;
  const double settled_mps = std::min((start.v_W + 0.5 * settles_s * start.a_W).norm(), most_mps);
  const double least_mps = fits(settled_mps) ? settled_mps : 0.0;
  const double speed_mps = highest_mps_from(least_mps, most_mps, fits, kBeginHalvings);
  if (!leads_on(start, speed_mps, kExact, beginning) && !fits(speed_mps)) return false;
  if (!add_change(beginning.v_W, first_change(start, beginning.v_W), 0)) return false;
  leg_[0] = beginning.leg;
  speed_[0] = beginning.speed_mps;
  if (speed_[0] > kAtRest) leg_[0].direction = beginning.v_W / speed_[0];
  if (count_ > 2) {
    // From where the first leg ends: where no direction settles, a tenth of a millimetre per metre beside the corner.
    leg_[1] = leg_between(at_.p_W + leg_[0].length_m * leg_[0].direction, course_.point_W[2]);
    turn_[1] = turn_between(leg_[0].direction, leg_[1].direction);
    speed_[1] = braked_mps(1, turn_[1]);
  }
  return true;
}

bool Fitter::add(const VelocityChange::Piece& piece, std::size_t part) noexcept {
  if (piece.duration_s < kShort_s) return true;
  if (out_.segment_count == Trajectory::kMaxSegments) return false;
  part_[out_.segment_count] = static_cast<std::uint8_t>(part);
  PolynomialSegment& segment = out_.segment[out_.segment_count++];
  segment = {};
  segment.duration_s = piece.duration_s;
  segment.coefficient[0] = at_.p_W;
  segment.coefficient[1] = at_.v_W;
  segment.coefficient[2] = 0.5 * at_.a_W;
  segment.coefficient[3] = piece.jerk_W / 6.0;
  at_ = after(at_, piece);
  now_s_ += piece.duration_s;
  return true;
}

bool Fitter::add(const VelocityChange& change, std::size_t part) noexcept {
  for (const VelocityChange::Piece& piece : change.pieces())
    if (!add(piece, part)) return false;
  return true;
}

bool Fitter::add_change(const Vector3& v_W, const ChangeLimits& limits, std::size_t part) noexcept {
  if (!add(VelocityChange(at_, v_W, limits), part)) return false;
  at_.v_W = v_W;  // not what rounding left of it
  at_.a_W.setZero();
  return true;
}

/// Up to a peak, on, and down to the speed of the turn that follows.
CurveFit Fitter::add_leg(std::size_t i) noexcept {
  const Leg& leg = leg_[i];
  const double from_mps = speed_[i], to_mps = speed_[i + 1];
  const double turns_m =
      (i > 0 ? turn_[i].way_m(from_mps) : 0.0) + (i + 2 < count_ ? turn_[i + 1].way_m(to_mps) : 0.0);
  const double length_m = leg.length_m - turns_m;
  const auto way_m = [&](double peak) {
    return change_m(from_mps, peak, leg.faster) + change_m(peak, to_mps, leg.braking);
  };
  const double least_mps = std::max(from_mps, to_mps);
  if (way_m(least_mps) > length_m + 1e-6) return CurveFit::kTooFast;
  const double peak_mps =
      highest_mps_from(least_mps, leg.limit_mps, [&](double v) { return way_m(v) <= length_m; });
  const std::size_t straight = 2 * i + 1;
  bool room = add_change(peak_mps * leg.direction, leg.faster, straight);
  const double cruise_m = length_m - way_m(peak_mps);
  if (peak_mps > kAtRest && cruise_m > 0.0)
    room = room && add({Vector3::Zero(), cruise_m / peak_mps}, straight);
  out_.brake_begin_s = now_s_;
  room = room && add_change(to_mps * leg.direction, leg.braking, straight);
  if (i + 2 < count_)
    room = room && add_change(to_mps * leg_[i + 1].direction, turn_[i + 1].limits, straight + 1);
  return room ? CurveFit::kOk : CurveFit::kTooManyPoints;
}

CurveFit Fitter::add_all() noexcept {
  for (std::size_t i = 0; i + 1 < count_; ++i) {
    const CurveFit fit = add_leg(i);
    if (fit != CurveFit::kOk) return fit;
  }
  return CurveFit::kOk;
}

CurveFit Fitter::fit(const TrajectoryPoint& start) noexcept {
  out_.segment_count = 0;
  out_.brake_begin_s = 0.0;
  at_ = start;
  count_ = course_.point_W.size();
  if (course_.start_share <= 0.0) {
    if (!add_change(Vector3::Zero(), limits_along(at_.v_W, limits_.acceleration_mps2), 0))
      return CurveFit::kTooManyPoints;
    if (count_ == 2 && (course_.point_W[1] - at_.p_W).norm() < kHere_m) return CurveFit::kOk;
  }
  from_W_ = at_.p_W;
  leg_[0] = leg_between(from_W_, course_.point_W[1]);
  for (std::size_t i = 1; i + 1 < count_; ++i)
    leg_[i] = leg_between(course_.point_W[i], course_.point_W[i + 1]);
  limit_corners();
  limit_backwards();
  if (at_.v_W.norm() < kAtRest && at_.a_W.norm() < kAtRest)
    speed_[0] = 0.0;
  else if (!begin(at_))
    return CurveFit::kTooFast;
  limit_forwards();
  return add_all();
}

}  // namespace

CurveFit fit_curve(const Course& course, const TrajectoryPoint& start, const MotionLimits& limits,
                   Trajectory& out, SegmentParts& part) noexcept {
  return Fitter(course, limits, out, part).fit(start);
}

}  // namespace roborun::stages
