#include "platform/mission/settings_file.hpp"

#include <gtest/gtest.h>

#include "platform/input/input_error.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::mission {
namespace {

TEST(Settings, OverwritesWhatIsThereAndKeepsTheRest) {
  MissionConfig config;
  load_settings(test::scratch_file("settings.toml",
                                   "[camera]\npixels = 64\nrange_m = 18.5\n[wind]\nmean_mps = [4, 0, 0]\n"),
                config);
  EXPECT_EQ(config.simulator.camera.pixels, 64);
  EXPECT_EQ(config.simulator.camera.range_m, 18.5);
  EXPECT_EQ(config.simulator.camera.rate_Hz, sitl::DepthCameraConfig{}.rate_Hz);
  EXPECT_EQ(config.simulator.wind.mean_W_mps, Vector3(4.0, 0.0, 0.0));
  EXPECT_EQ(config.simulator.wind.gust_mps, sitl::WindConfig{}.gust_mps);
}

TEST(Settings, RefusesWithFileLineKeyAndRange) {
  const std::pair<const char*, const char*> cases[] = {
      {"[camera]\nrange_m = 1000\n", ":2: range_m: must be a number from 5 to 100"},
      {"[camera]\npixels = 96.5\n", ":2: pixels: must be a whole number from 8 to 1280"},
      {"[cpu]\nslow_down_factor = 2\n", ":2: slow_down_factor: goes with the other key"},
      {"[cpu]\nslow_down_at_s = 2\n", ":2: slow_down_at_s: goes with the other key"},
      {"[camera]\nrange = 10\n", ":2: range: unknown key in [camera]"},
      {"[wind]\nmean_mps = [30, 0, 0]\n", ":2: mean_mps: must be at most 20 m/s"},
      {"[engine]\n", "engine: unknown key in the file"},
      {"camera = 3\n", ":1: camera: must be a table"},
      {"[flight]\nv_max_mps = nan\n", ":2: v_max_mps: must be a number"},
      {"[flight]\naim = \"money\"\n", ":2: aim: must be \"time\" or \"energy\""},
  };
  for (const auto& [text, says] : cases) {
    MissionConfig config;
    try {
      load_settings(test::scratch_file("bad.toml", text), config);
      ADD_FAILURE() << text;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(says), std::string::npos) << error.what();
    }
  }
}

TEST(Settings, SayWhatTheFlightIsToSave) {
  MissionConfig config;
  EXPECT_EQ(config.flight.aim, governor::Aim::kTime);
  load_settings(test::scratch_file("aim.toml", "[flight]\naim = \"energy\"\n"), config);
  EXPECT_EQ(config.flight.aim, governor::Aim::kEnergy);
}

TEST(Settings, ModelsGoForAllSensorsOfAKind) {
  MissionConfig config;
  SensorRig& rig = config.simulator.rig.emplace(six_cameras(96, 25.0));
  (void)rig.lidars.push_back({});
  load_settings(
      test::scratch_file("models.toml",
                         "[camera]\nmodel = \"d455\"\ninvalid_ratio = 0.3\n[lidar]\nmodel = \"ring\"\n"
                         "[imu]\nmodel = \"mems\"\n[gnss]\nmodel = \"m9n\"\n[odometry]\nmodel = \"vio\"\n"
                         "[rain]\nrate_mmph = 5\n"),
      config);
  for (const CameraSpec& camera : rig.cameras) {
    EXPECT_EQ(camera.model, CameraModel::kD455);
    EXPECT_EQ(camera.invalid_ratio, 0.3);
  }
  EXPECT_EQ(rig.lidars[0].model, LidarModel::kRing);
  EXPECT_EQ(config.simulator.sensors.imu, ImuModel::kMems);
  EXPECT_EQ(config.simulator.sensors.gnss, GnssModel::kM9n);
  EXPECT_EQ(config.simulator.sensors.odometry, OdometryModel::kVio);
  EXPECT_EQ(config.simulator.lidar.rain_mmph, 5.0);
}

TEST(Settings, RefusesModelsAndNumbersThatNoSensorHas) {
  const std::pair<const char*, const char*> cases[] = {
      {"[camera]\nmodel = \"d4\"\n", ":2: model: must be one of \"clean\", \"d435\""},
      {"[gnss]\nmodel = 3\n", ":2: model: must be one of \"clean\", \"m9n\""},
      {"[odometry]\nmodel = \"t265\"\n", ":2: model: must be one of \"none\", \"vio\""},
      {"[gnss]\nmodel = \"none\"\n", ":1: model: must not be \"none\" without [odometry]"},
      {"[lidar]\nmodel = \"ring\"\n", ":1: lidar: must not be there: the vehicle has none"},
      {"[camera]\ninvalid_ratio = 0.2\n", ":2: invalid_ratio: must not be there without a camera of a model"},
      {"[camera]\nmodel = \"tof\"\nnoise_m = 0.2\n", ":3: noise_m: must not be there"},
      {"[rain]\nrate_mmph = 10\n", ":2: rate_mmph: must not be there without a LiDAR"},
  };
  for (const auto& [text, says] : cases) {
    MissionConfig config;
    try {
      load_settings(test::scratch_file("bad.toml", text), config);
      ADD_FAILURE() << text;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(says), std::string::npos) << error.what();
    }
  }
}

TEST(Settings, CameraAndFogGoForAllCamerasOfARig) {
  const std::string path = test::scratch("rig.toml");
  MissionConfig config;
  SensorRig& rig = config.simulator.rig.emplace(six_cameras(96, 25.0));
  rig.cameras[1].range_m = 6.0;
  rig.cameras[1].rate_Hz = 30.0;
  (void)rig.lidars.push_back({});
  std::ofstream(path) << "[camera]\npixels = 48\nlatency_s = 0.1\n[fog]\nvisibility_m = 9.0\n";
  load_settings(path, config);
  for (const CameraSpec& camera : rig.cameras) {
    EXPECT_EQ(camera.width, 48);
    EXPECT_EQ(camera.height, 48);
    EXPECT_EQ(camera.latency_s, 0.1);
  }
  EXPECT_EQ(rig.cameras[0].range_m, 9.0);
  EXPECT_EQ(rig.cameras[1].range_m, 6.0) << "it sees less than the fog lets it";
  EXPECT_EQ(rig.cameras[1].rate_Hz, 30.0) << "nobody spoke of it";
  EXPECT_EQ(rig.lidars[0].range_m, 9.0);
}

}  // namespace
}  // namespace roborun::mission
