#include "tests/platform/log/cuts.hpp"

namespace roborun::log {
namespace {

TEST(McapCuts, OfTwoHundredKilobytesAreReadToTheCut) {
  test::expect_cuts_read(test::sample_log(100, 640), 180'000);
}

}  // namespace
}  // namespace roborun::log
