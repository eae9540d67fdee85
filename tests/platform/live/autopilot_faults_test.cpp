/// A sample of the table of faults.
#include "tests/platform/live/autopilot_faults.hpp"

namespace roborun::live {
namespace {

class AutopilotFaults : public ::testing::TestWithParam<AutopilotKind> {};

TEST_P(AutopilotFaults, EndWhereItIsWritten) {
  expect_as_written(mission::autopilot_config(GetParam()), mission::middle_world, {1}, 1, 30.0);
}

INSTANTIATE_TEST_SUITE_P(Both, AutopilotFaults,
                         ::testing::Values(AutopilotKind::kPx4, AutopilotKind::kArduCopter),
                         [](const auto& p) { return std::string(mission::to_string(p.param)); });

}  // namespace
}  // namespace roborun::live
