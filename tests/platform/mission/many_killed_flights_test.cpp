#include "tests/platform/mission/killed_flight.hpp"

namespace roborun::mission {
namespace {

TEST(KilledFlights, LoseAtMostTheirLastSecond) { test::kill_flights(100); }

}  // namespace
}  // namespace roborun::mission
