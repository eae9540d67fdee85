#include "platform/sitl/world/generator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <set>

#include "platform/input/input_error.hpp"

namespace roborun::sitl {
namespace {

bool same(const World& a, const World& b) {
  if (a.pillars().size() != b.pillars().size()) return false;
  for (std::size_t i = 0; i < a.pillars().size(); ++i) {
    if (a.pillars()[i].x_m != b.pillars()[i].x_m || a.pillars()[i].y_m != b.pillars()[i].y_m) return false;
  }
  return true;
}

TEST(Generator, SameSeedSameWorldOtherSeedOtherWorld) {
  const EnvironmentKnobs knobs;
  const World world = generate(knobs, Mission::kPackageDelivery, 7);
  EXPECT_TRUE(same(world, generate(knobs, Mission::kPackageDelivery, 7)));
  EXPECT_FALSE(same(world, generate(knobs, Mission::kPackageDelivery, 8)));
}

TEST(Generator, StartAndGoalAreFreeAndTheDistanceIsTheKnob) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    const World world = generate({.density_ratio = 1.0}, Mission::kPackageDelivery, seed);
    EXPECT_GE(world.clearance_m(world.start_W(), 5.0), 1.0) << seed;
    EXPECT_GE(world.clearance_m(world.goal_W(), 5.0), 1.0) << seed;
    EXPECT_NEAR((world.goal_W() - world.start_W()).norm(), 900.0, 1e-9);
  }
}

TEST(Generator, NeighboursLeaveTheGap) {
  const EnvironmentKnobs knobs{.density_ratio = 1.0, .gap_m = 6.0};
  const World world = generate(knobs, Mission::kPackageDelivery, 1);
  const auto& p = world.pillars();
  for (std::size_t i = 0; i < p.size(); ++i) {
    EXPECT_NEAR(p[i].radius_m, 2.0, 1e-12) << "pillar diameter = grid - gap";
    for (std::size_t k = i + 1; k < p.size(); ++k) {
      const double free_m =
          std::hypot(p[i].x_m - p[k].x_m, p[i].y_m - p[k].y_m) - p[i].radius_m - p[k].radius_m;
      ASSERT_GE(free_m, knobs.gap_m - 1e-9);
    }
  }
}

std::size_t count(const EnvironmentKnobs& knobs, Mission mission = Mission::kPackageDelivery) {
  std::size_t sum = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) sum += generate(knobs, mission, seed).pillars().size();
  return sum;
}

TEST(Generator, EveryKnobDoesWhatItSays) {
  EXPECT_EQ(count({.density_ratio = 0.0}), 0U);
  EXPECT_GT(count({.density_ratio = 0.6}), count({.density_ratio = 0.3}));
  EXPECT_GT(count({.spread_m = 120.0}), count({.spread_m = 40.0}));
  EXPECT_GT(count({.distribution = Distribution::kUniform}), count({}));
  EXPECT_GT(count({.grid_m = 10.0}), count({.grid_m = 20.0}));
  EXPECT_GT(count({.extra_centroids_ratio = {0.5}}), count({}));
}

TEST(Generator, TheDensityAtACentroidIsTheKnob) {
  // Uniform within the spread: the share of filled cells is the density itself.
  const EnvironmentKnobs knobs{.density_ratio = 0.45, .distribution = Distribution::kUniform};
  const double cells = 2.0 * 20.0 * 3.14159265 * 80.0 * 80.0 / 100.0;
  EXPECT_NEAR(static_cast<double>(count(knobs)) / cells, 0.45, 0.03);
}

TEST(Generator, ObstaclesStayWithinTheSpread) {
  const World world = generate({.density_ratio = 1.0, .spread_m = 40.0}, Mission::kPackageDelivery, 3);
  for (const Pillar& p : world.pillars()) {
    const double to_start_m = std::hypot(p.x_m, p.y_m);
    const double to_goal_m = std::hypot(p.x_m - 900.0, p.y_m);
    EXPECT_LE(std::min(to_start_m, to_goal_m), 40.0 + 10.0);
  }
}

TEST(Generator, ARescueMissionStartsInHalfTheCongestionAndEndsInRubble) {
  std::size_t near_start[2] = {0, 0};
  bool rubble = false;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    int i = 0;
    for (const Mission mission : {Mission::kPackageDelivery, Mission::kSearchAndRescue}) {
      const World world = generate({}, mission, seed);
      for (const Pillar& p : world.pillars()) {
        near_start[i] += p.x_m < 450.0 ? 1 : 0;
        rubble = rubble || (i == 1 && p.x_m > 450.0 && p.top_m < 5.0);
      }
      for (const Aabb& box : world.boxes()) rubble = rubble || (i == 1 && box.max_W.z() < 5.0);
      ++i;
    }
  }
  EXPECT_LT(near_start[1], 0.7 * static_cast<double>(near_start[0]));
  EXPECT_TRUE(rubble);
}

TEST(Generator, RefusesKnobsOutOfRange) {
  for (const EnvironmentKnobs& bad :
       {EnvironmentKnobs{.density_ratio = 1.1}, EnvironmentKnobs{.density_ratio = std::nan("")},
        EnvironmentKnobs{.spread_m = 0.0}, EnvironmentKnobs{.centroid_distance_m = -1.0},
        EnvironmentKnobs{.grid_m = 1.0}, EnvironmentKnobs{.gap_m = 10.0}}) {
    EXPECT_THROW((void)generate(bad, Mission::kPackageDelivery, 1), InputError);
  }
}

TEST(Environments, AreNumberedWithTheDensitySlowestAndTheDistanceFastest) {
  std::set<std::string> names;
  for (int number = 1; number <= 27; ++number) {
    const NamedEnvironment e = environment(std::to_string(number));
    EXPECT_EQ(e.number, number);
    EXPECT_EQ(environment(e.name).number, number);
    names.insert(e.name);
  }
  EXPECT_EQ(names.size(), 27U);
  const auto knobs = [](const char* n) { return environment(n).knobs; };
  EXPECT_EQ(knobs("1").density_ratio, 0.3);
  EXPECT_EQ(knobs("1").spread_m, 40.0);
  EXPECT_EQ(knobs("1").centroid_distance_m, 600.0);
  EXPECT_EQ(knobs("2").centroid_distance_m, 900.0);
  EXPECT_EQ(knobs("4").spread_m, 80.0);
  EXPECT_EQ(knobs("10").density_ratio, 0.45);
  EXPECT_EQ(knobs("14").density_ratio, 0.45);
  EXPECT_EQ(knobs("14").spread_m, 80.0);
  EXPECT_EQ(knobs("14").centroid_distance_m, 900.0);
  EXPECT_EQ(knobs("27").centroid_distance_m, 1200.0);
  for (const char* bad : {"0", "28", "", "-1", "14 ", "1e1", "density0.45", "99999999999999999999"})
    EXPECT_THROW((void)environment(bad), InputError) << bad;
}

}  // namespace
}  // namespace roborun::sitl
