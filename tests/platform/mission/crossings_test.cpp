#include <gtest/gtest.h>

#include "tests/platform/mission/moving_bodies.hpp"

namespace roborun::mission {
namespace {

// The figures stand in stages/planning/README.md; what is asserted is less, so that a change that is no
// regression may move single flights.
TEST(Crossings, OfAHundredWorldsFewEndInABody) {
  const CrossingsResult result = fly_crossings(0, 100, 0.15);
  EXPECT_EQ(result.collided, 0) << "flown into";
  EXPECT_LE(result.struck_moving + result.struck_at_rest, 4);
  EXPECT_GE(result.reached, 95);
}

}  // namespace
}  // namespace roborun::mission
