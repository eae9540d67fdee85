// The estimator with odometry: order of trust, resets, jumps, and what it says of its own error.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "core/executive/frame_table.hpp"
#include "core/geometry/math.hpp"
#include "core/random/counter_rng.hpp"
#include "stages/control/estimator.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::stages {
namespace {

constexpr double kSpeed_mps = 3.0;

double seconds_of(MonotonicTime t) { return seconds(t.time_since_epoch()); }

/// Straight ahead to the east at constant speed after a second at rest, level, with every sensor. Odometry drifts by `drift` of
/// the way to the north, in a frame of its own.
class Flight {
 public:
  double drift{0.0};
  Vector3 gnss_error_m = Vector3::Zero();
  double gnss_sigma_m{0.02};
  Vector3 jump_O_m = Vector3::Zero();
  double yaw_O_rad{0.0};
  std::uint8_t resets{0};
  bool has_gnss{true}, has_odometry{true};
  Estimator estimator{{}};
  Status last_odometry{Status::kNotReady};

  static Vector3 p_W(double t) {
    const double s = std::fmax(t - 1.0, 0.0);
    return {s < 1.0 ? 0.5 * kSpeed_mps * s * s : kSpeed_mps * (s - 0.5), 0.0, 5.0};
  }
  static Vector3 v_W(double t) { return {kSpeed_mps * std::fmin(std::fmax(t - 1.0, 0.0), 1.0), 0.0, 0.0}; }
  [[nodiscard]] firmware_if::OdometrySample odometry(MonotonicTime stamp) {
    const double t = seconds_of(stamp);
    const double c = core::cos(yaw_O_rad), s = core::sin(yaw_O_rad);
    const Vector3 p(p_W(t).x(), drift * p_W(t).x(), p_W(t).z());
    const Vector3 v(v_W(t).x(), drift * v_W(t).x(), 0.0);
    const auto noise = [this] { return 0.004 * rng_.normal(); };
    firmware_if::OdometrySample o;
    o.stamp = stamp;
    o.reset_counter = resets;
    o.p_OB_m = {c * p.x() - s * p.y() + jump_O_m.x() + noise(),
                s * p.x() + c * p.y() + jump_O_m.y() + noise(), p.z() + jump_O_m.z() + noise()};
    o.v_OB_mps = {c * v.x() - s * v.y(), s * v.x() + c * v.y(), noise()};
    o.q_OB = {core::cos(0.5 * yaw_O_rad), 0.0, 0.0, core::sin(0.5 * yaw_O_rad)};
    o.sigma_position_m = 0.02;
    o.sigma_attitude_rad = 0.01;
    o.sigma_speed_mps = 0.05;
    return o;
  }
  [[nodiscard]] firmware_if::GnssFix gnss(MonotonicTime stamp) {
    const double t = seconds_of(stamp);
    firmware_if::GnssFix fix;
    fix.stamp = stamp;
    for (int i = 0; i < 3; ++i) {
      const auto axis = static_cast<std::size_t>(i);
      fix.p_WB_m[axis] = p_W(t)[i] + gnss_error_m[i] + 0.3 * gnss_sigma_m * rng_.normal();
      fix.v_WB_mps[axis] = v_W(t)[i];
    }
    fix.heading_rad = 0.0;
    fix.sigma_horizontal_m = fix.sigma_vertical_m = gnss_sigma_m;
    fix.sigma_speed_mps = 0.05;
    fix.sigma_heading_rad = 0.01;
    return fix;
  }
  /// `each` sees the state after every step; samples of odometry are 40 ms late, fixes 100 ms.
  void fly(double until_s, const std::function<void(double, const EstimatedState&)>& each = {}) {
    for (; seconds_of(now_) < until_s; ++step_) {
      now_ += core::kMinorFrame;
      const double t = seconds_of(now_);
      firmware_if::ImuSample imu;
      imu.stamp = now_;
      imu.specific_force_B_mps2 = {t > 1.0 && t <= 2.0 ? kSpeed_mps : 0.0, 0.0, core::kGravity_mps2};
      for (double& x : imu.specific_force_B_mps2) x += 0.02 * rng_.normal();
      for (double& x : imu.angular_rate_B_radps) x += 0.001 * rng_.normal();
      (void)estimator.predict(imu);
      if (has_odometry && step_ % 13 == 0 && t > 0.05)
        last_odometry = estimator.update(odometry(now_ - Nanos{40'000'000}));
      if (has_gnss && step_ % 40 == 0 && t > 0.11) (void)estimator.update(gnss(now_ - Nanos{100'000'000}));
      EstimatedState state;
      if (each && estimator.state(state) == Status::kOk) each(t, state);
    }
  }
  [[nodiscard]] EstimatedState state() const {
    EstimatedState s;
    EXPECT_EQ(estimator.state(s), Status::kOk);
    return s;
  }
  [[nodiscard]] MonotonicTime now() const { return now_; }

 private:
  MonotonicTime now_{};
  int step_{0};
  core::CounterRng rng_{7};
};

/// The largest step of the estimate besides what it flew meanwhile.
struct Steps {
  double most_m{0.0};
  Vector3 before_W = Vector3::Zero();
  double before_s{-1.0};
  void operator()(double t, const EstimatedState& s) {
    if (before_s >= 0.0) most_m = std::fmax(most_m, (s.p_WB - before_W - (t - before_s) * s.v_WB).norm());
    before_W = s.p_WB;
    before_s = t;
  }
};

TEST(Odometry, FliesWithoutSatellites) {
  Flight f;
  f.has_gnss = false;
  f.drift = 0.01;
  f.fly(1.5);
  EstimatedState early;
  EXPECT_EQ(f.estimator.state(early), Status::kNotReady) << "it waits for a fix";
  f.fly(60.0);
  const EstimatedState s = f.state();
  const double way_m = Flight::p_W(60.0).x();
  EXPECT_LT((s.p_WB - Flight::p_W(60.0)).norm(), 0.01 * way_m + 0.3);
  EXPECT_LT((s.v_WB - Flight::v_W(60.0)).norm(), 0.15);
}

TEST(Odometry, ItsErrorIsWithinWhatItSaysAndGrowsWithTheWay) {
  Flight f;
  f.has_gnss = false;
  f.drift = 0.01;
  f.fly(10.0);
  const double sigma_m = f.state().position_sigma_m;
  f.fly(100.0);
  const EstimatedState s = f.state();
  const double way_m = Flight::p_W(100.0).x(), error_m = (s.p_WB - Flight::p_W(100.0)).norm();
  EXPECT_GT(s.position_sigma_m, 4.0 * sigma_m);
  EXPECT_LT(error_m, 1.2 * s.position_sigma_m) << "honest";
  EXPECT_LT(s.position_sigma_m, 0.012 * way_m) << "bounded";
  EXPECT_LT(s.map_sigma_m, 0.05) << "what drifts, the map drifts with";
  EXPECT_EQ(s.drift_ratio, 0.01);
}

TEST(Odometry, AResetMovesNothing) {
  Flight f;
  f.has_gnss = false;
  f.fly(20.0);
  Steps steps;
  f.jump_O_m = Vector3(-30.0, 12.0, -4.0);
  f.yaw_O_rad = 2.0;
  ++f.resets;
  f.fly(25.0, std::ref(steps));
  EXPECT_LT(steps.most_m, 0.02);
  EXPECT_EQ(f.last_odometry, Status::kOk) << "followed again";
  EXPECT_EQ(f.estimator.counters().anchored, 2U);
  EXPECT_LT((f.state().p_WB - Flight::p_W(25.0)).norm(), 0.3);
  EXPECT_EQ(f.state().map_number, 0U) << "the map stays";
}

TEST(Odometry, AJumpWithoutAWordIsNotFollowed) {
  Flight f;
  f.has_gnss = false;
  f.fly(20.0);
  Steps steps;
  f.jump_O_m = Vector3(0.0, 2.0, 0.0);
  f.fly(25.0, std::ref(steps));
  EXPECT_LT(steps.most_m, 0.02);
  EXPECT_EQ(f.last_odometry, Status::kOk);
  EXPECT_LT((f.state().p_WB - Flight::p_W(25.0)).norm(), 0.3);
  EXPECT_EQ(f.state().map_number, 0U);
}

TEST(Odometry, NonsenseIsNeverFollowed) {
  Flight f;
  f.fly(10.0);
  const std::uint64_t accepted = f.estimator.counters().odometry;
  core::CounterRng rng(5);
  f.has_odometry = false;
  MonotonicTime stamp = f.now();
  for (int i = 0; i < 200; ++i) {
    f.fly(10.0 + 0.05 * (i + 1));
    stamp = f.now();
    firmware_if::OdometrySample o = f.odometry(stamp);
    for (double& x : o.p_OB_m) x = rng.uniform(-1e6, 1e6);
    if (i % 3 == 0) o.v_OB_mps[1] = std::numeric_limits<double>::quiet_NaN();
    if (i % 5 == 0) o.q_OB = {2.0, 0.0, 0.0, 0.0};
    EXPECT_NE(f.estimator.update(o), Status::kOk);
  }
  EXPECT_EQ(f.estimator.counters().odometry, accepted);
  EXPECT_LT((f.state().p_WB - Flight::p_W(20.0)).norm(), 0.2) << "fixes hold it";
}

TEST(Odometry, LostItHandsOverToFixesWithoutAJump) {
  Flight f;
  f.drift = 0.01;
  f.fly(40.0);
  const Vector3 shift_W = f.state().shift_W;
  EXPECT_NEAR(f.state().p_WB.y(), 0.01 * Flight::p_W(40.0).x(), 0.2) << "flown in the frame of the odometry";
  EXPECT_NEAR(shift_W.y(), -0.01 * Flight::p_W(40.0).x(), 0.2) << "and fixes say where that is";
  Steps steps;
  f.has_odometry = false;
  f.fly(50.0, std::ref(steps));
  EXPECT_LT(steps.most_m, 0.03);
  EXPECT_LT((f.state().p_WB + f.state().shift_W - Flight::p_W(50.0)).norm(), 0.2);
  f.has_odometry = true;
  f.fly(60.0, std::ref(steps));
  EXPECT_LT(steps.most_m, 0.03) << "it comes back";
  EXPECT_EQ(f.last_odometry, Status::kOk);
  EXPECT_EQ(f.state().map_number, 0U);
}

TEST(Odometry, FixesThatJumpAgainstItMoveTheGoalAndCostTheMap) {
  Flight f;
  f.fly(20.0);
  Steps steps;
  f.gnss_error_m = Vector3(0.0, 2.0, 0.0);
  f.fly(20.5, std::ref(steps));
  EXPECT_EQ(f.state().map_number, 0U) << "not yet believed";
  f.fly(25.0, std::ref(steps));
  EXPECT_LT(steps.most_m, 0.02);
  EXPECT_NEAR(f.state().shift_W.y(), 2.0, 0.1);
  EXPECT_EQ(f.state().map_number, 1U) << "nobody knows which of both it was";
  f.gnss_error_m = Vector3(0.0, 40.0, 0.0);
  f.fly(40.0, std::ref(steps));
  EXPECT_NEAR(f.state().shift_W.y(), 2.0, 0.2) << "too far to be believed";
  EXPECT_EQ(f.state().map_number, 1U);
}

TEST(Odometry, FixesOfAnOrdinaryReceiverDoNotMoveTheMap) {
  Flight f;
  f.gnss_sigma_m = 1.3;
  f.fly(20.0);
  Steps steps;
  f.gnss_error_m = Vector3(1.0, 2.0, 0.0);
  f.fly(60.0, std::ref(steps));
  EXPECT_LT(steps.most_m, 0.02);
  EXPECT_EQ(f.state().map_number, 0U) << "within their own error";
  EXPECT_GT(f.state().position_sigma_m, 1.2) << "averaging takes nothing of it away";
}

TEST(Odometry, WithoutItFixesOfAnOrdinaryReceiverMoveTheGoalAlone) {
  Flight f;
  f.has_odometry = false;
  f.gnss_sigma_m = 1.3;
  f.fly(20.0);
  Steps steps;
  f.gnss_error_m = Vector3(1.0, 2.0, 0.0);
  const Vector3 before_m = f.state().p_WB - Flight::p_W(20.0);
  f.fly(80.0, std::ref(steps));
  EXPECT_LT(steps.most_m, 0.02);
  const Vector3 wandered_m = f.state().p_WB - Flight::p_W(80.0) - before_m;
  EXPECT_LT(wandered_m.norm(), 0.6) << "in a minute by its speed alone; by 2.2 m if it followed";
  EXPECT_LT((f.state().p_WB + f.state().shift_W - Flight::p_W(80.0) - f.gnss_error_m).norm(), 0.3)
      << "the goal does";
  EXPECT_EQ(f.state().map_number, 0U);
  EXPECT_GT(f.state().position_sigma_m, 1.2) << "on the earth";
  EXPECT_LT(f.state().map_sigma_m, 0.3) << "against the map";
}

TEST(Odometry, WithoutItAJumpOfFixesMovesTheGoalAlone) {
  Flight f;
  f.has_odometry = false;
  f.fly(20.0);
  Steps steps;
  f.gnss_error_m = Vector3(0.0, 2.0, 0.0);
  f.fly(30.0, std::ref(steps));
  EXPECT_LT(steps.most_m, 0.03);
  EXPECT_NEAR(f.state().shift_W.y(), 2.0, 0.2);
  EXPECT_EQ(f.state().map_number, 0U) << "the inertial sensors know that the vehicle did not jump";
  EXPECT_EQ(f.estimator.counters().jumps, 1U);
}

TEST(Odometry, AllocatesNothing) {
  Flight f;
  f.fly(3.0);
  const test::NoAllocScope scope;
  f.fly(6.0);
  EXPECT_EQ(scope.count(), 0U);
}

}  // namespace
}  // namespace roborun::stages
