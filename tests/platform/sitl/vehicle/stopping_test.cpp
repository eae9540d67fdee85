// The stopping model that the governor uses, against the simulated vehicle: braking from every speed, in
// wind.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "governor/models/stopping_model.hpp"
#include "platform/app/decision_pipeline.hpp"
#include "stages/planning/smoother.hpp"
#include "tests/platform/sitl/vehicle/flight.hpp"

namespace roborun::test {
namespace {

/// How far the true vehicle travels beyond the point where its brake trajectory took over.
double stopping_distance_m(double speed_mps, std::uint64_t seed) {
  Flight flight(seed);
  const Vector3 from_W = flight.lane().committed().end_W();
  const Vector3 way(10.0 * speed_mps, 0.0, 0.0);
  const MonotonicTime start = flight.now() + Flight::kFrame;
  const Trajectory cruise = straight(from_W, from_W + way, speed_mps, start);
  flight.lane().offer(cruise);
  const MonotonicTime begin = start + from_seconds(0.5 * cruise.duration_s());
  while (flight.now() < begin) flight.step();
  const double acceleration = app::PipelineConfig{}.acceleration_mps2;
  Trajectory brake;
  stages::Smoother smoother;
  EXPECT_EQ(smoother.brake(cruise.at(begin), begin, {30.0, acceleration}, brake), Status::kOk);
  flight.lane().offer(brake);
  const Vector3 at_W = flight.truth().p_WB;
  double farthest_m = 0.0;
  for (int k = 0; k < static_cast<int>((brake.duration_s() + 3.0) * 400.0); ++k) {
    flight.step();
    farthest_m = std::max(farthest_m, (flight.truth().p_WB - at_W).norm());
  }
  return farthest_m;
}

TEST(Stopping, TheModelIsNeverShorterThanTheVehicleAndAtMostAThirdOfAMetreLonger) {
  for (const double speed_mps : {0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0}) {
    double longest_m = 0.0;
    for (std::uint64_t seed = 1; seed <= 4; ++seed)
      longest_m = std::max(longest_m, stopping_distance_m(speed_mps, seed));
    const double model_m = governor::kSitlQuadrotorStopping.distance_m(speed_mps);
    RecordProperty("stop_from_" + std::to_string(speed_mps), std::to_string(longest_m));
    EXPECT_GE(model_m, longest_m) << speed_mps << " m/s";
    EXPECT_LE(model_m, longest_m + 0.33) << speed_mps << " m/s";
  }
}

}  // namespace
}  // namespace roborun::test
