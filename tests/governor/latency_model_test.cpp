#include "governor/models/latency_model.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/random/counter_rng.hpp"

namespace roborun::governor {
namespace {

constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();
constexpr double kEndless = std::numeric_limits<double>::infinity();

LatencyModel some_model() {
  LatencyModel model;
  model.fixed_s = {0.6, 0.5, 0.4, 0.3, 0.2, 0.1};
  model.slope_s_per_m3 = {6e-3, 5e-3, 4e-3, 3e-3, 2e-3, 1e-3};
  return model;
}

TEST(LatencyModel, IsValidIfAllOfItIsFiniteAndNotNegative) {
  EXPECT_EQ(LatencyModel{}.validate(), Status::kOk);
  EXPECT_EQ(some_model().validate(), Status::kOk);
  for (const double bad : {kNotANumber, kEndless, -1e-9}) {
    for (std::size_t i = 0; i < kPrecisionLevels; ++i) {
      LatencyModel fixed = some_model(), slope = some_model();
      fixed.fixed_s[i] = slope.slope_s_per_m3[i] = bad;
      EXPECT_EQ(fixed.validate(), Status::kInvalidArgument) << i;
      EXPECT_EQ(slope.validate(), Status::kInvalidArgument) << i;
    }
  }
}

TEST(LatencyModel, TakesLevelsAndVolumesOutsideAsTheNearestInside) {
  const LatencyModel model = some_model();
  for (int level = 0; level < kPrecisionLevels; ++level)
    EXPECT_DOUBLE_EQ(model.latency_s(level, 10.0), 0.6 - 0.1 * level + 10.0 * (6e-3 - 1e-3 * level));
  EXPECT_EQ(model.latency_s(-1, 10.0), model.latency_s(0, 10.0));
  EXPECT_EQ(model.latency_s(kPrecisionLevels, 10.0), model.latency_s(kPrecisionLevels - 1, 10.0));
  EXPECT_EQ(model.latency_s(2, -5.0), 0.4);
}

TEST(LatencyModel, OfASlowerMachineTakesSoManyTimesAsLong) {
  const LatencyModel model = some_model(), slow = slower(model, 2.5);
  for (int level = 0; level < kPrecisionLevels; ++level)
    for (const double volume_m3 : {0.0, 100.0})
      EXPECT_DOUBLE_EQ(slow.latency_s(level, volume_m3), 2.5 * model.latency_s(level, volume_m3));
}

TEST(LatencyModel, OfEq4IsThePublishedPolynomial) {
  for (const double finest_m : {0.3, 0.1}) {
    const LatencyModel model = from_eq4({{0.007, -0.02, 0.05, 3.0}}, finest_m);
    for (int level = 0; level < kPrecisionLevels; ++level) {
      const double p = finest_m * std::pow(2.0, level);
      const double published = (0.007 / (p * p * p) - 0.02 / (p * p) + 0.05 / p) * 3.0;
      EXPECT_NEAR(model.slope_s_per_m3[static_cast<std::size_t>(level)], published, 1e-9 * published);
      EXPECT_EQ(model.fixed_s[static_cast<std::size_t>(level)], 0.0);
    }
  }
  for (const double slope : from_eq4({{-1.0, 0.0, 0.0, 1.0}}).slope_s_per_m3) EXPECT_EQ(slope, 0.0);
  core::StageCost cost;
  cost.fixed_s.fill(0.25);
  cost.per_m3_s.fill(0.5);
  EXPECT_EQ(from_cost(cost).latency_s(3, 2.0), 1.25);
}

/// What the fit may add up, each with a factor that is not negative.
double term(std::size_t i, const LatencyPoint& p) {
  const double r = 1.0 / (0.3 * std::pow(2.0, p.level));
  if (i < 4) return std::pow(r, 3.0 - static_cast<double>(i)) * p.volume_m3;
  return p.level <= static_cast<int>(i) - 4 ? 1.0 : 0.0;
}

TEST(FitLatency, IsTheLeastRelativeErrorOfAllSuchModels) {
  // At the least of a convex function no term may help if there were more of it, and those that are there would not if scaled.
  core::CounterRng rng(5, 21);
  for (int trial = 0; trial < 40; ++trial) {
    std::vector<LatencyPoint> points;
    for (int i = 0; i < 60; ++i) {
      const int level = i % kPrecisionLevels;
      const double volume_m3 = rng.uniform(0.0, 2e4);
      const double true_s = 0.02 + 1e-6 * volume_m3 * (1.0 + 10.0 * std::pow(0.5, level));
      points.push_back({level, volume_m3, true_s * rng.uniform(0.5, 1.5)});
    }
    for (const double not_measured_s : {0.0, -1.0, kNotANumber}) points.push_back({1, 5e3, not_measured_s});
    const LatencyModel fit = fit_latency(points);
    double scaled = 0.0;
    for (std::size_t i = 0; i < 10; ++i) {
      double slope = 0.0, square = 0.0;
      for (const LatencyPoint& p : points) {
        if (!(p.latency_s > 0.0)) continue;
        const double error = fit.latency_s(p.level, p.volume_m3) / p.latency_s - 1.0;
        const double part = term(i, p) / p.latency_s;
        slope += error * part;
        square += part * part;
      }
      EXPECT_GE(slope, -1e-6 * std::sqrt(square)) << trial << ": more of term " << i << " would be better";
    }
    for (const LatencyPoint& p : points) {
      if (!(p.latency_s > 0.0)) continue;
      const double ratio = fit.latency_s(p.level, p.volume_m3) / p.latency_s;
      scaled += (ratio - 1.0) * ratio;
    }
    EXPECT_NEAR(scaled, 0.0, 1e-6) << trial;
  }
}

TEST(FitLatency, OfNothingIsNothing) {
  const std::vector<LatencyPoint> points{{0, 10.0, 0.0}, {1, 10.0, -2.0}, {2, 10.0, kNotANumber}};
  const LatencyModel fit = fit_latency(points);
  EXPECT_EQ(fit.validate(), Status::kOk);
  for (int level = 0; level < kPrecisionLevels; ++level) EXPECT_EQ(fit.latency_s(level, 1e4), 0.0);
}

TEST(FitLatency, OfOnePointGoesThroughIt) {
  for (int level = 0; level < kPrecisionLevels; ++level)
    for (const double volume_m3 : {0.0, 1.0, 1e4}) {
      const std::vector<LatencyPoint> points{{level, volume_m3, 0.25}};
      EXPECT_NEAR(fit_latency(points).latency_s(level, volume_m3), 0.25, 1e-9) << level << ' ' << volume_m3;
    }
}

TEST(ModelError, IsThatOfTheMeasuredPoints) {
  const LatencyModel model = some_model();
  const std::vector<LatencyPoint> points{{0, 0.0, 0.5}, {5, 0.0, 0.2},  {3, 0.0, 0.3},
                                         {3, 0.0, 0.0}, {3, 0.0, -1.0}, {3, 0.0, kNotANumber}};
  const ModelError error = error_of(model, points);
  EXPECT_NEAR(error.max_relative, 0.5, 1e-12);
  EXPECT_NEAR(error.mean_relative, (0.2 + 0.5 + 0.0) / 3.0, 1e-12);
  EXPECT_EQ(error_of(model, {}).mean_relative, 0.0);
}

TEST(DriftScale, TakesNoPredictionThatIsNoneAndFallsToOne) {
  DriftScale sut;
  sut.observe(0.5, 1.5);
  EXPECT_DOUBLE_EQ(sut.value(), 3.0);
  for (const double none : {0.0, -0.5, kNotANumber}) {
    sut.observe(none, 1.0);
    sut.observe(none, 0.0);
  }
  sut.observe(1.0, -1.0);
  sut.observe(1.0, kNotANumber);
  EXPECT_DOUBLE_EQ(sut.value(), 3.0);
  sut.observe(1.0, 0.0);
  EXPECT_DOUBLE_EQ(sut.value(), 2.94);
  for (int i = 0; i < 100; ++i) sut.observe(1.0, 0.0);
  EXPECT_EQ(sut.value(), 1.0);
}

}  // namespace
}  // namespace roborun::governor
