#include "tests/platform/mission/killed_flight.hpp"

namespace roborun::mission {
namespace {

TEST(KilledFlight, LosesAtMostItsLastSecond) { test::kill_flights(4); }

}  // namespace
}  // namespace roborun::mission
