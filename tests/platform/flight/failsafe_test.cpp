#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "core/executive/frame_table.hpp"
#include "platform/flight/example/lift.hpp"
#include "platform/flight/failsafe_monitor.hpp"
#include "platform/flight/landing_site.hpp"
#include "platform/flight/lockstep_flight.hpp"
#include "stages/perception/brick_map.hpp"
#include "stages/planning/rrt_star.hpp"
#include "tests/platform/sitl/vehicle/flight.hpp"
#include "tests/support/box_view.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::flight {
namespace {

using governor::bit;
using governor::Condition;

TEST(FailsafeMonitor, EachConditionHoldsAboveItsLimitForItsTimeAndNotBefore) {
  for (const FailsafeThreshold& row : kFailsafeThresholds) {
    for (const double excess : {0.0, 1e-6}) {
      FailsafeMonitor sut;
      MonotonicTime now{};
      FailsafeMeasures fine{};
      ASSERT_EQ(sut.step(now, fine), 0);
      FailsafeMeasures bad{};
      bad.*row.measure = row.limit + excess;
      const MonotonicTime begin = now;
      governor::ConditionSet set = 0;
      while (seconds(now - begin) < row.for_s + 0.1) {
        now += core::kMinorFrame;
        set = sut.step(now, bad);
        if (seconds(now - begin) <= row.for_s) {
          ASSERT_EQ(set & bit(row.condition), 0) << governor::to_string(row.condition);
        }
      }
      EXPECT_EQ((set & bit(row.condition)) != 0, excess > 0.0) << governor::to_string(row.condition);
      now += core::kMinorFrame;
      EXPECT_EQ(sut.step(now, fine), 0) << "gone with its cause";
    }
  }
}

TEST(FailsafeMonitor, OneGoodMomentStartsTheTimeAgain) {
  FailsafeMonitor sut;
  MonotonicTime now{};
  FailsafeMeasures m{};
  for (int i = 0; i < 4000; ++i) {
    now += core::kMinorFrame;
    m.depth_age_s = i % 100 == 0 ? 0.0 : 9.0;  // a good one every 250 ms, the limit is 500 ms
    ASSERT_EQ(sut.step(now, m), 0);
  }
}

TEST(FailsafeMonitor, ABatteryThatSaysNothingIsLowAndNotCritical) {
  FailsafeMonitor sut;
  FailsafeMeasures m{};
  m.battery_used_ratio = std::numeric_limits<double>::quiet_NaN();
  governor::ConditionSet set = 0;
  MonotonicTime now{};
  for (int i = 0; i < 2000; ++i) set = sut.step(now += core::kMinorFrame, m);
  EXPECT_EQ(set, bit(Condition::kBatteryLow));
}

TEST(FailsafeMonitor, EveryConditionHasARow) {
  governor::ConditionSet all = 0;
  for (const FailsafeThreshold& row : kFailsafeThresholds) all |= bit(row.condition);
  EXPECT_EQ(all, governor::kAllConditions);
}

TEST(LandingSite, IsRightBelowWhereThatIsFreeAndTheNearestFreePlaceOtherwise) {
  test::BoxView view;
  view.free_W = {{-20, -20, 0.3}, {20, 20, 10}};
  const Vector3 p_W(0, 0, 4);
  const test::NoAllocScope scope;
  auto site_W = landing_site_W(view, {}, p_W, 0.0, 0.9);
  EXPECT_EQ(scope.count(), 0U);
  ASSERT_TRUE(site_W.has_value());
  EXPECT_EQ(*site_W, p_W);
  view.occupied.push_back({{-1, -1, 0}, {1, 1, 2}});
  site_W = landing_site_W(view, {}, p_W, 0.0, 0.9);
  ASSERT_TRUE(site_W.has_value());
  EXPECT_NEAR((*site_W - p_W).norm(), 3.0, 1e-9) << "1.5 m away it would still touch";
  EXPECT_EQ(site_W->z(), p_W.z());
  view.free_W = {{-20, -20, 2.0}, {20, 20, 10}};
  EXPECT_FALSE(landing_site_W(view, {}, p_W, 0.0, 0.9).has_value()) << "what is unknown is not free";
}

TEST(LandingSite, StaysInsideTheFence) {
  test::BoxView view;
  view.free_W = {{-20, -20, 0.3}, {20, 20, 10}};
  view.occupied.push_back({{-1, -20, 0}, {1, 20, 2}});
  core::Fence fence;
  const std::array<core::FencePoint, 4> west{{{-15, -15}, {1, -15}, {1, 15}, {-15, 15}}};
  ASSERT_EQ(fence.add_polygon(core::FenceSide::kKeepIn, west), core::FenceFault::kNone);
  const auto site_W = landing_site_W(view, fence, Vector3(0, 0, 4), 0.0, 0.9);
  ASSERT_TRUE(site_W.has_value());
  EXPECT_LT(site_W->x(), -1.9);
}

/// The example's aircraft, which has no cameras, under the runtime.
struct HoverFlight {
  HoverFlight() {
    config.bounds_W = {Vector3(-5, -5, 1), Vector3(5, 5, 10)};
    config.goal_W = Vector3(0, 0, 3);
    config.cruise_m = 3.0;
    map_config.bounds_W = map_bounds_W(config);
    map_config.lattice = lattice_of(config);
    block.resize(FlightSystem::arena_bytes(config) + stages::BrickMap::arena_bytes(map_config) +
                 stages::RrtStar::arena_bytes({}) + 4096);
    arena.emplace(block);
    map.emplace(map_config, *arena);
    planner.emplace(stages::RrtStar::Config{}, *arena);
    flight = std::make_unique<LockstepFlight>(config, aircraft, std::span<firmware_if::DepthCamera* const>{},
                                              FlightParts{*map, *planner}, *arena);
  }
  void run(double duration_s) {
    const MonotonicTime end = flight->now() + from_seconds(duration_s);
    while (flight->now() < end) (void)flight->step();
  }
  FlightConfig config;
  stages::BrickMap::Config map_config;
  std::vector<std::byte> block;
  std::optional<core::Arena> arena;
  std::optional<stages::BrickMap> map;
  std::optional<stages::RrtStar> planner;
  example::Lift aircraft{config.vehicle};
  std::unique_ptr<LockstepFlight> flight;
};

TEST(FailsafePilot, ComesDownWhenItIsAsked) {
  HoverFlight sut;
  sut.run(8.0);
  ASSERT_NEAR(sut.aircraft.height_m(), 3.0, 0.2);
  sut.flight->system().flight_program().ask_to_land();
  sut.run(25.0);
  EXPECT_TRUE(sut.flight->system().control().descending());
  EXPECT_EQ(sut.aircraft.height_m(), 0.0);
  ASSERT_EQ(sut.flight->system().pilot().events().size(), 1U);
  EXPECT_EQ(sut.flight->system().pilot().events()[0].action, governor::Action::kLand);
  EXPECT_EQ(sut.flight->system().pilot().events()[0].conditions, 0);
}

TEST(FailsafePilot, StaysOnTheGroundWhenItIsAskedThere) {
  HoverFlight sut;
  sut.flight->system().flight_program().ask_to_land();
  sut.run(5.0);
  EXPECT_FALSE(sut.flight->system().control().flying());
  EXPECT_EQ(sut.aircraft.height_m(), 0.0);
}

/// An autopilot that says what the test says.
class ScriptedAutopilot final : public firmware_if::Autopilot {
 public:
  void step(MonotonicTime /*now*/) noexcept override {}
  [[nodiscard]] Status read(firmware_if::AutopilotState& state) noexcept override {
    if (said.sequence == read_) return Status::kNotReady;
    read_ = said.sequence;
    state = said;
    return Status::kOk;
  }
  Status command(MonotonicTime /*now*/, const firmware_if::AutopilotSetPoint& s) noexcept override {
    last = s;
    return Status::kOk;
  }
  void take_command(double height_m) noexcept override { taken_m = height_m; }
  void let_go() noexcept override {}
  void disarm() noexcept override { disarmed = true; }
  void land() noexcept override { asked_to_land = true; }
  void terminate() noexcept override {}
  [[nodiscard]] firmware_if::AutopilotReport report() const noexcept override { return told; }
  [[nodiscard]] const firmware_if::AutopilotLimits& limits() const noexcept override { return limits_; }

  firmware_if::AutopilotState said{};
  firmware_if::AutopilotReport told{};
  firmware_if::AutopilotSetPoint last{};
  std::optional<double> taken_m;
  bool disarmed{false};
  bool asked_to_land{false};

 private:
  firmware_if::AutopilotLimits limits_{};
  std::uint32_t read_{0};
};

/// It flies as it likes: `v_W` counts.
struct LedFlight {
  LedFlight() { sut.set_cruise_height(6.0); }
  void run(double time_s) {
    for (int i = 0; i < static_cast<int>(400.0 * time_s); ++i) {
      now += core::kMinorFrame;
      p_W += seconds(core::kMinorFrame) * v_W;
      autopilot.said.stamp = now;
      ++autopilot.said.sequence;
      autopilot.said.p_WB_m = {p_W.x(), p_W.y(), p_W.z()};
      autopilot.said.v_WB_mps = {v_W.x(), v_W.y(), v_W.z()};
      sut.sense(now, autopilot);
      sut.commit(now);
      sut.track(now, autopilot);
    }
  }
  void tell(firmware_if::AutopilotStage stage, bool armed, bool in_air) {
    autopilot.told.stage = stage;
    autopilot.told.armed = armed;
    autopilot.told.in_air = in_air;
  }
  ScriptedAutopilot autopilot;
  FlightControl sut{VehicleModel{}, seconds(core::kMinorFrame)};
  Vector3 p_W = Vector3::Zero(), v_W = Vector3::Zero();
  MonotonicTime now{};
};

using firmware_if::AutopilotStage;

TEST(FlightControl, ClimbsAtTheSpeedOfATakeOffFromStandingToStanding) {
  for (const double from_m : {0.0, 6.0}) {
    LedFlight f;
    f.tell(AutopilotStage::kReady, false, false);
    f.run(1.5);
    f.p_W.z() = from_m;
    f.tell(AutopilotStage::kOurs, true, true);
    f.run(0.1);
    ASSERT_TRUE(f.sut.flying());
    const Trajectory& climb = f.sut.committed();
    EXPECT_NEAR(climb.end_W().z(), 6.0, 1e-6);
    double fastest_mps = 0.0;
    for (double s = 0.0; s <= climb.duration_s(); s += 0.01) {
      fastest_mps = std::max(fastest_mps, climb.at_s(s).v_W.norm());
      EXPECT_LT(climb.at_s(s).a_W.norm(), 1.5001);
    }
    EXPECT_LT(climb.at_s(climb.duration_s()).v_W.norm(), 1e-6);
    // 6 m at 1.5 m/s, and a second to speed up and to slow down.
    EXPECT_LT(climb.duration_s(), from_m > 0.0 ? 0.01 : 5.3);
    EXPECT_NEAR(fastest_mps, from_m > 0.0 ? 0.0 : 1.5, 1e-6);
  }
}

TEST(FlightControl, LeadsAnAutopilotThatComesBackMovingToAStopAndNotBack) {
  LedFlight f;
  f.tell(AutopilotStage::kReady, false, false);
  f.run(1.5);
  EXPECT_EQ(f.autopilot.taken_m, 6.0);
  f.tell(AutopilotStage::kOurs, true, true);
  f.run(1.0);
  ASSERT_TRUE(f.sut.flying());
  f.v_W = {3.0, 0.0, 1.0};
  f.tell(AutopilotStage::kLost, true, true);
  f.run(1.0);
  f.tell(AutopilotStage::kOurs, true, true);
  f.run(0.0025);
  const Trajectory& stop = f.sut.committed();
  EXPECT_LT((stop.at(f.now).p_W - f.p_W).norm(), 0.02);
  EXPECT_LT((stop.at(f.now).v_W - f.v_W).norm(), 1e-6);
  const VehicleModel vehicle;
  for (double s = 0.0; s < stop.duration_s(); s += 0.01) {
    EXPECT_LT(stop.at_s(s).a_W.norm(), vehicle.acceleration_mps2 * 1.0001);
    EXPECT_GE(stop.at_s(s).v_W.dot(f.v_W), -1e-9) << "never back";
  }
  EXPECT_LT(stop.at_s(stop.duration_s()).v_W.norm(), 1e-6);
  EXPECT_NEAR((stop.end_W() - f.p_W).norm(), 0.5 * f.v_W.norm() * stop.duration_s(), 0.02);
}

TEST(FlightControl, LeavesTheLandingToAnAutopilotThatDoesNotFollowTheDescent) {
  for (const bool follows : {true, false}) {
    LedFlight f;
    f.tell(AutopilotStage::kReady, false, false);
    f.run(1.5);
    f.tell(AutopilotStage::kOurs, true, true);
    f.p_W.z() = 6.0;
    f.run(1.0);
    ASSERT_TRUE(f.sut.flying());
    f.run(8.0);
    f.sut.descend(f.now, 0.5);
    if (follows) f.v_W = {0.0, 0.0, -0.5};
    f.run(5.0);
    EXPECT_FALSE(f.autopilot.asked_to_land) << "2.5 m of it";
    f.run(2.0);
    EXPECT_EQ(f.autopilot.asked_to_land, !follows);
    if (!follows) continue;
    f.v_W.setZero();  // it stands on something, and knows
    f.tell(AutopilotStage::kOurs, true, false);
    f.run(10.0);
    EXPECT_FALSE(f.autopilot.asked_to_land);
    EXPECT_TRUE(f.sut.landed());
  }
}

TEST(FlightControl, TakesAnAutopilotOverWhoseClimbIsWithdrawn) {
  LedFlight f;
  f.tell(AutopilotStage::kReady, false, false);
  f.run(1.5);
  f.tell(AutopilotStage::kTaking, true, true);
  f.v_W = {0.0, 0.0, 1.5};
  f.run(2.0);
  ASSERT_FALSE(f.sut.flying());
  ASSERT_EQ(f.autopilot.taken_m, 6.0);
  f.sut.allow_take_off(false);
  f.run(0.0025);
  EXPECT_EQ(f.autopilot.taken_m, 0.0);
  EXPECT_FALSE(f.autopilot.disarmed);
  f.tell(AutopilotStage::kOurs, true, true);
  f.run(0.0025);
  EXPECT_TRUE(f.sut.flying()) << "the failsafe sees it fly";
  EXPECT_NEAR(f.sut.committed().at(f.now).v_W.z(), 1.5, 1e-6);
  EXPECT_LT(f.sut.committed().end_W().z(), 4.5);
  EXPECT_NEAR(f.sut.ground_m(), 0.0, 1e-6);
}

TEST(FlightControl, DisarmsAnAutopilotWhoseTakeOffIsWithdrawnOnTheGround) {
  LedFlight f;
  f.tell(AutopilotStage::kReady, false, false);
  f.run(1.5);
  f.tell(AutopilotStage::kTaking, true, false);
  f.run(0.5);
  EXPECT_FALSE(f.autopilot.disarmed);
  f.sut.allow_take_off(false);
  f.run(0.0025);
  EXPECT_TRUE(f.autopilot.disarmed);
  EXPECT_FALSE(f.sut.flying());
}

TEST(FlightControl, BrakesOnTheCommittedPathAndHoversThere) {
  test::Flight flight(5);
  const Vector3 from_W = flight.lane().committed().end_W();
  flight.lane().offer(
      test::straight(from_W, from_W + Vector3(60.0, 0.0, 0.0), 6.0, flight.now() + core::kMinorFrame));
  while (flight.truth().v_WB.x() < 5.5) flight.step();
  const double begin_m = flight.truth().p_WB.x();
  flight.lane().brake();
  flight.lane().offer(
      test::straight(from_W, from_W + Vector3(0.0, 60.0, 0.0), 6.0, flight.now() + core::kMinorFrame));
  double aside_m = 0.0;
  const MonotonicTime end = flight.now() + from_seconds(6.0);
  while (flight.now() < end) {
    flight.step();
    aside_m = std::fmax(aside_m, std::fabs(flight.truth().p_WB.y() - from_W.y()));
  }
  EXPECT_TRUE(flight.lane().standing(flight.now()));
  EXPECT_LT(aside_m, 0.4) << "neither off the path nor to what was offered meanwhile";
  // 5.5^2 / (2 * 2.5) = 6 m, and the motors' lag; the trajectory itself goes on for 40 m.
  EXPECT_GT(flight.truth().p_WB.x() - begin_m, 4.0);
  EXPECT_LT(flight.truth().p_WB.x() - begin_m, 9.0);
}

TEST(FlightControl, DescendsTouchesDownSoftlyAndNoticesIt) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    test::Flight flight(seed);
    flight.lane().descend(flight.now(), 1.0);
    double sink_mps = 0.0;
    double touchdown_mps = 0.0;
    const MonotonicTime latest = flight.now() + from_seconds(25.0);
    MonotonicTime down{};
    while (!flight.lane().landed() && flight.now() < latest) {
      flight.step();
      if (flight.truth().on_ground && sink_mps > 0.0) {
        touchdown_mps = sink_mps;
        down = flight.now();
      }
      sink_mps = flight.truth().on_ground ? 0.0 : -flight.truth().v_WB.z();
      ASSERT_FALSE(flight.lane().landed() && !flight.truth().on_ground) << "in the air";
    }
    EXPECT_TRUE(flight.lane().landed()) << "seed " << seed;
    EXPECT_GT(touchdown_mps, 0.0);
    EXPECT_LT(touchdown_mps, 1.2) << "seed " << seed;
    EXPECT_LT(seconds(flight.now() - down), 3.0);
  }
}

TEST(FlightControl, AHoverIsNeverTakenForALanding) {
  test::Flight flight(3);
  for (int i = 0; i < 4000; ++i) {
    flight.step();
    ASSERT_FALSE(flight.lane().landed());
  }
}

}  // namespace
}  // namespace roborun::flight
