/// What a decision does among bodies that move, on scenes made by hand: all space is known and free, boxes move through it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "platform/flight/decision_pipeline.hpp"
#include "tests/stages/perception/scene.hpp"
#include "tests/support/boxes_map.hpp"

namespace roborun::flight {
namespace {

constexpr double kPeriod_s = 0.2;
constexpr double kBody_m = 0.5;     // half an edge of the box
constexpr double kTouches_m = 1.1;  // from its middle to that of the vehicle

MonotonicTime clock_s(double time_s) { return MonotonicTime{from_seconds(time_s)}; }

/// Takes no time.
class Free final : public core::StageMeter {
 public:
  void charge_to(core::StageId /*id*/) noexcept override {}
  [[nodiscard]] Nanos cost(core::StageId /*id*/, const core::Work& /*work*/) const noexcept override {
    return Nanos{0};
  }
  Nanos settle(core::StageId /*id*/, const core::Work& /*work*/) noexcept override { return Nanos{0}; }
  [[nodiscard]] Nanos grant(core::StageId /*id*/, Nanos wanted) noexcept override { return wanted; }
};

/// Grants the same in every decision.
class Same final : public governor::DecisionPolicy {
 public:
  double speed_mps{4.0};
  [[nodiscard]] governor::Decision decide(const SpaceProfile& /*profile*/,
                                          const governor::Situation& /*situation*/) noexcept override {
    governor::Decision d;
    d.point = {0, 0, 1e5, 1e5, 1e5, from_seconds(kPeriod_s), speed_mps};
    return d;
  }
  void observe(core::StageId /*id*/, double /*predicted_s*/, double /*spent_s*/) noexcept override {}
  [[nodiscard]] double v_max_mps() const noexcept override { return speed_mps; }
};

/// Straight to the goal.
class Straight final : public stages::Planner {
 public:
  int asked{0};
  [[nodiscard]] Status plan(const stages::PlanRequest& request, const stages::MapView& /*view*/,
                            core::StageBudget& /*budget*/, stages::PlanResult& result) noexcept override {
    result = {};
    ++asked;
    const Vector3 way = request.goal_W - request.start_W;
    (void)result.path_W.push_back(request.start_W);
    (void)result.path_W.push_back(request.start_W + std::min(1.0, request.horizon_m / way.norm()) * way);
    return Status::kOk;
  }
};

struct Mover {
  Vector3 p_W;  ///< At 0 s.
  Vector3 v_W;
  [[nodiscard]] Vector3 at_W(double time_s) const { return p_W + time_s * v_W; }
};

class Bodies : public ::testing::Test {
 protected:
  Bodies() {
    map_.box.free_W = {{-400, -400, 0.5}, {400, 400, 20}};
    config_.flight_bounds_W = {{-50, -50, 1.5}, {50, 50, 10}};
    config_.map_bounds_W = map_.box.free_W;
  }

  /// The decision that begins at `time_s`, after five that saw the bodies too.
  DecisionOutput decide(const std::vector<Mover>& bodies, const Trajectory& committed, double time_s = 1.0) {
    std::vector<std::byte> memory(stages::PointCloud::arena_bytes({}));
    core::Arena arena(memory);
    stages::PointCloud cloud({}, arena);
    DecisionPipeline sut(config_, meter_, policy_, cloud, map_, planner_, smoother_);
    DecisionOutput out;
    for (double t_s = 0.0; t_s <= time_s + 1e-9; t_s += kPeriod_s) {
      const TrajectoryPoint now = committed.at(clock_s(t_s));
      test::Scene scene;
      scene.solid.push_back({{-100, -100, -1}, {100, 100, 0}});  // the ground
      for (const Mover& body : bodies) scene.solid.push_back(Aabb::around(body.at_W(t_s), kBody_m));
      std::vector<stages::PosedDepthFrame> frames = scene.look(now.p_W);
      for (stages::PosedDepthFrame& frame : frames) {
        frame.frame.stamp = clock_s(t_s);
        frame.error.constant_m = frame.error.quadratic_per_m = 0.0;  // or the same twice is a frozen image
      }
      DecisionInput in;
      in.now = clock_s(t_s);
      in.frames = frames;
      in.committed = &committed;
      in.p_WB = now.p_W;
      in.v_WB = now.v_W;
      in.goal_W = goal_W_;
      for (std::size_t id = 0; id < core::kStageCount; ++id) sut.run(static_cast<core::StageId>(id), in, out);
    }
    return out;
  }

  /// How near what flies this from its start on comes to the bodies within four seconds.
  static double nearest_m(const Trajectory& flown, const std::vector<Mover>& bodies) {
    double nearest_m = 1e9;
    for (double t_s = 0.0; t_s <= 4.0; t_s += 0.05) {
      const double time_s = seconds(flown.start_time.time_since_epoch()) + t_s;
      for (const Mover& body : bodies)
        nearest_m = std::min(nearest_m, (flown.at(clock_s(time_s)).p_W - body.at_W(time_s)).norm());
    }
    return nearest_m;
  }
  static double farthest_aside_m(const Trajectory& flown) {
    double aside_m = 0.0;
    for (double t_s = 0.0; t_s <= flown.duration_s(); t_s += 0.05)
      aside_m = std::max(aside_m, std::fabs(flown.at_s(t_s).p_W.y()));
    return aside_m;
  }

  Vector3 goal_W_{40, 0, 3};
  PipelineConfig config_;
  Free meter_;
  Same policy_;
  test::BoxesMap map_;
  Straight planner_;
  stages::Smoother smoother_;
};

const Trajectory kHovers = Trajectory::hold({0, 0, 3}, clock_s(0.0));

/// Along x at this speed, for a minute.
Trajectory along_x(double speed_mps) {
  Trajectory t;
  t.segment_count = 1;
  t.segment[0].duration_s = 60.0;
  t.brake_begin_s = 60.0;
  t.segment[0].coefficient[0] = Vector3(0, 0, 3);
  t.segment[0].coefficient[1] = Vector3(speed_mps, 0, 0);
  return t;
}

TEST_F(Bodies, WhatIsFlownStopsBeforeABodyThatCrossesIt) {
  const Trajectory flown = along_x(4.0);
  const std::vector<Mover> crosses{{{12, -6, 3}, {0, 2, 0}}};  // both at (12, 0) after 3 s
  ASSERT_LT(nearest_m(flown, crosses), 0.1);
  const DecisionOutput out = decide(crosses, flown);
  ASSERT_TRUE(out.early_stop.has_value());
  EXPECT_GT(nearest_m(*out.early_stop, crosses), kTouches_m);
  EXPECT_LT(out.early_stop->at_s(out.early_stop->duration_s()).v_W.norm(), 1e-6);
}

TEST_F(Bodies, WhatIsFlownGoesOnBesideABodyThatItDoesNotMeet) {
  policy_.speed_mps = 4.0;
  EXPECT_FALSE(decide({{{12, 6, 3}, {0, 2, 0}}}, along_x(4.0)).early_stop.has_value()) << "it has gone by";
  EXPECT_FALSE(decide({}, along_x(4.0)).early_stop.has_value());
}

TEST_F(Bodies, WhatPassesInFrontOfABodyDoesNotStopInItsWay) {
  const Trajectory flown = along_x(4.0);
  const std::vector<Mover> crosses{{{7, -5.5, 3}, {0, 2, 0}}};
  ASSERT_GT(nearest_m(flown, crosses), kTouches_m);
  ASSERT_LT(nearest_m(flown, crosses), 2.0) << "so near that a stop is looked at";
  EXPECT_FALSE(decide(crosses, flown).early_stop.has_value());
}

TEST_F(Bodies, WhatIsTooFastAmongBodiesStopsThoughItMeetsNone) {
  const std::vector<Mover> beside{{{12, 6, 3}, {0, 2, 0}}};
  policy_.speed_mps = 2.0;  // half of what is flown
  EXPECT_TRUE(decide(beside, along_x(4.0)).early_stop.has_value());
  EXPECT_FALSE(decide({}, along_x(4.0)).early_stop.has_value()) << "nothing moves";
}

TEST_F(Bodies, ABodyThatCrossesThePlanIsLetPassBySlowerFlight) {
  const Trajectory flown = along_x(3.0);
  const std::vector<Mover> crosses{{{12, -7.4, 3}, {0, 2, 0}}};
  const DecisionOutput straight = decide({}, flown);
  ASSERT_EQ(straight.kind, DecisionKind::kNew);
  ASSERT_LT(nearest_m(straight.trajectory, crosses), kTouches_m) << "or nothing is tested";
  const DecisionOutput out = decide(crosses, flown);
  EXPECT_FALSE(out.early_stop.has_value()) << "there is time";
  ASSERT_EQ(out.kind, DecisionKind::kNew);
  EXPECT_GT(nearest_m(out.trajectory, crosses), kTouches_m);
  EXPECT_LT(farthest_aside_m(out.trajectory), 0.3) << "straight on";
  EXPECT_GT(out.trajectory.end_W().x(), 12.0) << "it does not wait";
  EXPECT_GT(out.trajectory.duration_s(), 1.3 * straight.trajectory.duration_s());
}

TEST_F(Bodies, WhatHoversWaitsForABodyThatCrossesThePlan) {
  const std::vector<Mover> crosses{{{9, -7, 3}, {0, 2, 0}}};
  const DecisionOutput straight = decide({}, kHovers);
  ASSERT_EQ(straight.kind, DecisionKind::kNew);
  ASSERT_LT(nearest_m(straight.trajectory, crosses), kTouches_m) << "or nothing is tested";
  EXPECT_EQ(decide(crosses, kHovers).kind, DecisionKind::kKeep);
  const DecisionOutput later = decide(crosses, kHovers, 5.0);  // it has gone by
  ASSERT_EQ(later.kind, DecisionKind::kNew);
  EXPECT_GT(nearest_m(later.trajectory, crosses), kTouches_m);
}

TEST_F(Bodies, FromABodyThatComesStraightAtItItGoesAside) {
  const std::vector<Mover> comes{{{10, 0, 3}, {-2, 0, 0}}};
  ASSERT_LT(nearest_m(kHovers, comes), 2.1);
  const DecisionOutput out = decide(comes, kHovers, 2.0);  // it is 6 m away then
  ASSERT_EQ(out.kind, DecisionKind::kNew);
  EXPECT_GT(nearest_m(out.trajectory, comes), kTouches_m);
  EXPECT_GT(farthest_aside_m(out.trajectory), 1.0);
}

TEST_F(Bodies, ItGoesAsideToTheSideThatIsFree) {
  const std::vector<Mover> comes{{{10, 0, 3}, {-2, 0, 0}}};
  const auto side_m = [&](double wall_m) {
    map_.box.occupied = {{{-60, std::min(wall_m, 60 * wall_m), 0}, {60, std::max(wall_m, 60 * wall_m), 20}}};
    const DecisionOutput out = decide(comes, kHovers, 2.0);
    EXPECT_EQ(out.kind, DecisionKind::kNew);
    EXPECT_GT(nearest_m(out.trajectory, comes), kTouches_m);
    return out.trajectory.end_W().y();
  };
  EXPECT_LT(side_m(1.6), -1.0);
  EXPECT_GT(side_m(-1.6), 1.0);
}

TEST_F(Bodies, WhatComesToRestAtTheGoalIsNotPlannedAnew) {
  goal_W_ = {0.2, 0, 3};
  const DecisionOutput out = decide({}, kHovers);
  EXPECT_EQ(planner_.asked, 0);
  EXPECT_EQ(out.kind, DecisionKind::kKeep);
  EXPECT_EQ(out.planner_status, Status::kOk) << "no failure";
  EXPECT_EQ(out.smoother_status, Status::kOk);
  goal_W_ = {0.4, 0, 3};
  EXPECT_EQ(decide({}, kHovers).kind, DecisionKind::kNew);
  EXPECT_GT(planner_.asked, 0) << "not near enough";
  const Trajectory flown = along_x(4.0);
  goal_W_ = flown.end_W();
  planner_.asked = 0;
  (void)decide({}, flown);
  EXPECT_GT(planner_.asked, 0) << "before it brakes a faster one may be found";
}

TEST_F(Bodies, AtTheGoalItGoesAsideAllTheSame) {
  const std::vector<Mover> comes{{{10, 0, 3}, {-2, 0, 0}}};
  goal_W_ = {0, 0, 3};
  const DecisionOutput out = decide(comes, kHovers, 2.0);
  ASSERT_EQ(out.kind, DecisionKind::kNew);
  EXPECT_GT(nearest_m(out.trajectory, comes), kTouches_m);
}

}  // namespace
}  // namespace roborun::flight
