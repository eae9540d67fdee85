// The fake ArduCopter beside what a real one did: 4.7-dev in its own simulator, a quadrotor with default parameters,
// set-points at 20 Hz with the yaw held. Within 10 %.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/platform/sitl/autopilot/bench.hpp"

namespace roborun::test {
namespace {

constexpr std::uint16_t kVelocityYaw = 0x9C7;
constexpr std::uint16_t kPositionYaw = 0x9F8;

/// A real quadrotor that leans up to 30 degrees.
VehicleModel quad() {
  VehicleModel vehicle;
  vehicle.speed_mps = 10.0;
  return vehicle;
}

void expect_near(const char* what, double measured, double real) {
  fmt::print("{:<34} {:7.2f}   real {:7.2f}   {:+5.1f} %\n", what, measured, real,
             100.0 * (measured / real - 1.0));
  EXPECT_NEAR(measured, real, 0.10 * real) << what;
}

/// Times at which the speed along x has gone 10, 50, 63 and 90 % of the way from `from` to `to` m/s.
std::array<double, 4> step_times(AutopilotBench& sut, double from_mps, double to_mps) {
  sut.run(6.0, [&] { sut.set_point(kVelocityYaw, Vector3::Zero(), {from_mps, 0.0, 0.0}); });
  constexpr std::array<double, 4> kShare{0.1, 0.5, 0.63, 0.9};
  std::array<double, 4> at_s{};
  const double start_s = sut.now_s();
  std::size_t next = 0;
  for (int i = 0; i < 400 * 8 && next < at_s.size(); ++i) {
    if (i % 20 == 0) sut.set_point(kVelocityYaw, Vector3::Zero(), {to_mps, 0.0, 0.0});
    sut.step();
    const double share = (sut.truth().v_WB.x() - from_mps) / (to_mps - from_mps);
    while (next < at_s.size() && share >= kShare.at(next)) at_s.at(next++) = sut.now_s() - start_s;
  }
  return at_s;
}

void expect_step(double from_mps, double to_mps, const std::array<double, 4>& real_s) {
  AutopilotBench sut(mav::AutopilotKind::kArduCopter, quad());
  sut.take_off();
  ASSERT_NEAR(sut.truth().p_WB.z(), 10.0, 0.6);
  const auto at_s = step_times(sut, from_mps, to_mps);
  constexpr std::array<const char*, 4> kName{"10 %", "50 %", "63 %", "90 %"};
  for (std::size_t i = 0; i < 4; ++i)
    expect_near(fmt::format("step {:g} -> {:g} m/s, {} s", from_mps, to_mps, kName.at(i)).c_str(), at_s.at(i),
                real_s.at(i));
}

TEST(FakeArduCopter, AnswersStepsOfTheVelocityAsARealOne) {
  expect_step(0.0, 2.0, {0.40, 0.76, 0.88, 1.40});
  expect_step(2.0, 5.0, {0.46, 0.94, 1.10, 1.80});
  expect_step(0.0, 9.0, {0.70, 2.14, 2.64, 3.78});
}

TEST(FakeArduCopter, BrakesAsARealOne) {
  AutopilotBench sut(mav::AutopilotKind::kArduCopter, quad());
  sut.take_off();
  sut.run(8.0, [&] { sut.set_point(kVelocityYaw, Vector3::Zero(), {9.0, 0.0, 0.0}); });
  const double x_m = sut.truth().p_WB.x();
  const double start_s = sut.now_s();
  double ninety_s = 0.0;
  double farthest_m = 0.0;
  sut.run(8.0, [&] {
    sut.set_point(kVelocityYaw, Vector3::Zero(), Vector3::Zero());
    if (ninety_s == 0.0 && sut.truth().v_WB.x() < 0.9) ninety_s = sut.now_s() - start_s;
    farthest_m = std::max(farthest_m, sut.truth().p_WB.x() - x_m);
  });
  expect_near("brake 9 -> 0 m/s, 90 % s", ninety_s, 3.54);
  expect_near("brake 9 -> 0 m/s, m", farthest_m, 19.8);
}

void expect_silence(double timeout_s, double begins_s, double stands_s, double distance_m) {
  AutopilotBench sut(mav::AutopilotKind::kArduCopter, quad());
  ASSERT_TRUE(sut.fake().set_parameter("GUID_TIMEOUT", timeout_s));
  sut.take_off();
  sut.run(6.0, [&] { sut.set_point(kVelocityYaw, Vector3::Zero(), {5.0, 0.0, 0.0}); });
  const double x_m = sut.truth().p_WB.x();
  const double start_s = sut.now_s();
  double slower_s = 0.0;
  double still_s = 0.0;
  double farthest_m = 0.0;
  for (int i = 0; i < 400 * 9; ++i) {
    sut.step();
    const double v_mps = sut.truth().v_WB.x();
    if (slower_s == 0.0 && v_mps < 4.5) slower_s = sut.now_s() - start_s;
    if (still_s == 0.0 && v_mps < 0.3) still_s = sut.now_s() - start_s;
    farthest_m = std::max(farthest_m, sut.truth().p_WB.x() - x_m);
  }
  expect_near(fmt::format("GUID_TIMEOUT {:g}: brakes after s", timeout_s).c_str(), slower_s, begins_s);
  expect_near(fmt::format("GUID_TIMEOUT {:g}: stands after s", timeout_s).c_str(), still_s, stands_s);
  expect_near(fmt::format("GUID_TIMEOUT {:g}: m", timeout_s).c_str(), farthest_m, distance_m);
  EXPECT_EQ(sut.fake().mode(), sitl::FakeAutopilot::Mode::kGuided);
}

TEST(FakeArduCopter, FliesOnInSilenceAsARealOne) {
  expect_silence(3.0, 3.5, 5.5, 21.4);
  expect_silence(0.5, 1.0, 3.0, 9.1);
}

TEST(FakeArduCopter, TakesOffAndTurnsAsARealOne) {
  AutopilotBench sut(mav::AutopilotKind::kArduCopter, quad());
  sut.run(3.5);
  sut.command(176, 1.0F, 4.0F);
  sut.command(400, 1.0F);
  sut.run(3.0, [&] { sut.set_point(kVelocityYaw, Vector3::Zero(), {0.0, 0.0, 2.0}); });
  EXPECT_TRUE(sut.truth().on_ground) << "set-points on the ground do nothing";
  const double ground_m = sut.truth().p_WB.z();
  sut.command(22, 0.0F, 0.0F, 10.0F);
  const double start_s = sut.now_s();
  double risen_s = 0.0;
  sut.run(12.0, [&] {
    if (risen_s == 0.0 && sut.truth().p_WB.z() - ground_m > 9.6) risen_s = sut.now_s() - start_s;
  });
  expect_near("take-off 10 m, 9.6 m after s", risen_s, 7.2);
  double turned_s = 0.0;
  const double turn_s = sut.now_s();
  sut.run(4.0, [&] { sut.set_point(kVelocityYaw, Vector3::Zero(), Vector3::Zero(), 0.0); });
  const double from_s = sut.now_s();
  EXPECT_GT(from_s, turn_s);
  sut.run(4.0, [&] {
    sut.set_point(kVelocityYaw, Vector3::Zero(), Vector3::Zero(), 1.5708);
    const Vector3 nose = sut.truth().q_WB * Vector3::UnitX();
    if (turned_s == 0.0 && std::atan2(nose.y(), nose.x()) > 0.8 * 1.5708) turned_s = sut.now_s() - from_s;
  });
  expect_near("yaw 0 -> 90 deg, 80 % s", turned_s, 1.4);
}

TEST(FakeArduCopter, FollowsASineOfTheVelocityAsLateAsARealOne) {
  AutopilotBench sut(mav::AutopilotKind::kArduCopter, quad());
  sut.take_off();
  constexpr double kOmega = 2.0 * 3.14159265358979 * 0.1;
  const double start_s = sut.now_s();
  // The part of the speed that is in phase with the sine, and that which is a quarter of a turn late.
  double in_phase = 0.0;
  double late = 0.0;
  sut.run(30.0, [&] {
    const double t_s = sut.now_s() - start_s;
    sut.set_point(kVelocityYaw, Vector3::Zero(), {3.0 * std::sin(kOmega * t_s), 0.0, 0.0});
    if (t_s < 10.0) return;
    in_phase += sut.truth().v_WB.x() * std::sin(kOmega * t_s);
    late -= sut.truth().v_WB.x() * std::cos(kOmega * t_s);
  });
  expect_near("sine 3 m/s at 0.1 Hz, lag s", std::atan2(late, in_phase) / kOmega, 0.60);
}

TEST(FakeArduCopter, NeverForgetsAPosition) {
  AutopilotBench sut(mav::AutopilotKind::kArduCopter, quad());
  sut.take_off();
  const Vector3 goal_W = sut.truth().p_WB + Vector3(15.0, 0.0, 0.0);
  sut.run(1.0, [&] { sut.set_point(kPositionYaw, goal_W, Vector3::Zero()); });
  sut.run(14.0);
  EXPECT_NEAR((sut.truth().p_WB - goal_W).norm(), 0.0, 0.5);
}

// What is refused stops it: a place may lie anywhere, a speed may not be any.
TEST(FakeArduCopter, TakesPlacesOfAnyDistanceButNoSpeedBeyond1000) {
  AutopilotBench sut(mav::AutopilotKind::kArduCopter, quad());
  sut.take_off();
  const auto refused = [&sut](std::uint16_t mask, const Vector3& p_W, const Vector3& v_W) {
    const auto before = sut.fake().counters();
    sut.set_point(mask, p_W, v_W);
    const auto after = sut.fake().counters();
    EXPECT_EQ(after.set_points + after.refused_set_points, before.set_points + before.refused_set_points + 1);
    return after.refused_set_points > before.refused_set_points;
  };
  const Vector3 none = Vector3::Zero();
  EXPECT_FALSE(refused(kPositionYaw, {1200.0, -5000.0, 10.0}, none));
  EXPECT_TRUE(refused(kPositionYaw, {std::nan(""), 0.0, 10.0}, none));
  EXPECT_TRUE(refused(kPositionYaw, {0.0, 0.0, std::numeric_limits<double>::infinity()}, none));
  EXPECT_FALSE(refused(kVelocityYaw, none, {1000.0, 0.0, 0.0}));
  EXPECT_TRUE(refused(kVelocityYaw, none, {0.0, 1000.5, 0.0}));
}

}  // namespace
}  // namespace roborun::test
