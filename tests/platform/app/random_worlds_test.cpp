#include "tests/platform/app/random_worlds.hpp"

namespace roborun::app {
namespace {

TEST(RandomWorlds, ThreeHundredAreFlownWithinTheLimitsAndAlwaysWithAStop) {
  expect_safe(fly_random_worlds(0, 300), 300);
}

}  // namespace
}  // namespace roborun::app
