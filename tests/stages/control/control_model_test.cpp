// Tracker and mixer beside the same equations written a second time, without a care for speed.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/random/counter_rng.hpp"
#include "stages/control/mixer.hpp"
#include "stages/control/tracker.hpp"
#include "tests/support/limits.hpp"

namespace roborun::stages {
namespace {

using core::CounterRng;
using Four = std::array<double, 4>;
constexpr double kGravity = 9.81;

/// Thrusts of the motors: roll and pitch first, then what thrust leaves room for them, then as much of the yaw as all of them have.
Four thrusts_N(const VehicleModel& v, double thrust_N, const Vector3& torque) {
  // Front left, front right, rear left, rear right; a motor at (x, y) turns by y F about x and by -x F about y.
  const Four x{1, 1, -1, -1}, y{1, -1, 1, -1}, spin{1, -1, -1, 1};
  Four lean{}, all{};
  for (std::size_t i = 0; i < 4; ++i)
    lean.at(i) = (y.at(i) * torque.x() - x.at(i) * torque.y()) / (4.0 * v.arm_m);
  const auto [low, high] = std::ranges::minmax(lean);
  const double spread_N = high - low, max_N = v.max_thrust_N;
  const double part = spread_N <= max_N ? 1.0 : max_N / spread_N;
  double each_N = thrust_N / 4.0;
  if (each_N + part * low < 0.0) each_N = -part * low;
  if (each_N + part * high > max_N) each_N = max_N - part * high;
  const auto with = [&](double share) {
    for (std::size_t i = 0; i < 4; ++i)
      all.at(i) = each_N + part * lean.at(i) + share * spin.at(i) * torque.z() / (4.0 * v.yaw_torque_m);
    return std::ranges::all_of(all, [&](double f) { return f >= 0.0 && f <= max_N; });
  };
  double fits = 0.0, too_much = 1.0;
  if (with(1.0)) return all;
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (fits + too_much);
    (with(middle) ? fits : too_much) = middle;
  }
  (void)with(fits);
  return all;
}

TEST(Mixer, IsItsOrderWrittenASecondTime) {
  CounterRng rng(11);
  VehicleModel v;
  int scaled = 0;
  for (int i = 0; i < 50'000; ++i) {
    v.arm_m = rng.uniform(0.05, 0.4);
    v.yaw_torque_m = rng.uniform(0.005, 0.05);
    v.max_thrust_N = rng.uniform(1.0, 40.0);
    // From a hundredth of what the motors have to three times as much.
    const double size = std::pow(10.0, rng.uniform(-2.0, 0.5));
    const double thrust_N = rng.uniform(-0.2, 1.2) * 4.0 * v.max_thrust_N;
    const Vector3 torque(size * v.max_thrust_N * v.arm_m * rng.normal(),
                         size * v.max_thrust_N * v.arm_m * rng.normal(),
                         size * v.max_thrust_N * v.yaw_torque_m * rng.normal());
    const Four wanted_N = thrusts_N(v, thrust_N, torque);
    const auto command = mix(v, thrust_N, torque);
    for (std::size_t m = 0; m < 4; ++m)
      ASSERT_NEAR(command.thrust_ratio.at(m), wanted_N.at(m) / v.max_thrust_N, 1e-9) << i << ", motor " << m;
    scaled += std::ranges::count(command.thrust_ratio, 0.0) > 0 ? 1 : 0;
  }
  EXPECT_GT(scaled, 5000);
}

/// The cascade, as its header says it.
class SecondTracker {
 public:
  explicit SecondTracker(const Tracker::Config& config) : c_(config) {}
  bool tilt_limited{false};

  Four step(const Tracker::Input& in) {
    const VehicleModel& v = c_.vehicle;
    const auto shorter = [](Vector3 a, double most) {
      if (a.norm() > most) a = a.normalized() * most;
      return a;
    };
    const Vector3 away = in.reference.p_W - in.state.p_WB;
    const Vector3 wanted_v = in.reference.v_W + shorter(away * c_.position_gain_Hz, c_.correction_limit_mps);
    const Vector3 slow = wanted_v - in.state.v_WB;
    integral_ = shorter(integral_ + slow * c_.period_s * c_.velocity_integral_Hz2, c_.integral_limit_mps2);
    const double speed = in.reference.v_W.norm();
    const Vector3 drag =
        in.reference.v_W * (v.drag_linear_Nspm / v.mass_kg + v.drag_quadratic_Ns2pm2 * speed / v.mass_kg);
    Vector3 a = in.reference.a_W + drag + slow * c_.velocity_gain_Hz + integral_;
    a.z() = std::min(std::max(a.z(), -kGravity / 2.0), 3.0 * kGravity / 5.0);
    const double most = std::tan(v.tilt_rad) * (kGravity + a.z()), side = std::hypot(a.x(), a.y());
    tilt_limited = side > most;
    if (tilt_limited) a = Vector3(a.x() * most / side, a.y() * most / side, a.z());
    const Vector3 force = a + Vector3(0.0, 0.0, kGravity);
    const Vector3 up = force.normalized();
    const Vector3 left = up.cross(Vector3(std::cos(in.yaw_rad), std::sin(in.yaw_rad), 0.0)).normalized();
    Matrix3 wanted;
    wanted << left.cross(up), left, up;
    const Matrix3 R = in.state.q_WB.toRotationMatrix();
    // Half of the sum of cross products of wanted and real axes is the axis of the rotation, times its sine.
    Vector3 turn = Vector3::Zero();
    for (int i = 0; i < 3; ++i) turn += 0.5 * R.col(i).cross(wanted.col(i));
    const Vector3 turn_B(turn.dot(R.col(0)), turn.dot(R.col(1)), turn.dot(R.col(2)));
    const Vector3 turns_up = (in.reference.j_W - up * up.dot(in.reference.j_W)) / force.norm();
    Vector3 rate = c_.attitude_gain_Hz * Vector3(turn_B.x(), turn_B.y(), 0.4 * turn_B.z());
    rate.x() -= turns_up.dot(R.col(1));
    rate.y() += turns_up.dot(R.col(0));
    const Matrix3 inertia = v.inertia_kgm2().asDiagonal();
    const Vector3 w = in.state.w_WB_B;
    const Vector3 torque = inertia * (c_.rate_gain_Hz * (rate - w)) + w.cross(inertia * w);
    const double thrust_N = std::max(0.0, v.mass_kg * R.col(2).dot(force));
    return thrusts_N(v, thrust_N, torque);
  }

 private:
  Tracker::Config c_;
  Vector3 integral_ = Vector3::Zero();
};

TEST(Tracker, IsItsEquationsWrittenASecondTime) {
  CounterRng rng(12);
  const auto any = [&rng](double size) {
    return Vector3(size * rng.normal(), size * rng.normal(), size * rng.normal());
  };
  std::uint64_t limited = 0, upside_down = 0;
  for (int flight = 0; flight < 300; ++flight) {
    Tracker::Config config;
    config.vehicle.tilt_rad = rng.uniform(0.2, 1.0);
    config.vehicle.drag_linear_Nspm = rng.uniform(0.0, 0.5);
    config.vehicle.drag_quadratic_Ns2pm2 = rng.uniform(0.0, 0.1);
    config.integral_limit_mps2 = rng.uniform(0.02, 3.0);
    config.correction_limit_mps = rng.uniform(0.5, 4.0);
    ASSERT_EQ(config.validate(), Status::kOk);
    // From quiet flight, in which nothing is at a limit, to all that can go wrong.
    const double size = std::pow(10.0, rng.uniform(-2.5, 1.0));
    Tracker sut(config);
    SecondTracker model(config);
    std::uint64_t tilts = 0;
    for (int i = 0; i < 50; ++i) {
      Tracker::Input in;
      in.state.p_WB = any(10.0);
      in.state.v_WB = any(size);
      in.state.w_WB_B = any(size);
      const Vector3 axis = any(1.0).normalized();
      in.state.q_WB = Quaternion(Eigen::AngleAxisd(size * rng.uniform(-0.3, 0.3), axis));
      in.reference = {Vector3(in.state.p_WB + any(size)), any(size), any(size), any(size)};
      in.yaw_rad = rng.uniform(-9.0, 9.0);
      firmware_if::MotorCommand command;
      ASSERT_EQ(sut.step(in, command), Status::kOk);
      const Four wanted_N = model.step(in);
      for (std::size_t m = 0; m < 4; ++m)
        ASSERT_NEAR(command.thrust_ratio.at(m), wanted_N.at(m) / config.vehicle.max_thrust_N, 1e-6)
            << flight << ", " << i << ", motor " << m;
      tilts += model.tilt_limited ? 1U : 0U;
      upside_down += in.state.q_WB.toRotationMatrix()(2, 2) < 0.0 ? 1U : 0U;
    }
    EXPECT_EQ(sut.counters().tilt_limited, tilts);
    EXPECT_EQ(sut.counters().steps, 50U);
    limited += tilts;
  }
  EXPECT_GT(limited, 1000U);
  EXPECT_GT(upside_down, 100U);
}

TEST(Tracker, RefusesWhateverIsNotFinite) {
  const auto refuses = [](auto change) {
    Tracker sut({});
    Tracker::Input in;
    change(in);
    firmware_if::MotorCommand command;
    command.thrust_ratio = {0.1, 0.2, 0.3, 0.4};
    EXPECT_EQ(sut.step(in, command), Status::kInvalidArgument);
    EXPECT_EQ(command.thrust_ratio[2], 0.3) << "the command before stays";
    EXPECT_EQ(sut.counters().refused, 1U);
    EXPECT_EQ(sut.counters().steps, 0U);
  };
  using In = Tracker::Input;
  for (const double bad : {test::kNan, test::kInfinity}) {
    refuses([bad](In& in) { in.state.p_WB.x() = bad; });
    refuses([bad](In& in) { in.state.v_WB.y() = bad; });
    refuses([bad](In& in) { in.state.w_WB_B.z() = bad; });
    refuses([bad](In& in) { in.state.q_WB.w() = bad; });
    refuses([bad](In& in) { in.reference.p_W.z() = bad; });
    refuses([bad](In& in) { in.reference.v_W.x() = bad; });
    refuses([bad](In& in) { in.reference.a_W.y() = bad; });
    refuses([bad](In& in) { in.reference.j_W.z() = bad; });
    refuses([bad](In& in) { in.yaw_rad = bad; });
  }
}

TEST(Tracker, ItsGainsFollowTheLagOfTheMotors) {
  const Tracker::Config tuned;
  const auto with = [](double lag_s) {
    VehicleModel v;
    v.motor_lag_s = lag_s;
    v.mass_kg = 1.25;
    return Tracker::config_for(v, 0.005);
  };
  for (const auto& [lag_s, quicker] :
       {std::pair{0.04, 1.0}, {0.02, 2.0}, {0.08, 0.5}, {0.001, 2.5}, {0.4, 0.4}}) {
    const Tracker::Config c = with(lag_s);
    EXPECT_NEAR(c.position_gain_Hz, quicker * tuned.position_gain_Hz, 1e-12);
    EXPECT_NEAR(c.velocity_gain_Hz, quicker * tuned.velocity_gain_Hz, 1e-12);
    EXPECT_NEAR(c.velocity_integral_Hz2, quicker * quicker * tuned.velocity_integral_Hz2, 1e-12);
    EXPECT_NEAR(c.attitude_gain_Hz, quicker * tuned.attitude_gain_Hz, 1e-12);
    EXPECT_NEAR(c.rate_gain_Hz, quicker * tuned.rate_gain_Hz, 1e-12);
    EXPECT_EQ(c.correction_limit_mps, tuned.correction_limit_mps);
    EXPECT_EQ(c.period_s, 0.005);
    EXPECT_EQ(c.vehicle.mass_kg, 1.25);
    EXPECT_EQ(c.vehicle.motor_lag_s, lag_s);
  }
  // The integral takes up the drag at full speed and a fifth more, within [2.5, 10].
  const auto limit = [](double drag_mps2_at_full_speed) {
    VehicleModel v;
    v.drag_quadratic_Ns2pm2 = 0.0;
    v.drag_linear_Nspm = drag_mps2_at_full_speed * v.mass_kg / v.speed_mps;
    return Tracker::config_for(v, 0.0025).integral_limit_mps2;
  };
  EXPECT_NEAR(limit(5.0), 6.0, 1e-9);
  EXPECT_EQ(limit(1.0), 2.5);
  EXPECT_EQ(limit(20.0), 10.0);
}

}  // namespace
}  // namespace roborun::stages
