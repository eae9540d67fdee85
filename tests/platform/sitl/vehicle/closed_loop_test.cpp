// How far the true vehicle is from where its trajectory says: in wind, with biased, noisy and late sensors.
#include <gtest/gtest.h>

#include <algorithm>

#include "platform/app/decision_pipeline.hpp"
#include "tests/platform/sitl/vehicle/flight.hpp"

namespace roborun::test {
namespace {

TEST(ClosedLoop, TheTrackingErrorStaysWithinTheInflation) {
  const double inflation_m = app::PipelineConfig{}.inflation_m;
  double worst_m = 0.0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Flight flight(seed);
    const Vector3 from_W = flight.lane().committed().end_W();
    const Vector3 way(60.0, seed % 2 == 0 ? 0.0 : 30.0, seed % 3 == 0 ? 3.0 : 0.0);
    const Trajectory line = straight(from_W, from_W + way, 6.0, flight.now() + Flight::kFrame);
    flight.lane().offer(line);
    for (int k = 0; k < static_cast<int>((line.duration_s() + 2.0) * 400.0); ++k) {
      flight.step();
      const double error_m = (flight.truth().p_WB - flight.lane().committed().at(flight.now()).p_W).norm();
      worst_m = std::max(worst_m, error_m);
    }
    EXPECT_LT(flight.truth().v_WB.norm(), 0.4) << "hovers at the end";
  }
  RecordProperty("worst_tracking_error_m", std::to_string(worst_m));
  EXPECT_LT(worst_m, inflation_m);
}

}  // namespace
}  // namespace roborun::test
