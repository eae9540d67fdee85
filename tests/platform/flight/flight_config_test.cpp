#include "platform/flight/flight_config.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "core/executive/stage_meter.hpp"
#include "platform/flight/flight_system.hpp"

namespace roborun::flight {
namespace {

FlightConfig sound() {
  FlightConfig config;
  config.bounds_W = {Vector3(-10, -10, 1), Vector3(10, 10, 8)};
  config.goal_W = Vector3(5, 0, 3);
  config.cruise_m = 3.0;
  return config;
}

TEST(FlightConfig, IsRefusedWhereANumberCannotBe) {
  ASSERT_EQ(sound().validate(), Status::kOk);
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const auto refused = [](auto&& change) {
    FlightConfig config = sound();
    change(config);
    return config.validate() == Status::kInvalidArgument;
  };
  EXPECT_TRUE(refused([](FlightConfig& c) { c.bounds_W.max_W.z() = 0.0; })) << "an empty space";
  EXPECT_TRUE(refused([](FlightConfig& c) { c.goal_W.x() = kNaN; }));
  EXPECT_TRUE(refused([](FlightConfig& c) { c.cruise_m = kNaN; }));
  EXPECT_TRUE(refused([](FlightConfig& c) { c.vehicle.mass_kg = kNaN; }));
  EXPECT_TRUE(refused([](FlightConfig& c) { c.camera_range_m = 0.5; }));
  EXPECT_TRUE(refused([](FlightConfig& c) { c.minor_frame = Nanos{0}; }));
  EXPECT_TRUE(refused([](FlightConfig& c) { c.minor_frame = Nanos{1}; }));
  EXPECT_TRUE(refused([](FlightConfig& c) { c.gaze.yaw_rate_radps = 0.0; }));
}

}  // namespace
}  // namespace roborun::flight
