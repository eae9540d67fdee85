#include <cstdlib>

#include "tests/platform/app/random_worlds.hpp"

namespace roborun::app {
namespace {

/// ROBORUN_WORLDS sets another number of worlds.
TEST(ManyRandomWorlds, TenThousandAreFlownWithinTheLimitsAndAlwaysWithAStop) {
  const char* wanted = std::getenv("ROBORUN_WORLDS");
  const int worlds = wanted != nullptr ? std::atoi(wanted) : 10000;
  expect_safe(fly_random_worlds(1000, static_cast<std::uint64_t>(worlds)), worlds);
}

}  // namespace
}  // namespace roborun::app
