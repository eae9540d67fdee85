#include "platform/flight/rest_of_budget.hpp"

#include <gtest/gtest.h>

namespace roborun::flight {
namespace {

class TenUnits final : public core::StageBudget {
 public:
  [[nodiscard]] bool spent(const core::Work& done) noexcept override { return done.units >= 10; }
};

TEST(RestOfBudget, CallsThatCountFromZeroShareWhatIsThere) {
  TenUnits whole;
  core::Work before, now;
  before.units = 7;
  RestOfBudget sut(whole, before);
  now.units = 2;
  EXPECT_FALSE(sut.spent(now));
  now.units = 3;
  EXPECT_TRUE(sut.spent(now));
  before.units = 10;
  now.units = 0;
  EXPECT_TRUE(sut.spent(now)) << "what was spent meanwhile counts, too";
}

}  // namespace
}  // namespace roborun::flight
