#include "tests/platform/mission/random_worlds.hpp"

namespace roborun::mission {
namespace {

constexpr int kWorlds = 1000;

/// 10,000 in ten parts, none of them among the 300 of every test run.
class ManyRandomWorlds : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(ManyRandomWorlds, AreFlownWithinTheLimitsAndAlwaysWithAStop) {
  expect_safe(fly_random_worlds(GetParam(), kWorlds), kWorlds);
}
INSTANTIATE_TEST_SUITE_P(From, ManyRandomWorlds, ::testing::Range<std::uint64_t>(1000, 11000, kWorlds));

}  // namespace
}  // namespace roborun::mission
