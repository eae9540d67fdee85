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
  EXPECT_TRUE(refused([](FlightConfig& c) { c.pixels_per_tan = kNaN; }));
}

/// 2 cm are a pixel of the coarsest camera (48 pixels per unit of the tangent) at 0.96 m: a quarter of that from look to look.
TEST(FlightConfig, TheCoarsestCameraSaysHowDenselyThinThingsAreLookedFor) {
  FlightConfig config = sound();
  EXPECT_EQ(governor_config(config).thin_step_m, governor::GovernorConfig{}.thin_step_m) << "no camera";
  SensorRig rig = six_cameras(96, 25.0);
  rig.cameras[2].width = rig.cameras[2].height = 480;
  describe_sensors(rig, config);
  EXPECT_DOUBLE_EQ(governor_config(config).thin_step_m, 0.24);
  config.vehicle.thinnest_m = 0.1;
  EXPECT_DOUBLE_EQ(governor_config(config).thin_step_m, 1.2);
}

TEST(FlightConfig, WhatIsTooNearForAllSensorsIsTakenToBeFreeAroundTheTopOfTheClimb) {
  const VehicleModel vehicle;  // planned with 0.9 m
  SensorRig rig = six_cameras(96, 25.0);
  const auto half_m = [&] {
    FlightConfig config = sound();
    describe_sensors(rig, config);
    return assumed_free_half_m(vehicle, config.sees_all_around, config.level_view_ratio, config.too_near_m);
  };
  EXPECT_TRUE(half_m().isZero(0.0)) << "they see it";
  for (CameraSpec& camera : rig.cameras) camera.range_min_m = 0.6;
  EXPECT_DOUBLE_EQ(half_m().minCoeff(), 0.9 + 0.25 + 0.3) << "room for a plan";
  for (CameraSpec& camera : rig.cameras) camera.range_min_m = 2.0;
  rig.cameras[3].mount.x_m = -0.2;
  EXPECT_DOUBLE_EQ(half_m().minCoeff(), 2.0 + 0.2 + 0.3) << "all that they do not see";
  for (CameraSpec& camera : rig.cameras) camera.range_min_m = 20.0;
  EXPECT_DOUBLE_EQ(half_m().maxCoeff(), 5.0) << "no more than somebody can answer for";
}

TEST(FlightConfig, TheCoarsestLookIsAThirdOfTheHeightWhateverTheFinestCellIs) {
  FlightConfig config = sound();
  config.bounds_W.max_W.z() = 10.0;
  EXPECT_DOUBLE_EQ(lattice_of(config).cell_size_m(governor_config(config).coarsest_level), 2.4);
  config.vehicle.finest_cell_m = 0.15;
  EXPECT_DOUBLE_EQ(lattice_of(config).cell_size_m(governor_config(config).coarsest_level), 2.4)
      << "a whole block of 16 cells";
  config.vehicle.finest_cell_m = 0.1;
  EXPECT_DOUBLE_EQ(lattice_of(config).cell_size_m(governor_config(config).coarsest_level), 1.6);
}

}  // namespace
}  // namespace roborun::flight
