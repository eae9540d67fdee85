#include "platform/app/settings_file.hpp"

#include <gtest/gtest.h>

#include "platform/app/board_profile.hpp"
#include "platform/sitl/world/input_error.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::app {
namespace {

TEST(Settings, OverwritesWhatIsThereAndKeepsTheRest) {
  MissionConfig config;
  load_settings(test::scratch_file("settings.toml",
                                   "[camera]\npixels = 64\nrange_m = 18.5\n[wind]\nmean_mps = [4, 0, 0]\n"),
                config);
  EXPECT_EQ(config.camera.pixels, 64);
  EXPECT_EQ(config.camera.range_m, 18.5);
  EXPECT_EQ(config.camera.rate_Hz, sitl::DepthCameraConfig{}.rate_Hz);
  EXPECT_EQ(config.wind.mean_W_mps, Vector3(4.0, 0.0, 0.0));
  EXPECT_EQ(config.wind.gust_mps, sitl::WindConfig{}.gust_mps);
}

TEST(Settings, RefusesWithFileLineKeyAndRange) {
  const std::pair<const char*, const char*> cases[] = {
      {"[camera]\nrange_m = 1000\n", ":2: range_m: must be a number from 5 to 100"},
      {"[camera]\nrange = 10\n", ":2: range: unknown key in [camera]"},
      {"[wind]\nmean_mps = [30, 0, 0]\n", ":2: mean_mps: must be at most 20 m/s"},
      {"[engine]\n", "engine: unknown key in the file"},
      {"camera = 3\n", ":1: camera: must be a table"},
      {"[flight]\nv_max_mps = nan\n", ":2: v_max_mps: must be a number"},
  };
  for (const auto& [text, says] : cases) {
    MissionConfig config;
    try {
      load_settings(test::scratch_file("bad.toml", text), config);
      ADD_FAILURE() << text;
    } catch (const sitl::InputError& error) {
      EXPECT_NE(std::string(error.what()).find(says), std::string::npos) << error.what();
    }
  }
}

TEST(HostProfile, RefusesAMalformedFile) {
  std::string note;
  for (const char* text : {"", "x = 1\n", "[board]\nper_unit_s = [1, 2]\n", "\xff\xfe"}) {
    EXPECT_THROW((void)host(test::scratch_file("bad_host.toml", text), 1.0, note), sitl::InputError) << text;
  }
}

}  // namespace
}  // namespace roborun::app
