#include "platform/live/mission_route.hpp"

#include <gtest/gtest.h>

#include "platform/input/input_error.hpp"

namespace roborun::live {
namespace {

const std::string kMission = std::string(ROBORUN_TEST_DATA) + "/missions/two_pillars.plan";
constexpr sensor_port::EarthPlace kDrawnAt{47.397742, 8.545594, 488.0};
const Aabb kBounds_W{Vector3(-10.0, -15.0, 1.5), Vector3(70.0, 15.0, 8.0)};

TEST(MissionRouteTest, LiesWhereThePlanWasDrawn) {
  const Route sut = route_of(mavlink::load_mission(kMission), kDrawnAt);
  ASSERT_EQ(sut.steps.size(), 6U);  // without the take-off
  EXPECT_DOUBLE_EQ(sut.cruise_m, 4.0);
  EXPECT_LT((sut.first_W() - Vector3(30.0, 9.0, 4.0)).norm(), 0.05);
  EXPECT_LT((*sut.steps[2].goal_W - Vector3(60.0, 0.0, 4.0)).norm(), 0.05);
  EXPECT_TRUE(sut.steps[3].releases);
  EXPECT_TRUE(sut.steps[5].returns);
  EXPECT_NO_THROW(check_route(sut, kBounds_W, sut.fence, 1.0));
  EXPECT_TRUE(sut.fence.allows(Vector3(0.0, 0.0, 4.0)));
  EXPECT_FALSE(sut.fence.allows(Vector3(35.0, -13.0, 4.0)));
  EXPECT_FALSE(sut.fence.allows(Vector3(0.0, 14.8, 4.0)));
}

TEST(MissionRouteTest, NamesTheItemThatHasNoRoom) {
  const auto refusal = [](const Route& route, const Aabb& bounds_W, double room_m) -> std::string {
    try {
      check_route(route, bounds_W, route.fence, room_m);
    } catch (const InputError& error) {
      return error.what();
    }
    return {};
  };
  const Route route = route_of(mavlink::load_mission(kMission), kDrawnAt);
  EXPECT_EQ(refusal(route, {kBounds_W.min_W, Vector3(50.0, 15.0, 8.0)}, 1.0).rfind("item 4: (60.00, ", 0),
            0U);
  EXPECT_EQ(refusal(route, kBounds_W, 6.0).rfind("item 2: (30.00, 9.00, 4.00): must be inside the fence", 0),
            0U);
  mavlink::MissionFile early = mavlink::load_mission(kMission);
  std::swap(early.items[1], early.items[5]);
  EXPECT_THROW((void)route_of(early, kDrawnAt), InputError) << "a delay before the first way-point";
  mavlink::MissionFile far = mavlink::load_mission(kMission);
  EXPECT_THROW((void)route_of(far, {10.0, 8.0, 488.0}), InputError) << "on another continent";
}

TEST(RouteFlightTest, DoesOneAfterTheOther) {
  const Route route = route_of(mavlink::load_mission(kMission), kDrawnAt);
  RouteFlight sut(route);
  const Vector3 home_W(1.0, 2.0, 4.0);
  EXPECT_LT((*sut.step(0.0, home_W, true, 0).goal_W - route.first_W()).norm(), 1e-9);
  EXPECT_FALSE(sut.step(0.1, home_W, false, 0).goal_W.has_value());
  EXPECT_FALSE(sut.holds());
  EXPECT_FALSE(sut.step(9.0, home_W, true, 0).goal_W.has_value());
  EXPECT_TRUE(sut.holds()) << "2 s at the first one";
  (void)sut.step(10.9, home_W, true, 0);
  EXPECT_EQ(sut.done(), 0U);
  (void)sut.step(11.0, home_W, true, 0);
  EXPECT_EQ(sut.done(), 1U);
  EXPECT_DOUBLE_EQ(*sut.step(11.1, home_W, true, 0).speed_mps, 2.0);
  EXPECT_TRUE(sut.step(11.2, home_W, true, 0).goal_W.has_value());
  EXPECT_EQ(sut.done(), 2U) << "at the goal before is not at this one";
  (void)sut.step(20.0, home_W, true, 0);
  EXPECT_TRUE(sut.step(20.1, home_W, true, 0).releases);
  EXPECT_FALSE(sut.step(20.2, home_W, true, 0).releases) << "once";
  (void)sut.step(24.0, home_W, true, 1);
  (void)sut.step(25.9, home_W, true, 1);
  EXPECT_EQ(sut.done(), 3U) << "until it has fallen clear";
  (void)sut.step(26.0, home_W, true, 1);
  EXPECT_EQ(sut.done(), 4U);
  (void)sut.step(26.1, home_W, true, 1);
  (void)sut.step(27.2, home_W, true, 1);
  const auto back = sut.step(27.3, home_W, true, 1);
  ASSERT_TRUE(back.goal_W.has_value());
  EXPECT_LT((*back.goal_W - home_W).norm(), 1e-9) << "where it took off";
  EXPECT_FALSE(sut.is_done());
  (void)sut.step(40.0, home_W, true, 1);
  EXPECT_TRUE(sut.is_done());
}

TEST(RouteFlightTest, GoesOnWithAPackageThatNobodyLetsGo) {
  Route route;
  route.steps.resize(3);
  route.steps[0].goal_W = Vector3(5.0, 0.0, 1.8);
  route.steps[1].releases = true;
  route.steps[2].goal_W = Vector3(9.0, 0.0, 4.0);
  RouteFlight sut(route);
  (void)sut.step(0.0, Vector3::Zero(), false, 3);
  (void)sut.step(5.0, Vector3::Zero(), true, 3);
  EXPECT_TRUE(sut.step(6.0, Vector3::Zero(), true, 3).releases) << "those of before are not of this step";
  (void)sut.step(15.9, Vector3::Zero(), true, 3);
  EXPECT_EQ(sut.done(), 1U);
  (void)sut.step(16.0, Vector3::Zero(), true, 3);
  EXPECT_EQ(sut.done(), 2U);
}

}  // namespace
}  // namespace roborun::live
