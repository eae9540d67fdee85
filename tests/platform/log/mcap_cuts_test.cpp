#include "tests/platform/log/cuts.hpp"
#include "tests/platform/log/mutations.hpp"

namespace roborun::log {
namespace {

TEST(McapCuts, OfAMegabyteAreReadToTheCut) { test::expect_cuts_read(test::sample_log(100, 1000), 1'000'000); }

TEST(McapMutations, OneHundredThousandAreReadToTheirDamage) { test::expect_mutations_read(100'000); }

}  // namespace
}  // namespace roborun::log
