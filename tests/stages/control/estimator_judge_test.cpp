// The estimator beside a second one of the same rules (estimator_judge.hpp), through flights in which everything goes wrong now and then.
#include "tests/stages/control/estimator_judge.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "core/random/counter_rng.hpp"
#include "stages/control/estimator.hpp"

namespace roborun::stages {
namespace {

constexpr double kStep_s = 0.0025;
constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();

std::array<double, 3> numbers(const Vector3& v) { return {v.x(), v.y(), v.z()}; }

/// A flight of turns, its sensors, and what goes wrong with them.
class Flight {
 public:
  explicit Flight(std::uint32_t seed) : rng_(seed), config_(config_of(rng_)), sut_(config_), judge_(config_) {
    has_fixes_ = rng_.uniform(0.0, 1.0) < 0.75;
    has_odometry_ = !has_fixes_ || rng_.uniform(0.0, 1.0) < 0.5;
    has_heading_ = rng_.uniform(0.0, 1.0) < 0.8;
    sigma_m_ = rng_.uniform(0.0, 1.0) < 0.3 ? rng_.uniform(0.2, 2.0) : rng_.uniform(0.01, 0.2);
    faults_per_s_ = rng_.uniform(0.0, 1.5);
    is_prompt_ = rng_.uniform(0.0, 1.0) < 0.4;
    odometry_every_ = is_prompt_ ? 8 : 13;
    falls_ = rng_.uniform(0.0, 1.0) < 0.1;
    gyro_bias_ = random(0.02);
    force_bias_ = random(0.2);
  }
  void run(double until_s) {
    for (k_ = 0; k_ * kStep_s < until_s && !::testing::Test::HasFailure(); ++k_) {
      if (k_ * kStep_s > 1.0 && rng_.uniform(0.0, 1.0) < faults_per_s_ * kStep_s) begin_fault();
      if (k_ >= fault_until_) fault_ = Fault::kNone;
      move();
      if (fault_ == Fault::kSilence) continue;
      if (k_ == 0 && has_fixes_) hear_fix();  // before any sample of the IMU
      if (k_ == 0 && has_odometry_) hear_odometry();
      if (fault_ != Fault::kClockSet || by_.y() > 0.0 || k_ % 48 == 0) hear_imu();
      if (has_odometry_ && k_ % odometry_every_ == 0) hear_odometry();
      if (has_fixes_ && k_ % 40 == 0) hear_fix();
      if (k_ % 8 == 0) hear_barometer();
    }
  }
  [[nodiscard]] const Estimator::Counters& counters() const { return sut_.counters(); }

 private:
  enum class Fault {
    kNone,
    kSilence,  // of all
    kLeap,
    kGarbage,
    kClockSet,
    kOddTimes,
    kRepeats,
    kFalls,
    kFixJumps,
    kFixSpeed,
    kHeading,
    kHeadingStuck,
    kFixStuck,
    kFixSilent,
    kLate,
    kOdometryJumps,
    kOdometryBegins,
    kOdometrySilent,
    kOdometryTurns,
    kBarometer,
    kHuge,
    kCount
  };

  static Estimator::Config config_of(core::CounterRng& rng) {
    Estimator::Config c;
    c.gyro_noise_radps = rng.uniform(0.001, 0.02);
    c.accel_noise_mps2 = rng.uniform(0.02, 0.5);
    c.gyro_bias_walk_radps = rng.uniform(1e-5, 5e-3);
    c.accel_bias_walk_mps2 = rng.uniform(1e-4, 5e-2);
    c.barometer_sigma_m = rng.uniform(0.2, 1.0);
    c.gate_sigma = rng.uniform(3.0, 8.0);
    c.drift_ratio = rng.uniform(0.005, 0.05);
    return c;
  }
  Vector3 random(double most) {
    return {rng_.uniform(-most, most), rng_.uniform(-most, most), rng_.uniform(-most, most)};
  }
  void begin_fault() {
    fault_ =
        static_cast<Fault>(1 + static_cast<int>(rng_.uniform(0.0, static_cast<int>(Fault::kCount) - 1.0001)));
    const bool is_brief = fault_ == Fault::kLeap || fault_ == Fault::kHuge;
    const double lasts_s = is_brief ? rng_.uniform(0.002, 0.02)
                           : fault_ == Fault::kSilence && rng_.uniform(0, 1) < 0.2
                               ? 0.4975  // half a second without
                           : fault_ == Fault::kSilence && rng_.uniform(0, 1) < 0.5 ? rng_.uniform(0.01, 0.1)
                           : fault_ == Fault::kSilence                             ? rng_.uniform(0.1, 0.7)
                                                                                   : rng_.uniform(0.1, 3.0);
    what_ = static_cast<int>(rng_.uniform(0.0, 5.999));
    fault_until_ = k_ + static_cast<int>(std::lround(lasts_s / kStep_s));
    leap_after_ = fault_ == Fault::kSilence && rng_.uniform(0.0, 1.0) < 0.3;
    by_ = random(rng_.uniform(0.1, 9.0));
    if (fault_ == Fault::kClockSet) clock_ += Nanos{static_cast<std::int64_t>(by_.x() * 1e9)};
    if (fault_ == Fault::kOdometryBegins) ++reset_counter_;
    if ((fault_ == Fault::kOdometryBegins && what_ > 0) || fault_ == Fault::kOdometryJumps) {
      p_WO_ += by_;
      q_WO_ = judge::times(judge::turned_by({0.0, 0.0, 0.1 * by_.x()}), q_WO_);
    }
  }
  void move() {
    const double t = k_ * kStep_s;
    w_B_ = {0.3 * std::sin(1.1 * t), 0.3 * std::cos(0.9 * t), 0.6 * std::sin(0.4 * t)};
    a_W_ = {2.0 * std::sin(0.7 * t), -2.0 * std::cos(0.8 * t), 0.8 * std::sin(1.3 * t)};
    q_WB_ = judge::times(q_WB_, judge::turned_by(kStep_s * w_B_));
    p_W_ += kStep_s * v_W_ + 0.5 * kStep_s * kStep_s * a_W_;
    v_W_ += kStep_s * a_W_;
  }
  [[nodiscard]] MonotonicTime now() const { return MonotonicTime{} + clock_ + k_ * Nanos{2'500'000}; }
  [[nodiscard]] MonotonicTime late(double most_s) {
    const double by_s = rng_.uniform(0.0, fault_ == Fault::kLate ? 6.0 * most_s : most_s);
    const double s = k_ < 400 && rng_.uniform(0.0, 1.0) < 0.2 ? rng_.uniform(-0.5, 1.0)
                     : is_prompt_ && fault_ != Fault::kLate   ? 0.0
                                                              : by_s;
    return now() - Nanos{static_cast<std::int64_t>(s * 1e9)};
  }
  void hear_imu() {
    firmware_if::ImuSample s;
    s.stamp = now();
    Vector3 rate = w_B_ + gyro_bias_ + random(0.01);
    Vector3 force = judge::rotated(q_WB_.conjugate(), a_W_ + Vector3(0, 0, 9.81)) + force_bias_ + random(0.1);
    if (fault_ == Fault::kLeap || leap_after_) {
      if (what_ < 4) rate += (what_ < 2 ? 20.0 : 2.0) * by_;
      if (what_ > 1) force += (what_ < 4 ? 100.0 : 10.0) * by_;
      leap_after_ = false;
    }
    if (fault_ == Fault::kFalls || (falls_ && k_ < 600)) force *= 0.06 * what_;
    if (fault_ == Fault::kHuge) force *= 1e200 * by_.x();
    if (fault_ == Fault::kGarbage && by_.y() > 0.0) rate.y() = kNotKnown;
    if (fault_ == Fault::kGarbage && by_.y() < 0.0) force.x() = kNotKnown;
    if (fault_ == Fault::kOddTimes && k_ % 2 == 0) s.stamp -= Nanos{6'000'000};
    s.angular_rate_B_radps = numbers(rate);
    s.specific_force_B_mps2 = numbers(force);
    for (int times = fault_ == Fault::kRepeats ? 2 : 1; times > 0; --times)
      compare("imu", sut_.predict(s), judge_.predict(s));
  }
  void hear_fix() {
    if (fault_ == Fault::kFixSilent) return;
    firmware_if::GnssFix fix;
    fix.stamp = late(0.08);
    Vector3 p = p_W_ + random(sigma_m_), v = v_W_ + random(0.05);
    double heading = core::yaw_of(q_WB_);
    if (fault_ == Fault::kFixJumps) p += 0.5 * by_;
    if (fault_ == Fault::kFixSpeed) p += by_;
    if (fault_ == Fault::kFixSpeed) v += by_;
    if (fault_ == Fault::kHeading)
      heading = core::wrap_angle(heading + 0.3 * by_.x() + rng_.uniform(-0.01, 0.01));
    if (fault_ == Fault::kFixStuck) p = stuck_W_;
    if (fault_ == Fault::kHeadingStuck) heading = stuck_rad_;
    stuck_W_ = p;
    stuck_rad_ = heading;
    fix.p_WB_m = numbers(p);
    fix.v_WB_mps = numbers(v);
    fix.heading_rad = has_heading_ || k_ < 400 ? heading : kNotKnown;
    fix.sigma_horizontal_m = sigma_m_ * rng_.uniform(0.5, 1.0);
    fix.sigma_vertical_m = sigma_m_ * rng_.uniform(0.5, 1.5);
    fix.sigma_speed_mps = 0.05;
    fix.sigma_heading_rad = fault_ == Fault::kGarbage ? 0.0 : 0.02;
    if (fault_ == Fault::kHeading && what_ < 2 && k_ % 120 == 0) fix.heading_rad = kNotKnown;
    if (fault_ == Fault::kGarbage) {
      const std::array garbled{&fix.sigma_horizontal_m, &fix.sigma_vertical_m, &fix.sigma_speed_mps,
                               &fix.v_WB_mps[1],        &fix.p_WB_m[2],        &fix.sigma_heading_rad};
      *garbled.at(static_cast<std::size_t>(what_)) = kNotKnown;
    }
    for (int times = fault_ == Fault::kRepeats || k_ < 50 ? 2 : 1; times > 0; --times)
      compare("fix", sut_.update(fix), judge_.update(fix));
  }
  void hear_odometry() {
    if (fault_ == Fault::kOdometrySilent) return;
    firmware_if::OdometrySample s;
    s.stamp = late(0.04);
    s.reset_counter = reset_counter_;
    const Quaternion q_OW = q_WO_.conjugate();
    s.p_OB_m = numbers(judge::rotated(q_OW, p_W_ - p_WO_) + random(0.02));
    s.v_OB_mps = numbers(judge::rotated(q_OW, v_W_) + random(0.05));
    Quaternion q = judge::times(judge::times(q_OW, q_WB_), judge::turned_by(random(0.005)));
    if (fault_ == Fault::kOdometryTurns) q = judge::times(judge::turned_by(0.05 * by_), q);
    const double sign = by_.z() > 0.0 ? -1.0 : 1.0;  // both are the same rotation
    s.q_OB = {sign * q.w(), sign * q.x(), sign * q.y(), sign * q.z()};
    s.sigma_position_m = rng_.uniform(0.01, 0.05);
    s.sigma_attitude_rad = fault_ == Fault::kOdometryTurns ? 0.2 : rng_.uniform(0.002, 0.02);
    s.sigma_speed_mps = rng_.uniform(0.02, 0.1);
    if (fault_ == Fault::kGarbage) s.p_OB_m[2] = kNotKnown;
    for (int times = fault_ == Fault::kRepeats || k_ < 50 ? 2 : 1; times > 0; --times)
      compare("odometry", sut_.update(s), judge_.update(s));
  }
  void hear_barometer() {
    firmware_if::BarometerSample b;
    b.stamp = late(0.02);
    b.altitude_m = p_W_.z() + rng_.uniform(-0.3, 0.3) + (fault_ == Fault::kBarometer ? 3.0 * by_.z() : 0.0);
    if (fault_ == Fault::kGarbage) b.altitude_m = kNotKnown;
    for (int times = fault_ == Fault::kRepeats || k_ < 50 ? 2 : 1; times > 0; --times)
      compare("barometer", sut_.update(b), judge_.update(b));
  }
  void compare(const char* what, Status ours, Status wanted) {
    ASSERT_EQ(ours, wanted) << what << ", step " << k_;
    const auto list = [](const Estimator::Counters& n) {
      return std::array{n.imu,           n.gnss,         n.barometer, n.odometry, n.refused_not_finite,
                        n.refused_stamp, n.refused_gate, n.anchored,  n.jumps,    n.resets,
                        n.clock_resets};
    };
    ASSERT_EQ(list(sut_.counters()), list(judge_.n)) << what << ", step " << k_;
    EstimatedState a, b;
    ASSERT_EQ(sut_.state(a), judge_.state(b)) << what << ", step " << k_;
    ASSERT_EQ(a.stamp, b.stamp);
    ASSERT_EQ(a.map_number, b.map_number) << what << ", step " << k_;
    ASSERT_EQ(a.drift_ratio, b.drift_ratio);
    const auto near = [&](const char* of, double x, double y, double unit) {
      ASSERT_LE(std::abs(x - y), kTolerance * (unit + std::abs(y))) << of << ", " << what << ", step " << k_;
    };
    for (int i = 0; i < 3; ++i) {
      near("place", a.p_WB[i], b.p_WB[i], 1.0);
      near("speed", a.v_WB[i], b.v_WB[i], 1.0);
      near("rate", a.w_WB_B[i], b.w_WB_B[i], 1.0);
      near("shift", a.shift_W[i], b.shift_W[i], 1.0);
    }
    for (int i = 0; i < 4; ++i) near("attitude", a.q_WB.coeffs()[i], b.q_WB.coeffs()[i], 1.0);
    near("sigma of the place", a.position_sigma_m, b.position_sigma_m, 1.0);
    near("sigma in the map", a.map_sigma_m, b.map_sigma_m, 1.0);
    near("sigma of the attitude", a.map_sigma_rad, b.map_sigma_rad, 1.0);
  }
  static constexpr double kTolerance = 1e-9;

  core::CounterRng rng_;
  Estimator::Config config_;
  Estimator sut_;
  judge::Estimator judge_;
  bool has_fixes_{}, has_odometry_{}, has_heading_{};
  bool is_prompt_{}, falls_{}, leap_after_{false};
  int odometry_every_{}, what_{0};
  double stuck_rad_{0.0};
  double sigma_m_{}, faults_per_s_{};
  int k_{0}, fault_until_{0};
  Fault fault_{Fault::kNone};
  Vector3 by_{0, 0, 0};
  Nanos clock_{1'000'000'000};
  Vector3 p_W_{1, 2, 5}, v_W_{0, 0, 0}, w_B_{0, 0, 0}, a_W_{0, 0, 0};
  Quaternion q_WB_ = Quaternion::Identity();
  Vector3 gyro_bias_, force_bias_, stuck_W_{0, 0, 0}, p_WO_{0, 0, 0};
  Quaternion q_WO_ = Quaternion::Identity();
  std::uint8_t reset_counter_{0};
};

TEST(Estimator, DecidesAsASecondOneOfTheSameRules) {
  Estimator::Counters seen{};
  for (std::uint32_t seed = 1; seed <= 400; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Flight flight(seed);
    flight.run(20.0);
    if (HasFailure()) return;
    const Estimator::Counters& n = flight.counters();
    seen.anchored += n.anchored;
    seen.jumps += n.jumps;
    seen.resets += n.resets;
    seen.clock_resets += n.clock_resets;
  }
  EXPECT_GE(seen.anchored, 20U);
  EXPECT_GE(seen.jumps, 10U);
  EXPECT_GE(seen.resets, 20U);
  EXPECT_GE(seen.clock_resets, 5U);
}

}  // namespace
}  // namespace roborun::stages
