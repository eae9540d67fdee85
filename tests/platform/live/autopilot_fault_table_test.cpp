/// The whole table: twenty moments of each of four flights through environment 14 and through forests.
#include "tests/platform/live/autopilot_faults.hpp"

namespace roborun::live {
namespace {

class AutopilotFaultTable : public ::testing::TestWithParam<AutopilotKind> {};

TEST_P(AutopilotFaultTable, EndsWhereItIsWrittenAtTwentyMomentsOfEachFlight) {
  expect_as_written(mission::autopilot_config(GetParam()), mission::middle_world, {1, 2, 3, 4}, 20, 160.0);
}

TEST_P(AutopilotFaultTable, EndsAsWrittenInForests) {
  expect_as_written(mission::near_sighted_config(GetParam()), mission::forest_world, {1, 2, 3, 4}, 20, 25.0);
}

INSTANTIATE_TEST_SUITE_P(Both, AutopilotFaultTable,
                         ::testing::Values(AutopilotKind::kPx4, AutopilotKind::kArduCopter),
                         [](const auto& p) { return std::string(mission::to_string(p.param)); });

}  // namespace
}  // namespace roborun::live
