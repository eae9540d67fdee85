// The estimator under fire: every sensor fails in every way in every phase of a flight and is healthy afterwards. Two seconds
// later the state has to be healthy, too, and take what the sensors say. ROBORUN_FIRE_TABLE=1 prints all cells.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "core/geometry/math.hpp"
#include "core/geometry/yaw.hpp"
#include "core/random/counter_rng.hpp"
#include "firmware_if/time.hpp"
#include "stages/control/estimator.hpp"

namespace roborun::stages {
namespace {

constexpr Nanos kPeriod{2'500'000};
constexpr double kPeriod_s = 0.0025;
constexpr double kFault_s = 8.0;    // when the fault begins
constexpr double kHealthy_s = 2.0;  // after its end: the state is healthy
constexpr double kOpen_s = 3.0;     // after its end: all gates are open
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
// The bounds of a healthy state. Position: of the place on the earth where fixes are heard, otherwise of the flown frame.
constexpr double kMost_m = 0.5, kMost_mps = 0.5, kMostAngle_rad = 0.12;
constexpr double kLeastTaken = 0.3;  // of the samples of the second after kOpen_s

enum class Phase { kHover, kCruise, kTurn };
enum class Rig { kGnss, kGnssOdometry, kOdometry };
enum class Sensor {
  kAccelerometer,
  kGyro,
  kImu,  ///< Both.
  kGnssPosition,
  kGnssVelocity,
  kHeading,
  kGnss,  ///< All three.
  kBarometer,
  kOdometry
};
enum class Kind { kOff, kStuck, kGarbage, kSpike, kBias, kDrift, kLate, kSlow, kClock };

constexpr std::array kPhaseNames{"hover", "cruise", "turn"};
constexpr std::array kRigNames{"gnss", "gnss+odometry", "odometry"};
constexpr std::array kSensorNames{"accelerometer", "gyro", "imu",       "gnss position", "gnss velocity",
                                  "heading",       "gnss", "barometer", "odometry"};
constexpr std::array kKindNames{"off", "stuck", "garbage", "spike", "bias", "drift", "late", "slow", "clock"};

struct Fault {
  Sensor sensor;
  Kind kind;
  double lasts_s;
  double size;  ///< In the sensor's unit: spike, bias, drift per second; of the clock: seconds.
};

struct Truth {
  MonotonicTime stamp{};
  Vector3 p_W = Vector3::Zero(), v_W = Vector3::Zero(), a_W = Vector3::Zero();
  Quaternion q_WB = Quaternion::Identity();
  Vector3 w_B = Vector3::Zero();
};

double since(double t_s, double from_s, double lasts_s) {
  return std::fmin(std::fmax((t_s - from_s) / lasts_s, 0.0), 1.0);
}

/// One flight: a hover; or a second of rest, then 5 m/s straight on; or that and then turns which brake and speed up. The
/// thrust, and with it the body's axis, points where it has to for the acceleration.
std::vector<Truth> fly(Phase phase, double until_s) {
  std::vector<Truth> all;
  Truth x;
  x.p_W = {0.0, 0.0, 5.0};
  const auto steps = static_cast<int>(until_s / kPeriod_s);
  for (int k = 0; k <= steps; ++k) {
    const double t = k * kPeriod_s;
    Vector3 a = Vector3::Zero();
    double yaw = 0.2;
    if (phase != Phase::kHover) {
      const double s = since(t, 1.0, 3.0);
      a.x() = 5.0 / 3.0 * (1.0 - core::cos(2.0 * core::kPi * s));  // to 5 m/s
    }
    if (phase == Phase::kTurn && t > 4.0) {
      const double s = t - 4.0;
      const double in = since(s, 0.0, 1.0);
      a = in * Vector3(-2.0 * core::sin(0.8 * s), 2.5 * core::cos(0.9 * s), 0.5 * core::sin(1.3 * s));
      yaw += 0.8 * core::sin(0.7 * s) * in;
    }
    const Vector3 up = (a + Vector3(0.0, 0.0, core::kGravity_mps2)).normalized();
    const Vector3 axis = Vector3(0.0, 0.0, 1.0).cross(up);
    const Quaternion tilt = Quaternion(1.0 + up.z(), axis.x(), axis.y(), axis.z()).normalized();
    const Quaternion q = tilt * core::turn_z(yaw);
    if (k > 0) {
      const Quaternion turn = x.q_WB.conjugate() * q;
      x.w_B = 2.0 / kPeriod_s * turn.vec();
      x.p_W += kPeriod_s * x.v_W + 0.5 * kPeriod_s * kPeriod_s * a;
      x.v_W += kPeriod_s * a;
    }
    x.stamp = MonotonicTime{} + k * kPeriod;
    x.q_WB = q;
    x.a_W = a;
    all.push_back(x);
  }
  return all;
}

std::array<double, 3> array(const Vector3& v) { return {v.x(), v.y(), v.z()}; }

/// The sensors of one flight, their fault, and the estimator that hears them.
class Range {
 public:
  Estimator estimator{{}};

  Range(const std::vector<Truth>& truth, Rig rig) : truth_(&truth), rig_(rig) {}
  /// The fault begins now.
  void begin(const Fault& fault) {
    fault_ = fault;
    begun_ = k_;
  }
  void run(double until_s) {
    while (k_ * kPeriod_s < until_s && k_ + 1 < static_cast<int>(truth_->size())) {
      ++k_;
      hear_imu();
      if (rig_ != Rig::kGnss && k_ % 13 == 0) hear_odometry();
      if (rig_ != Rig::kOdometry && k_ % 40 == 0) hear_fix();
      if (k_ % 8 == 0) hear_barometer();
    }
  }
  struct Verdict {
    bool has_state{};
    double earth_m{kNaN};                       ///< Of the place on the earth.
    Vector3 flown_W = Vector3::Constant(kNaN);  ///< Of the place in the frame that is flown and mapped in.
    double v_mps{kNaN}, tilt_rad{kNaN}, yaw_rad{kNaN};
    std::uint32_t map_number{};
  };
  [[nodiscard]] Verdict verdict() const {
    Verdict out;
    EstimatedState s;
    if (estimator.state(s) != Status::kOk) return out;
    const Truth& x = truth_->at(static_cast<std::size_t>(k_));
    out.has_state = s.stamp == x.stamp;
    out.flown_W = s.p_WB - x.p_W;
    out.earth_m = (out.flown_W + s.shift_W).norm();
    out.v_mps = (s.v_WB - x.v_W).norm();
    const Vector3 up = s.q_WB.toRotationMatrix().col(2), up_true = x.q_WB.toRotationMatrix().col(2);
    out.tilt_rad = core::atan2(up.cross(up_true).norm(), up.dot(up_true));
    out.yaw_rad = std::fabs(core::wrap_angle(core::yaw_of(s.q_WB) - core::yaw_of(x.q_WB)));
    out.map_number = s.map_number;
    return out;
  }
  void count_from_now() { taken_fixes_ = taken_samples_ = fixes_ = samples_ = 0; }
  /// Of what was said since: the lesser of fixes and odometry.
  [[nodiscard]] double taken_ratio() const {
    const auto ratio = [](int taken, int all) { return all == 0 ? 1.0 : static_cast<double>(taken) / all; };
    return std::fmin(ratio(taken_fixes_, fixes_), ratio(taken_samples_, samples_));
  }

 private:
  [[nodiscard]] bool fails(Sensor sensor) const {
    return fault_ && fault_->sensor == sensor && (k_ - begun_) * kPeriod_s <= fault_->lasts_s + 1e-9;
  }
  [[nodiscard]] bool fails(Sensor sensor, Kind kind) const { return fails(sensor) && fault_->kind == kind; }
  /// Whether the n-th sample of this sensor is lost.
  [[nodiscard]] bool lost(Sensor sensor, int n) const {
    return fails(sensor, Kind::kOff) || (fails(sensor, Kind::kSlow) && n % 10 != 0);
  }
  [[nodiscard]] int late(Sensor sensor) const {
    return fails(sensor, Kind::kLate) ? static_cast<int>(fault_->size / kPeriod_s) : 0;
  }
  [[nodiscard]] Nanos clock_error(Sensor sensor) const {
    return fails(sensor, Kind::kClock) ? from_seconds(fault_->size) : Nanos{0};
  }
  [[nodiscard]] const Truth& then(int late) const { return truth_->at(static_cast<std::size_t>(k_ - late)); }

  /// What the fault makes of three numbers. `range`: of the sensor.
  void spoil(std::array<double, 3>& x, const std::array<double, 3>& before, double range, std::size_t axis) {
    if (fault_->kind == Kind::kStuck) x = before;
    if (fault_->kind == Kind::kGarbage)
      for (double& each : x) each = rng_.below(8) == 0 ? kNaN : rng_.uniform(-range, range);
    if (fault_->kind == Kind::kBias || (fault_->kind == Kind::kSpike && !spiked_)) x[axis] += fault_->size;
    if (fault_->kind == Kind::kDrift) x[axis] += fault_->size * (k_ - begun_) * kPeriod_s;
    spiked_ = true;
  }
  void hear_imu() {
    // What was late comes at once when it is no longer.
    const int until = k_ - late(Sensor::kImu);
    if (lost(Sensor::kImu, k_)) imu_at_ = until;
    while (imu_at_ < until) hear_imu(truth_->at(static_cast<std::size_t>(++imu_at_)));
  }
  void hear_imu(const Truth& x) {
    firmware_if::ImuSample s;
    const Vector3 force_W = x.a_W + Vector3(0.0, 0.0, core::kGravity_mps2);
    s.stamp = x.stamp + clock_error(Sensor::kImu);
    s.angular_rate_B_radps = array(x.w_B + Vector3(0.003, -0.002, 0.002));
    s.specific_force_B_mps2 = array(x.q_WB.conjugate() * force_W + Vector3(0.05, -0.04, 0.06));
    for (double& each : s.angular_rate_B_radps) each += 0.001 * rng_.normal();
    for (double& each : s.specific_force_B_mps2) each += 0.03 * rng_.normal();
    const firmware_if::ImuSample fresh = s;
    const bool accel = fails(Sensor::kAccelerometer), gyro = fails(Sensor::kGyro), both = fails(Sensor::kImu);
    if (fails(Sensor::kAccelerometer, Kind::kOff)) s.specific_force_B_mps2 = {};
    if (fails(Sensor::kGyro, Kind::kOff)) s.angular_rate_B_radps = {};
    if (accel || both) spoil(s.specific_force_B_mps2, imu_.specific_force_B_mps2, 157.0, 0);
    if (gyro || both) spoil(s.angular_rate_B_radps, imu_.angular_rate_B_radps, 35.0, 0);
    if (!accel && !gyro && !both) imu_ = fresh;
    (void)estimator.predict(s);
  }
  void hear_fix() {
    const int behind = 40 + late(Sensor::kGnss);
    if (k_ < behind) return;
    const Truth& x = then(behind);
    firmware_if::GnssFix f;
    f.stamp = x.stamp + clock_error(Sensor::kGnss);
    f.p_WB_m = array(x.p_W);
    f.v_WB_mps = array(x.v_W);
    for (double& each : f.p_WB_m) each += 0.015 * rng_.normal();
    for (double& each : f.v_WB_mps) each += 0.03 * rng_.normal();
    f.heading_rad = core::wrap_angle(core::yaw_of(x.q_WB) + 0.01 * rng_.normal());
    f.sigma_horizontal_m = 0.02;
    f.sigma_vertical_m = 0.03;
    f.sigma_speed_mps = 0.05;
    f.sigma_heading_rad = 0.015;
    const firmware_if::GnssFix fresh = f;
    const bool all = fails(Sensor::kGnss);
    if (all || fails(Sensor::kGnssPosition)) spoil(f.p_WB_m, fix_.p_WB_m, 1e4, 1);
    if ((all && fault_->kind != Kind::kDrift) || fails(Sensor::kGnssVelocity))
      spoil(f.v_WB_mps, fix_.v_WB_mps, 50.0, 1);
    if (fails(Sensor::kGnss, Kind::kDrift)) f.v_WB_mps[1] += fault_->size;  // as a spoofer would say it
    if (all || fails(Sensor::kHeading)) {
      std::array<double, 3> heading{f.heading_rad, 0.0, 0.0};
      if (fault_->kind != Kind::kDrift || !all) spoil(heading, {fix_.heading_rad, 0.0, 0.0}, 3.0, 0);
      f.heading_rad = heading[0];
    }
    if (!fails(Sensor::kGnss) && !fails(Sensor::kGnssPosition) && !fails(Sensor::kGnssVelocity) &&
        !fails(Sensor::kHeading))
      fix_ = fresh;
    ++fixes_;
    if (lost(Sensor::kGnss, k_ / 40)) return;
    if (estimator.update(f) == Status::kOk) ++taken_fixes_;
  }
  void hear_odometry() {
    const int behind = 16 + late(Sensor::kOdometry);
    if (k_ < behind) return;
    const Truth& x = then(behind);
    const Quaternion q_OW = rig_ == Rig::kOdometry ? Quaternion::Identity() : core::turn_z(1.0);
    const Quaternion q_OB = q_OW * x.q_WB;
    firmware_if::OdometrySample o;
    o.stamp = x.stamp + clock_error(Sensor::kOdometry);
    o.p_OB_m = array(q_OW * x.p_W);
    o.v_OB_mps = array(q_OW * x.v_W);
    for (double& each : o.p_OB_m) each += 0.004 * rng_.normal();
    for (double& each : o.v_OB_mps) each += 0.02 * rng_.normal();
    o.q_OB = {q_OB.w(), q_OB.x(), q_OB.y(), q_OB.z()};
    o.sigma_position_m = 0.02;
    o.sigma_attitude_rad = 0.01;
    o.sigma_speed_mps = 0.05;
    const firmware_if::OdometrySample fresh = o;
    if (fails(Sensor::kOdometry)) {
      spoil(o.p_OB_m, odometry_.p_OB_m, 1e3, 1);
      if (fault_->kind == Kind::kStuck || fault_->kind == Kind::kGarbage)
        spoil(o.v_OB_mps, odometry_.v_OB_mps, 50.0, 1);
      if (fault_->kind == Kind::kStuck) o.q_OB = odometry_.q_OB;
      if (fault_->kind == Kind::kDrift) o.v_OB_mps[1] += fault_->size;
    } else {
      odometry_ = fresh;
    }
    ++samples_;
    if (lost(Sensor::kOdometry, k_ / 13)) return;
    if (estimator.update(o) == Status::kOk) ++taken_samples_;
  }
  void hear_barometer() {
    const int behind = late(Sensor::kBarometer);
    if (k_ < behind || lost(Sensor::kBarometer, k_ / 8)) return;
    const Truth& x = then(behind);
    std::array<double, 3> z{x.p_W.z() + 0.2 * rng_.normal(), 0.0, 0.0};
    if (fails(Sensor::kBarometer))
      spoil(z, {altitude_m_, 0.0, 0.0}, 1e4, 0);
    else
      altitude_m_ = z[0];
    firmware_if::BarometerSample b;
    b.stamp = x.stamp + clock_error(Sensor::kBarometer);
    b.altitude_m = z[0];
    (void)estimator.update(b);
  }

  const std::vector<Truth>* truth_;
  Rig rig_;
  std::optional<Fault> fault_;
  int k_{0}, begun_{0}, imu_at_{0};
  bool spiked_{false};
  // The last ones before the fault.
  firmware_if::ImuSample imu_{};
  firmware_if::GnssFix fix_{};
  firmware_if::OdometrySample odometry_{};
  double altitude_m_{0.0};
  int fixes_{0}, samples_{0}, taken_fixes_{0}, taken_samples_{0};
  core::CounterRng rng_{11};
};

std::vector<Fault> faults() {
  using S = Sensor;
  using K = Kind;
  std::vector<Fault> all;
  for (const S sensor : {S::kAccelerometer, S::kGyro, S::kImu, S::kGnssPosition, S::kGnssVelocity,
                         S::kHeading, S::kGnss, S::kBarometer, S::kOdometry}) {
    for (const double lasts_s : {0.02, 0.05, 0.5, 5.0}) all.push_back({sensor, K::kGarbage, lasts_s, 0.0});
    for (const double lasts_s : {0.2, 3.0}) all.push_back({sensor, K::kStuck, lasts_s, 0.0});
  }
  for (const S sensor : {S::kImu, S::kGnss, S::kBarometer, S::kOdometry}) {
    for (const double lasts_s : {0.05, 0.3, 3.0}) all.push_back({sensor, K::kOff, lasts_s, 0.0});
    for (const double late_s : {0.05, 0.2, 0.6}) all.push_back({sensor, K::kLate, 3.0, late_s});
    all.push_back({sensor, K::kSlow, 3.0, 0.0});
    for (const double error_s : {0.2, -0.2, 3600.0, -3600.0}) {
      all.push_back({sensor, K::kClock, 0.02, error_s});
      all.push_back({sensor, K::kClock, 3.0, error_s});
    }
  }
  for (const S sensor : {S::kAccelerometer, S::kGyro}) {
    all.push_back({sensor, K::kOff, 0.05, 0.0});
    all.push_back({sensor, K::kOff, 3.0, 0.0});
  }
  const auto sized = [&all](S sensor, double spike, std::initializer_list<double> biases,
                            std::initializer_list<double> drifts) {
    all.push_back({sensor, K::kSpike, 0.1, spike});
    for (const double bias : biases) all.push_back({sensor, K::kBias, 3.0, bias});
    for (const double drift : drifts)
      for (const double lasts_s : {2.0, 5.0}) all.push_back({sensor, K::kDrift, lasts_s, drift});
  };
  sized(S::kAccelerometer, 150.0, {0.3, 2.0, 10.0}, {0.1, 2.0});
  sized(S::kGyro, 30.0, {0.02, 0.5, 3.0}, {0.01, 0.3});
  sized(S::kGnssPosition, 1000.0, {0.1, 2.0, 30.0}, {0.1, 0.5, 1.0, 2.0});
  sized(S::kGnssVelocity, 30.0, {0.2, 1.0, 5.0}, {0.1, 1.0});
  sized(S::kHeading, 2.0, {0.05, 0.5, 3.0}, {0.02, 0.3});
  sized(S::kGnss, 1000.0, {}, {0.1, 0.5, 1.0, 2.0});
  sized(S::kBarometer, 1000.0, {2.0, 30.0}, {0.1, 0.5, 1.0, 2.0});
  sized(S::kOdometry, 100.0, {0.1, 2.0, 30.0}, {0.1, 0.5, 1.0, 2.0});
  return all;
}

bool has(Rig rig, Sensor sensor) {
  if (sensor == Sensor::kOdometry) return rig != Rig::kGnss;
  const bool of_fixes = sensor == Sensor::kGnssPosition || sensor == Sensor::kGnssVelocity ||
                        sensor == Sensor::kHeading || sensor == Sensor::kGnss;
  return !of_fixes || rig != Rig::kOdometry;
}

std::string name_of(const Fault& f) {
  return fmt::format("{} {} {:g} s, {:g}", kSensorNames.at(static_cast<std::size_t>(f.sensor)),
                     kKindNames.at(static_cast<std::size_t>(f.kind)), f.lasts_s, f.size);
}

/// How far a source may carry the flown frame along without anybody being able to know: what is as slow as this passes for
/// motion that the inertial sensors are too coarse to feel. Fixes that drift against odometry carry it nowhere.
double drift_that_nobody_can_tell_m(const Fault& fault, Rig rig) {
  const bool holds_the_frame =
      fault.sensor == Sensor::kOdometry ||
      (rig == Rig::kGnss && (fault.sensor == Sensor::kGnss || fault.sensor == Sensor::kGnssPosition));
  return holds_the_frame && fault.kind == Kind::kDrift && fault.size <= 0.1 ? fault.size * fault.lasts_s
                                                                            : 0.0;
}

class UnderFire : public testing::TestWithParam<std::tuple<Phase, Rig>> {};

TEST_P(UnderFire, HealthySensorsMeanAHealthyStateTwoSecondsLater) {
  const auto [phase, rig] = GetParam();
  const bool prints = std::getenv("ROBORUN_FIRE_TABLE") != nullptr;
  const std::vector<Truth> truth = fly(phase, kFault_s + 5.0 + kOpen_s + 1.1);
  Range settled(truth, rig);
  settled.run(kFault_s);
  const Range::Verdict before = settled.verdict();
  ASSERT_TRUE(before.has_state);
  ASSERT_LT(before.earth_m, 0.1);
  ASSERT_LT(before.tilt_rad, 0.02);
  ASSERT_EQ(before.map_number, 0U);
  int cells = 0;
  for (const Fault& fault : faults()) {
    if (!has(rig, fault.sensor)) continue;
    ++cells;
    Range sut = settled;
    sut.begin(fault);
    sut.run(kFault_s + fault.lasts_s);
    const Range::Verdict at_end = sut.verdict();
    sut.run(kFault_s + fault.lasts_s + kHealthy_s);
    const Range::Verdict after = sut.verdict();
    sut.run(kFault_s + fault.lasts_s + kOpen_s);
    sut.count_from_now();
    sut.run(kFault_s + fault.lasts_s + kOpen_s + 1.0);
    const double flown_m = (after.flown_W - before.flown_W).norm();
    // What is flown and mapped in may lie elsewhere than before, but then it says so; unless nobody can know it.
    const double drifted_m = drift_that_nobody_can_tell_m(fault, rig);
    const bool stayed = flown_m < kMost_m + drifted_m || after.map_number != before.map_number;
    const bool placed = rig == Rig::kOdometry || after.earth_m < kMost_m;
    const bool healthy = after.has_state && stayed && placed && after.v_mps < kMost_mps &&
                         after.tilt_rad < kMostAngle_rad && after.yaw_rad < kMostAngle_rad &&
                         sut.taken_ratio() >= kLeastTaken;
    const std::string line = fmt::format(
        "{:<7}{:<14}{:<32} at the end: {:8.2f} m {:6.2f} m/s {:5.2f} rad | 2 s later: earth {:5.2f} m, flown "
        "{:5.2f} m, "
        "{:5.2f} m/s, tilt {:5.3f}, yaw {:5.3f} rad, taken {:3.0f} %, map {}, resets {} {}",
        kPhaseNames.at(static_cast<std::size_t>(phase)), kRigNames.at(static_cast<std::size_t>(rig)),
        name_of(fault), at_end.earth_m, at_end.v_mps, at_end.tilt_rad, after.earth_m, flown_m, after.v_mps,
        after.tilt_rad, after.yaw_rad, 100.0 * sut.taken_ratio(), after.map_number,
        sut.estimator.counters().resets, healthy ? "" : "FAILS");
    if (prints) fmt::print("{}\n", line);
    EXPECT_TRUE(healthy) << line;
  }
  EXPECT_GT(cells, 60);
}

std::string cell_name(const testing::TestParamInfo<std::tuple<Phase, Rig>>& cell) {
  constexpr std::array kPhases{"Hover", "Cruise", "Turn"}, kRigs{"Gnss", "GnssOdometry", "Odometry"};
  return std::string(kPhases.at(static_cast<std::size_t>(std::get<0>(cell.param)))) +
         kRigs.at(static_cast<std::size_t>(std::get<1>(cell.param)));
}

INSTANTIATE_TEST_SUITE_P(Estimator, UnderFire,
                         testing::Combine(testing::Values(Phase::kHover, Phase::kCruise, Phase::kTurn),
                                          testing::Values(Rig::kGnss, Rig::kGnssOdometry, Rig::kOdometry)),
                         cell_name);

}  // namespace
}  // namespace roborun::stages
