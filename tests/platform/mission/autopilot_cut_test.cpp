/// The cable between the runtime and the autopilot is pulled in the middle of a flight: the vehicle stops as its autopilot
/// stops it, and that has to end in space that was known to be free. The world judges.
#include <gtest/gtest.h>

#include <cstdio>
#include <memory>

#include "core/random/counter_rng.hpp"
#include "tests/platform/mission/autopilot_flight.hpp"

namespace roborun::mission {
namespace {

class LinkCut : public ::testing::TestWithParam<AutopilotKind> {};

TEST_P(LinkCut, AtTenRandomMomentsTheVehicleStandsAndHasTouchedNothing) {
  const sitl::World world = middle_world();
  const MissionConfig config = autopilot_config(GetParam());
  core::CounterRng rng(23);
  int collisions = 0;
  double fastest_mps = 0.0;
  double nearest_m = 1e9;
  double longest_m = 0.0;
  for (int i = 0; i < 10; ++i) {
    const auto sut = std::make_unique<AutopilotFlight>(world, config);
    const double cut_s = rng.uniform(20.0, 170.0);
    while (sut->now_s() < cut_s) sut->step();
    ASSERT_TRUE(sut->airborne());
    ASSERT_EQ(sut->stage(), firmware_if::AutopilotStage::kOurs);
    const Vector3 from_W = sut->truth().p_WB;
    const double v_mps = sut->truth().v_WB.norm();
    fastest_mps = std::max(fastest_mps, v_mps);
    sut->cut(true);
    bool touched = false;
    double way_m = 0.0;
    double peak_mps = v_mps;  // what it was told to fly before the cut may have been faster
    const double radius_m = config.flight.vehicle.radius_m;
    for (int k = 0; k < 400 * 8; ++k) {
      sut->step();
      const double clearance_m = world.clearance_m(sut->truth().p_WB, 5.0);
      nearest_m = std::min(nearest_m, clearance_m - radius_m);
      touched = touched || clearance_m < radius_m;
      way_m = std::max(way_m, (sut->truth().p_WB - from_W).norm());
      peak_mps = std::max(peak_mps, sut->truth().v_WB.norm());
    }
    longest_m = std::max(longest_m, way_m);
    std::printf("%s, cut at %.1f s, %.1f m/s: %.1f m, then %.2f m/s%s\n", to_string(GetParam()), cut_s, v_mps,
                way_m, sut->truth().v_WB.norm(), touched ? ", TOUCHED" : "");
    collisions += touched ? 1 : 0;
    EXPECT_LT(sut->truth().v_WB.norm(), 0.5) << "it stands";
    EXPECT_LT(way_m, stopping_model(sut->config().vehicle).distance_m(peak_mps) + 1.0)
        << "within what was planned with, from " << peak_mps << " m/s";
  }
  std::printf("%s: %d collisions, nearest %.2f m, fastest %.1f m/s, longest %.1f m\n", to_string(GetParam()),
              collisions, nearest_m, fastest_mps, longest_m);
  EXPECT_EQ(collisions, 0);
  EXPECT_GT(fastest_mps, 2.0) << "there was something to stop";
}

struct StraightStops {
  int looked_at{}, blocked{};
  double fastest_mps{}, x_m{};
};

/// Of a flight through a forest: where the stop after silence, straight on as far as the stopping model says, would have led
/// at every tenth of a second. The world judges.
StraightStops straight_stops(AutopilotKind kind, std::uint64_t seed, bool stops_straight) {
  constexpr double kFrom_s = 8.0, kTo_s = 25.0, kMoves_mps = 0.5, kStep_m = 0.1;
  constexpr int kEvery = 40;  // frames
  const sitl::World world = forest_world(seed);
  const auto sut = std::make_unique<AutopilotFlight>(world, near_sighted_config(kind), stops_straight);
  const VehicleModel& vehicle = sut->config().vehicle;
  StraightStops stops;
  while (sut->now_s() < kTo_s && sut->stage() != firmware_if::AutopilotStage::kPilots) {
    for (int k = 0; k < kEvery; ++k) sut->step();
    const sitl::VehicleState& state = sut->truth();
    const double v_mps = state.v_WB.norm();
    if (sut->now_s() < kFrom_s || v_mps < kMoves_mps) continue;
    bool is_free = true;
    for (double s_m = 0.0; s_m < stopping_model(vehicle).distance_m(v_mps); s_m += kStep_m)
      is_free = is_free && world.clearance_m(state.p_WB + s_m / v_mps * state.v_WB, 1.0) >= vehicle.radius_m;
    ++stops.looked_at;
    stops.blocked += is_free ? 0 : 1;
    stops.fastest_mps = std::max(stops.fastest_mps, v_mps);
    stops.x_m = state.p_WB.x();
  }
  std::printf("%s, forest %llu, %s: %d of %d stops blocked, fastest %.1f m/s, came to x = %.1f m\n",
              to_string(kind), static_cast<unsigned long long>(seed), stops_straight ? "looked at" : "not",
              stops.blocked, stops.looked_at, stops.fastest_mps, stops.x_m);
  return stops;
}

TEST_P(LinkCut, WhereverItHappensAmongTreesTheStopStraightOnIsFree) {
  constexpr int kBlocked = 5;  // in all, where nobody looks at that stop
  int blocked_without = 0;
  for (std::uint64_t seed = 21; seed < 41 && blocked_without <= kBlocked; ++seed) {
    const int blocked = straight_stops(GetParam(), seed, false).blocked;
    if (blocked == 0) continue;
    blocked_without += blocked;
    const StraightStops with = straight_stops(GetParam(), seed, true);
    EXPECT_EQ(with.blocked, 0) << "forest " << seed;
    EXPECT_GT(with.looked_at, 50);
    EXPECT_GT(with.fastest_mps, 2.0) << "there was something to stop";
    EXPECT_GT(with.x_m, 20.0) << "it got on";
  }
  EXPECT_GT(blocked_without, kBlocked) << "or nothing is tested";
}

/// An ArduCopter that refuses what it is told stands still in our mode, for ever: PX4 would leave the mode by itself. The failsafe
/// notices (it is not where it is led to, as in wind), and what does not follow the descent comes down by its own landing.
TEST(DeafAutopilot, ComesDownByItsOwnLanding) {
  const sitl::World world = middle_world();
  const MissionConfig config = autopilot_config(AutopilotKind::kArduCopter);
  for (const double deaf_s : {40.0, 90.0}) {
    const auto sut = std::make_unique<AutopilotFlight>(world, config);
    while (sut->now_s() < deaf_s) sut->step();
    ASSERT_EQ(sut->stage(), firmware_if::AutopilotStage::kOurs);
    sitl::FakeAutopilot& fake = sut->aircraft().fake();
    fake.refuses_set_points = true;
    bool touched = false;
    while (fake.armed() && sut->now_s() < deaf_s + 90.0) {
      sut->step();
      const sitl::VehicleState& s = sut->truth();
      const bool in_air = s.p_WB.z() > sut->ground_m() + config.flight.vehicle.radius_m + 0.3;
      touched = touched || (in_air && world.clearance_m(s.p_WB, 5.0) < config.flight.vehicle.radius_m);
    }
    std::printf("deaf at %.0f s: down after %.1f s\n", deaf_s, sut->now_s() - deaf_s);
    EXPECT_FALSE(touched);
    EXPECT_EQ(fake.mode(), sitl::FakeAutopilot::Mode::kLand);
    EXPECT_FALSE(fake.armed());
    EXPECT_TRUE(sut->truth().on_ground);
    for (int k = 0; k < 800; ++k) sut->step();
    EXPECT_TRUE(sut->system().control().landed()) << "we know it too";
  }
}

/// The rule for a link that returns (platform/flight/README.md): ArduCopter has stayed in its mode and is led on; PX4 has left
/// it by itself, and nobody takes it back.
/// The last cut is where the goal is near: it is reached before.
TEST_P(LinkCut, WhenItComesBackTheFlightGoesOnWhereTheModeIsStillOurs) {
  const sitl::World world = middle_world();
  const MissionConfig config = autopilot_config(GetParam());
  const bool is_px4 = GetParam() == AutopilotKind::kPx4;
  int went_on = 0;
  for (const double moment_s : {50.0, 60.0, 75.0, 90.0}) {
    const auto sut = std::make_unique<AutopilotFlight>(world, config);
    while (sut->now_s() < moment_s) sut->step();
    ASSERT_EQ(sut->stage(), firmware_if::AutopilotStage::kOurs);
    double nearest_m = 1e9;
    const auto run = [&](double time_s) {
      for (int k = 0; k < static_cast<int>(400.0 * time_s); ++k) {
        sut->step();
        nearest_m = std::min(nearest_m, world.clearance_m(sut->truth().p_WB, 5.0));
      }
    };
    sut->cut(true);
    run(0.9);
    EXPECT_EQ(sut->stage(), firmware_if::AutopilotStage::kOurs) << "a second is not a loss";
    sut->cut(false);
    run(5.0);
    EXPECT_EQ(sut->stage(),
              is_px4 ? firmware_if::AutopilotStage::kPilots : firmware_if::AutopilotStage::kOurs);
    const Vector3 there_W = sut->truth().p_WB;
    run(20.0);
    const double way_m = (sut->truth().p_WB - there_W).norm();
    std::printf("%s, cut at %.0f s: %.1f m in the 20 s after, nearest %.2f m, %s\n", to_string(GetParam()),
                moment_s, way_m, nearest_m, firmware_if::to_string(sut->stage()));
    EXPECT_GT(nearest_m, config.flight.vehicle.radius_m);
    EXPECT_TRUE(!is_px4 || way_m < 3.0) << "it stays in Hold: " << way_m;
    went_on += way_m > 10.0 ? 1 : 0;
  }
  EXPECT_TRUE(is_px4 || went_on >= 3);
}

/// The autopilot's estimator is reset in flight, and the same place has coordinates 3 m from those before.
TEST_P(LinkCut, AFrameThatJumpsDoesNotMoveTheFlight) {
  const sitl::World world = middle_world();
  const MissionConfig config = autopilot_config(GetParam());
  const auto sut = std::make_unique<AutopilotFlight>(world, config);
  while (sut->now_s() < 60.0) sut->step();
  ASSERT_EQ(sut->stage(), firmware_if::AutopilotStage::kOurs);
  double off_m = 0.0;
  double nearest_m = 1e9;
  const Vector3 from_W = sut->truth().p_WB;
  sut->jump(Vector3(2.0, -2.0, 1.0));
  for (int k = 0; k < 400 * 20; ++k) {
    sut->step();
    off_m = std::max(off_m, (sut->truth().p_WB - sut->reference().p_W).norm());
    nearest_m = std::min(nearest_m, world.clearance_m(sut->truth().p_WB, 5.0));
  }
  std::printf("%s: at most %.2f m from the reference, nearest %.2f m\n", to_string(GetParam()), off_m,
              nearest_m);
  EXPECT_LT(off_m, 1.5 * config.flight.vehicle.tracking_error_m) << "without a jump";
  EXPECT_GT((sut->truth().p_WB - from_W).norm(), 10.0) << "it goes on";
  EXPECT_GT(nearest_m, config.flight.vehicle.radius_m);
}

/// Goals that are given in flight, from the ground: what is flown goes on where it is, at every speed and in every curve.
TEST_P(LinkCut, AnotherGoalAtAnyMomentMakesNoJump) {
  const sitl::World world = middle_world();
  const MissionConfig config = autopilot_config(GetParam());
  core::CounterRng rng(31);
  const auto sut = std::make_unique<AutopilotFlight>(world, config);
  while (sut->now_s() < 15.0) sut->step();
  const double dt_s = seconds(config.flight.minor_frame);
  double jump_m = 0.0, change_mps = 0.0, fastest_mps = 0.0, nearest_m = 1e9;
  int given = 0;
  TrajectoryPoint before = sut->reference();
  for (int i = 0; i < 12; ++i) {
    const Vector3 goal_W(sut->truth().p_WB.x() + rng.uniform(-60.0, 60.0), rng.uniform(-40.0, 40.0),
                         rng.uniform(3.0, 7.0));
    given += sut->system().decision_program().give_goals({&goal_W, 1}) == Status::kOk ? 1 : 0;
    for (int k = static_cast<int>(rng.uniform(400.0, 4000.0)); k > 0; --k) {
      sut->step();
      const TrajectoryPoint now = sut->reference();
      jump_m = std::max(jump_m, (now.p_W - before.p_W - dt_s * before.v_W).norm());
      change_mps = std::max(change_mps, (now.v_W - before.v_W).norm());
      fastest_mps = std::max(fastest_mps, now.v_W.norm());
      nearest_m = std::min(nearest_m, world.clearance_m(sut->truth().p_WB, 5.0));
      before = now;
    }
  }
  std::printf(
      "%s: %d goals, reference at most %.4f m and %.3f m/s off in a frame, %.1f m/s, nearest %.2f m\n",
      to_string(GetParam()), given, jump_m, change_mps, fastest_mps, nearest_m);
  EXPECT_GE(given, 8);
  EXPECT_GT(fastest_mps, 3.0);
  EXPECT_LT(jump_m, 0.001) << "2.5 ms of 6 m/s2, twice";
  EXPECT_LT(change_mps, 0.05);
  EXPECT_GT(nearest_m, config.flight.vehicle.radius_m);
}

INSTANTIATE_TEST_SUITE_P(Both, LinkCut, ::testing::Values(AutopilotKind::kPx4, AutopilotKind::kArduCopter),
                         [](const auto& p) { return std::string(to_string(p.param)); });

/// For longer the failsafe has given the flight up (no position for a second): once the link is back it lands from where the
/// autopilot has stopped it.
TEST(LinkCutForLong, ArduCopterIsLandedWhereItStoodWhenTheLinkIsBack) {
  const sitl::World world = middle_world();
  const MissionConfig config = autopilot_config(AutopilotKind::kArduCopter);
  const auto sut = std::make_unique<AutopilotFlight>(world, config);
  const auto run = [&](double time_s) {
    for (int k = 0; k < static_cast<int>(400.0 * time_s); ++k) sut->step();
  };
  run(45.0);
  ASSERT_EQ(sut->stage(), firmware_if::AutopilotStage::kOurs);
  sut->cut(true);
  run(8.0);
  EXPECT_EQ(sut->stage(), firmware_if::AutopilotStage::kLost);
  EXPECT_FALSE(sut->truth().on_ground);
  const Vector3 stood_W = sut->truth().p_WB;
  sut->cut(false);
  run(60.0);
  EXPECT_TRUE(sut->truth().on_ground);
  EXPECT_LT((sut->truth().p_WB - stood_W).head<2>().norm(), 3.0);
  EXPECT_LT(sut->truth().v_WB.norm(), 0.1);
}

}  // namespace
}  // namespace roborun::mission
