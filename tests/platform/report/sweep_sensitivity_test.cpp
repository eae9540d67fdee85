#include "platform/report/sweep_sensitivity.hpp"

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "platform/sitl/world/generator.hpp"
#include "tests/platform/report/sample.hpp"

namespace roborun::report {
namespace {

SweepRow row(int environment, std::uint64_t seed = 1) {
  const sitl::NamedEnvironment named = sitl::environment(std::to_string(environment));
  SweepRow r{test::sample_mission("aware", 4.0).result, named.knobs.density_ratio, named.knobs.spread_m,
             named.knobs.centroid_distance_m};
  r.result.env = std::to_string(environment);
  r.result.seed = seed;
  return r;
}

Sensitivity of(const std::vector<SweepRow>& rows, std::size_t knob) {
  return sensitivity_of(rows, "paper", "aware", kKnobs.at(knob));
}

TEST(Sensitivity, ComparesInAllEnvironmentsEachWithItsTwins) {
  std::vector<SweepRow> rows;
  for (int e = 1; e <= 27; ++e) rows.push_back(row(e));
  for (std::size_t knob = 0; knob < kKnobs.size(); ++knob) {
    const Sensitivity sut = of(rows, knob);
    EXPECT_EQ(sut.missing, "");
    for (std::size_t value = 0; value < 3; ++value) {
      ASSERT_EQ(sut.at.at(value).size(), 9U);
      for (std::size_t i = 0; i < 9; ++i) {
        EXPECT_DOUBLE_EQ(kKnobs.at(knob).value(*sut.at.at(value)[i]), kKnobs.at(knob).values.at(value));
        for (std::size_t other = 0; other < kKnobs.size(); ++other) {
          if (other != knob) {
            EXPECT_DOUBLE_EQ(kKnobs.at(other).value(*sut.at.at(value)[i]),
                             kKnobs.at(other).value(*sut.at.front()[i]));
          }
        }
      }
    }
  }
}

TEST(Sensitivity, NamesTheEnvironmentsThatAreMissingByTheirNumbers) {
  EXPECT_EQ(of({row(1), row(14), row(27)}, 0).missing, "beside 1: 10, 19 missing");
  EXPECT_EQ(of({row(1), row(14), row(27)}, 1).missing, "beside 1: 4, 7 missing");
  EXPECT_EQ(of({row(1), row(14), row(27)}, 2).missing, "beside 1: 2, 3 missing");
  EXPECT_EQ(of({row(1), row(13), row(15)}, 2).missing, "beside 13, 15: 14 missing") << "the nearest to whole";
  EXPECT_EQ(of({}, 2).missing, "no mission counts");
}

TEST(Sensitivity, LeavesOutMissionsWhoseTwinDidNotArriveOrIsOfAnotherSeed) {
  std::vector<SweepRow> rows{row(1), row(2), row(3), row(4), row(5), row(6), row(7), row(8), row(9, 2)};
  EXPECT_EQ(of(rows, 2).at.front().size(), 2U);
  EXPECT_EQ(of(rows, 2).missions, 9U);
  rows[1].result.collided = true;
  EXPECT_EQ(of(rows, 2).at.front().size(), 1U);
  rows[3].result.reached_goal = false;
  EXPECT_EQ(of(rows, 2).missing, "beside 1, 3: 2 missing");
}

TEST(Sensitivity, LeavesOutOtherEnvironmentsThanThe27) {
  SweepRow odd = row(1);
  odd.density_ratio = 0.5;
  EXPECT_EQ(of({odd, row(2), row(3)}, 2).missing, "beside 2, 3: 1 missing");
}

}  // namespace
}  // namespace roborun::report
