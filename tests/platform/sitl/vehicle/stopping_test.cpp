// The stopping model that the governor uses, against the simulated vehicle: braking from every speed, in
// wind.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "core/stopping_model.hpp"
#include "platform/board/stopping_sweep.hpp"

namespace roborun::app {
namespace {

constexpr std::array<double, 7> kSpeeds_mps{0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0};

TEST(Stopping, TheModelIsNeverShorterThanTheVehicleAndAtMostTwiceAsLong) {
  for (const board::StoppingPoint& p : board::stopping_sweep(kSpeeds_mps, 4, {})) {
    const double model_m = kSitlQuadrotorStopping.distance_m(p.speed_mps);
    std::printf("%.1f m/s: %.3f m, model %.3f m\n", p.speed_mps, p.distance_m, model_m);
    EXPECT_GT(p.distance_m, 0.0);
    EXPECT_GE(model_m, p.distance_m) << p.speed_mps << " m/s";
    // The model was fitted before slow stops took only what the jerk needs: at 0.5 m/s it is 0.15 m longer than the vehicle.
    EXPECT_LE(model_m, std::max(2.0 * p.distance_m, p.distance_m + 0.15)) << p.speed_mps << " m/s";
  }
}

TEST(Stopping, AFitIsWithinTwoPercent) {
  const board::StoppingFit fit = board::fit_stopping(board::stopping_sweep(kSpeeds_mps, 2, {}));
  EXPECT_LT(fit.mean_squared_relative, 0.02);
  EXPECT_GT(fit.model.quadratic_s2pm, 0.0);
}

}  // namespace
}  // namespace roborun::app
