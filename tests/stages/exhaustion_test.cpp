/// Every pool of the decision lane runs out at every single allocation, once and for ever. What must hold
/// then is written with the pool's owner: the map loses space, never safety; the cloud drops points; the
/// planner plans with what it has.
#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "stages/perception/brick_map.hpp"
#include "stages/perception/point_cloud.hpp"
#include "stages/planning/rrt_star.hpp"
#include "tests/stages/perception/scene.hpp"
#include "tests/support/box_view.hpp"
#include "tests/support/limits.hpp"

namespace roborun::stages {
namespace {

constexpr std::uint64_t kForEver = std::numeric_limits<std::uint64_t>::max();
using test::kInfinity;

/// Calls `run(fault)` for every allocation index, once and for ever, until a run finishes without a hit. run
/// returns the number of allocations that it asked for. Returns how many runs were hit.
template <typename Run>
std::uint64_t at_every_allocation(const Run& run) {
  std::uint64_t hit = 0;
  for (const std::uint64_t count : {std::uint64_t{1}, kForEver}) {
    for (std::uint64_t from = 0;; ++from) {
      if (run(core::PoolRecord::Fault{from, count}) <= from) break;
      ++hit;
    }
  }
  return hit;
}

test::Scene wall_on_a_floor() {
  test::Scene scene;
  scene.solid = {{Vector3(-12, -12, -1), Vector3(12, 12, 0)}, {Vector3(3, -1, 0), Vector3(4, 1, 6)}};
  return scene;
}

BrickMap::Config small_map() {
  BrickMap::Config config;
  config.bounds_W = {Vector3(-12, -12, -3), Vector3(12, 12, 7)};
  config.max_bricks = 256;
  config.max_image_width = config.max_image_height = 32;
  return config;
}

TEST(Exhaustion, OfMapBricksLosesSpaceButNeverMakesSurfacesFree) {
  test::Scene scene = wall_on_a_floor();
  const Vector3 at(0.1, 0.2, 2.0);
  const auto frames = scene.look(at, 32, 9.0F);
  const std::array<Vector3, 1> here{at};
  const BrickMap::Config config = small_map();
  std::vector<std::byte> block(BrickMap::arena_bytes(config));
  core::UnlimitedBudget unlimited;
  double whole_m3 = 0.0;
  const auto run = [&](const core::PoolRecord::Fault& fault) {
    core::Arena arena(block);
    BrickMap sut(config, arena);
    EXPECT_FALSE(arena.exhausted());
    core::PoolRecord& pool = *arena.find("map bricks");
    pool.fault = fault;
    IntegrationResult result;
    EXPECT_NE(sut.integrate({frames, 0, kInfinity, here}, unlimited, result), Status::kInvalidArgument);
    const std::uint64_t asked = pool.allocations;
    if (fault.count == 0) whole_m3 = sut.known_volume_m3();
    EXPECT_LE(sut.known_volume_m3(), whole_m3 + 1e-6);
    EXPECT_EQ(sut.counters().bricks_refused > 0, asked > fault.from) << "refused, and not counted";
    core::Work work;
    (void)sut.export_view({0, kInfinity, at}, unlimited, work);
    std::uint64_t lookups = 0;
    for (double z = 0.45; z < 5.0; z += 0.6) {
      for (double y = -0.6; y < 0.7; y += 0.3)
        EXPECT_FALSE(sut.view().is_free(Aabb::around(Vector3(3.15, y, z), 0.1), lookups)) << fault.from;
    }
    // The fault gone, the map fills up again.
    pool.fault = {};
    (void)sut.integrate({frames, 0, kInfinity, here}, unlimited, result);
    (void)sut.export_view({0, kInfinity, at}, unlimited, work);
    EXPECT_TRUE(sut.view().is_free(Aabb::around(Vector3(1.0, 0.2, 2.0), 0.2), lookups)) << fault.from;
    return asked;
  };
  ASSERT_GT(run({}), 10U) << "hardly a brick: nothing was tested";
  EXPECT_GT(whole_m3, 100.0);
  EXPECT_GT(at_every_allocation(run), 20U);
}

TEST(Exhaustion, OfCloudPointsDropsAndCountsThem) {
  test::Scene scene;
  scene.solid = {{Vector3(-12, -12, -1), Vector3(12, 12, 0)}, {Vector3(3, -1, 0), Vector3(4, 1, 6)}};
  const auto frames = scene.look(Vector3(0.1, 0.2, 2.0), 16, 9.0F);
  std::vector<std::byte> block(PointCloud::arena_bytes({1024}));
  core::UnlimitedBudget unlimited;
  std::size_t whole = 0;
  const auto run = [&](const core::PoolRecord::Fault& fault) {
    core::Arena arena(block);
    PointCloud sut({1024}, arena);
    core::PoolRecord& pool = *arena.find("cloud points");
    pool.fault = fault;
    core::Work work;
    const Status status = sut.step(frames, 0, unlimited, work);
    if (fault.count == 0) whole = sut.points().size();
    const std::uint64_t asked = pool.allocations;
    EXPECT_EQ(status, asked > fault.from ? Status::kCapacity : Status::kOk);
    EXPECT_EQ(sut.counters().points_dropped > 0, asked > fault.from);
    EXPECT_LE(sut.points().size(), whole);
    for (const CloudPoint& p : sut.points()) EXPECT_TRUE(is_finite(p.p_W) && p.count > 0);
    return asked;
  };
  ASSERT_GT(run({}), 50U);
  EXPECT_GT(at_every_allocation(run), 100U);
}

TEST(Exhaustion, OfPlannerNodesStillGivesOnlyFreePaths) {
  test::BoxView view;
  view.free_W = {Vector3(-24, -24, 0), Vector3(24, 24, 12)};
  view.occupied = {{Vector3(8, -6, 0), Vector3(12, 6, 20)}};
  PlanRequest request;
  request.start_W = Vector3(0, 0, 5);
  request.goal_W = Vector3(20, 0, 5);
  request.bounds_W = {Vector3(-25, -25, 1.5), Vector3(200, 25, 10)};
  request.radius_m = 0.9;
  request.volume_m3 = 1e9;
  request.horizon_m = 24.0;
  request.seed = 1;
  RrtStar::Config config;
  config.max_samples = 400;
  std::vector<std::byte> block(RrtStar::arena_bytes(config));
  core::UnlimitedBudget unlimited;
  std::uint64_t paths = 0;
  const auto run = [&](const core::PoolRecord::Fault& fault) {
    core::Arena arena(block);
    RrtStar sut(config, arena);
    core::PoolRecord& pool = *arena.find("planner nodes");
    pool.fault = fault;
    PlanResult result;
    (void)sut.plan(request, view, unlimited, result);
    std::uint64_t lookups = 0;
    for (std::size_t i = 0; i + 1 < result.path_W.size(); ++i)
      EXPECT_TRUE(is_segment_free(view, result.path_W[i], result.path_W[i + 1], request.radius_m, lookups));
    paths += result.path_W.size() >= 2 ? 1U : 0U;
    return pool.allocations;
  };
  ASSERT_GT(run({}), 20U);
  ASSERT_EQ(paths, 1U);
  EXPECT_GT(at_every_allocation(run), 40U);
  EXPECT_GT(paths, 10U);
}

/// The plan of a flight is that of these three: whatever hands out elements while it runs is refused them
/// above, all other pools are tables that belong to it whole.
TEST(Exhaustion, EveryPoolThatHandsOutElementsWasRefusedThem) {
  test::Scene scene = wall_on_a_floor();
  const Vector3 at(0.1, 0.2, 2.0);
  const auto frames = scene.look(at, 16, 9.0F);
  const std::array<Vector3, 1> here{at};
  const BrickMap::Config config = small_map();
  std::vector<std::byte> block(BrickMap::arena_bytes(config) + PointCloud::arena_bytes({}) +
                               RrtStar::arena_bytes({}) + 4096);
  core::Arena arena(block);
  PointCloud cloud({}, arena);
  BrickMap map(config, arena);
  RrtStar planner({}, arena);
  ASSERT_FALSE(arena.exhausted());
  core::UnlimitedBudget unlimited;
  core::Work work;
  IntegrationResult integrated;
  (void)cloud.step(frames, 0, unlimited, work);
  (void)map.integrate({frames, 0, kInfinity, here}, unlimited, integrated);
  (void)map.export_view({0, kInfinity, at}, unlimited, work);
  PlanRequest request;
  request.start_W = at;
  request.goal_W = Vector3(50, 0, 2);
  request.bounds_W = config.bounds_W;
  request.radius_m = 0.3;
  request.volume_m3 = 1e9;
  request.horizon_m = 24.0;
  PlanResult planned;
  (void)planner.plan(request, map.view(), unlimited, planned);
  std::vector<std::string> handing_out;
  for (const core::PoolRecord& pool : arena.plan()) {
    if (pool.allocations > 0) handing_out.emplace_back(pool.name);
  }
  EXPECT_GT(arena.plan().size(), 8U);
  EXPECT_EQ(handing_out, (std::vector<std::string>{"cloud points", "map bricks", "planner nodes"}));
}

/// The start-up pools: a block that is any number of bytes too small is refused whole.
TEST(Exhaustion, OfTheArenaIsSeenAtEveryTake) {
  PointCloud::Config config;
  config.max_points = 256;
  const std::size_t enough = PointCloud::arena_bytes(config);
  std::vector<std::byte> block(enough);
  for (std::size_t bytes = 0; bytes < enough - 64; bytes += 8) {
    core::Arena arena({block.data(), bytes});
    EXPECT_TRUE((arena.take<std::byte>(256 * 16).empty() || arena.take<std::byte>(256 * 32).empty() ||
                 arena.take<std::byte>(256 * 4).empty()))
        << bytes;
    EXPECT_TRUE(arena.exhausted());
  }
}

}  // namespace
}  // namespace roborun::stages
