#include "tests/platform/mission/random_worlds.hpp"

namespace roborun::mission {
namespace {

constexpr int kWorlds = 75;

/// 300 in four parts, so that they may run side by side.
class RandomWorlds : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(RandomWorlds, AreFlownWithinTheLimitsAndAlwaysWithAStop) {
  expect_safe(fly_random_worlds(GetParam(), kWorlds), kWorlds);
}
INSTANTIATE_TEST_SUITE_P(From, RandomWorlds, ::testing::Values(0, 75, 150, 225));

}  // namespace
}  // namespace roborun::mission
