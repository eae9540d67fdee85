#include "platform/vehicle/vehicle_file.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>

#include "core/energy_model.hpp"
#include "platform/input/input_error.hpp"
#include "platform/vehicle/shipped_vehicles.hpp"

namespace roborun::vehicle {
namespace {

std::string replaced(std::string text, const std::string& what, const std::string& with) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), with);
}

/// The one line with which a text is refused; empty if it is not.
std::string refusal(const std::string& text) {
  try {
    (void)vehicle_from_toml("mine.toml", text);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

TEST(VehicleFile, EveryShippedVehicleSpendsMoreAtEveryOtherSpeedThanItsCheapest) {
  for (const std::string& name : shipped_vehicles()) {
    const VehicleModel v = load_vehicle(name).model;
    const double cheapest_mps = cheapest_speed_mps(v);
    const double least_Jpm = energy_per_metre(v, cheapest_mps).total_Jpm();
    EXPECT_GT(cheapest_mps, 1.0) << name;
    EXPECT_LT(cheapest_mps, 29.0) << name;
    for (double v_mps = 0.1; v_mps <= 30.0; v_mps += 0.1) {
      if (std::abs(v_mps - cheapest_mps) < 0.05) continue;
      EXPECT_GT(energy_per_metre(v, v_mps).total_Jpm(), least_Jpm) << name << " at " << v_mps;
    }
  }
}

TEST(VehicleFile, EveryShippedVehicleReadsAndCanFly) {
  ASSERT_EQ(shipped_vehicles().size(), 7U);
  EXPECT_EQ(shipped_vehicles().front(), "paper");
  for (const std::string& name : shipped_vehicles()) {
    const Vehicle v = load_vehicle(name);
    EXPECT_EQ(v.name, name);
    EXPECT_EQ(v.digest.size(), 16U);
  }
}

TEST(VehicleFile, WithSixItSeesAllRoundAsFarAsItsFirstCamera) {
  const Vehicle one = load_vehicle("micro");
  const Vehicle six = load_vehicle("micro-six");
  ASSERT_EQ(one.rig.cameras.size(), 1U);
  ASSERT_EQ(six.rig.cameras.size(), 6U);
  EXPECT_NE(six.digest, one.digest);
  EXPECT_EQ(six.model.radius_m, one.model.radius_m);
  std::array<std::array<int, 2>, 3> looked{};  // along each axis of the body, back and forth
  for (const CameraSpec& camera : six.rig.cameras) {
    EXPECT_EQ(camera.range_m, one.rig.cameras[0].range_m);
    EXPECT_EQ(camera.tan_half_width, 1.0);
    const auto R_BC = camera_mount(camera.mount).R_BC;
    for (std::size_t i = 0; i < 3; ++i) {
      const double along = R_BC[3 * i];  // the first column: where it looks
      if (std::abs(along) > 0.5) looked[i][along > 0.0 ? 1 : 0] += 1;
    }
  }
  for (const auto& axis : looked) EXPECT_EQ(axis, (std::array<int, 2>{1, 1}));
  EXPECT_TRUE(ships("paper-six"));
  EXPECT_FALSE(ships("mine-six"));
  EXPECT_THROW((void)load_vehicle("racer-six"), InputError);
}

TEST(VehicleFile, WithAModelItsCamerasErrAsThatProductDoes) {
  const Vehicle clean = load_vehicle("paper");
  const Vehicle d455 = load_vehicle("paper-d455");
  ASSERT_EQ(d455.rig.cameras.size(), 6U);
  for (const CameraSpec& camera : d455.rig.cameras) {
    EXPECT_EQ(camera.model, CameraModel::kD455);
    EXPECT_EQ(camera.range_m, clean.rig.cameras[0].range_m);
  }
  EXPECT_EQ(d455.name, "paper-d455");
  EXPECT_NE(d455.digest, clean.digest);
  EXPECT_EQ(load_vehicle("x500-six-oak-d").rig.cameras.size(), 6U);
  EXPECT_EQ(load_vehicle("x500-six-oak-d").rig.cameras[5].model, CameraModel::kOakD);
  EXPECT_TRUE(ships("paper-tof"));
  for (const char* name : {"paper-clean", "paper-", "paper-d999", "paperd455", "paper-d455-six"})
    EXPECT_FALSE(ships(name)) << name;
  EXPECT_THROW((void)load_vehicle("racer-d455"), InputError);
}

constexpr const char* kCamera = R"(
[[camera]]
width = 640
height = 480
horizontal_fov_deg = 87
vertical_fov_deg = 58
range_min_m = 0.3
range_m = 10
rate_Hz = 30
latency_s = 0.03
x_m = 0.12
)";
constexpr const char* kLidar = R"(
[[lidar]]
rings = 16
columns = 900
lowest_deg = -15
highest_deg = 15
range_min_m = 0.5
range_m = 70
rate_Hz = 10
latency_s = 0.02
)";

/// The shipped paper vehicle without its cameras.
std::string blind_paper() {
  const std::string text = kShippedVehicles[0].text;
  return text.substr(0, text.find("[[camera]]"));
}

TEST(VehicleFile, HoldsItsSensors) {
  const Vehicle v = vehicle_from_toml("mine.toml", blind_paper() + kCamera + kLidar);
  ASSERT_EQ(v.rig.cameras.size(), 1U);
  EXPECT_EQ(v.rig.cameras[0].width, 640);
  EXPECT_NEAR(v.rig.cameras[0].tan_half_width, 0.94896, 1e-5);
  EXPECT_EQ(v.rig.cameras[0].mount.x_m, 0.12);
  EXPECT_EQ(v.rig.cameras[0].mount.z_m, 0.0);
  ASSERT_EQ(v.rig.lidars.size(), 1U);
  EXPECT_EQ(v.rig.lidars[0].range_m, 70.0);
}

TEST(VehicleFile, NamesTheModelsOfItsSensors) {
  const std::string camera = kCamera, lidar = kLidar;
  const Vehicle clean = vehicle_from_toml("mine.toml", blind_paper() + camera + lidar);
  EXPECT_EQ(clean.rig.cameras[0].model, CameraModel::kClean);
  EXPECT_EQ(clean.rig.lidars[0].model, LidarModel::kClean);
  EXPECT_EQ(clean.rig.gnss, GnssModel::kClean);
  EXPECT_EQ(clean.rig.imu, ImuModel::kClean);
  const Vehicle v =
      vehicle_from_toml("mine.toml", blind_paper() + "[imu]\nmodel = \"mems\"\n[gnss]\nmodel = \"m9n\"\n" +
                                         camera + "model = \"oak-d\"\ninvalid_ratio = 0.3\n" + camera +
                                         "model = \"clean\"\n" + lidar + "model = \"mid360\"\n");
  EXPECT_EQ(v.rig.cameras[0].model, CameraModel::kOakD);
  EXPECT_EQ(v.rig.cameras[0].invalid_ratio, 0.3);
  EXPECT_EQ(v.rig.cameras[1].model, CameraModel::kClean);
  EXPECT_EQ(v.rig.lidars[0].model, LidarModel::kMid360);
  EXPECT_EQ(v.rig.gnss, GnssModel::kM9n);
  EXPECT_EQ(v.rig.imu, ImuModel::kMems);
  const auto says = [&](const std::string& more, const char* what) {
    EXPECT_NE(refusal(blind_paper() + more).find(what), std::string::npos) << refusal(blind_paper() + more);
  };
  says(camera + "model = \"d999\"\n", R"(model: must be one of "clean", "d435", "d455", "oak-d", "tof")");
  says(camera + "model = 5\n", "model: must be one of");
  says(camera + "invalid_ratio = 0.3\n", "invalid_ratio: must not be there without a model");
  says(camera + "model = \"tof\"\ninvalid_ratio = 0.7\n", "invalid_ratio: must be a number from 0 to 0.6");
  says(camera + lidar + "model = \"d455\"\n", R"(model: must be one of "clean", "mid360", "ring")");
  says(camera + lidar + "invalid_ratio = 0.3\n", "invalid_ratio: unknown key in [[lidar]]");
  says("[gnss]\n" + camera, "model: missing in [gnss]");
  says("[imu]\nmodel = \"m9n\"\n" + camera, R"(model: must be one of "clean", "mems")");
}

TEST(VehicleFile, RefusesSensorsThatCannotBe) {
  const std::string paper = blind_paper();
  EXPECT_NE(refusal(paper).find("camera: missing"), std::string::npos) << "a vehicle that sees nothing";
  const auto with = [&](const char* what, const char* instead) {
    return refusal(paper + replaced(kCamera, what, instead));
  };
  EXPECT_EQ(refusal(paper + kCamera), "");
  EXPECT_NE(with("width = 640", "width = 1281").find("width: must be a whole number from 8 to 1280"),
            std::string::npos);
  EXPECT_NE(with("width = 640", "width = 64.5").find("width: must be a whole number"), std::string::npos);
  EXPECT_NE(with("vertical_fov_deg = 58", "vertical_fov_deg = 0").find("vertical_fov_deg: must be"),
            std::string::npos);
  EXPECT_NE(with("range_m = 10", "range_m = nan").find("range_m: must be"), std::string::npos);
  EXPECT_NE(with("range_min_m = 0.3", "range_min_m = 10").find("range_m: must be more than range_min_m"),
            std::string::npos);
  EXPECT_NE(with("rate_Hz = 30\n", "").find("rate_Hz: missing in [[camera]]"), std::string::npos);
  EXPECT_NE(with("x_m", "xx_m").find("xx_m: unknown key in [[camera]]"), std::string::npos);
  EXPECT_NE(with("x_m = 0.12", "yaw_deg = 180").find("cannot see where it flies"), std::string::npos);
  std::string nine = paper;
  for (int i = 0; i < 9; ++i) nine += kCamera;
  EXPECT_NE(refusal(nine).find("camera: must be at most 8"), std::string::npos);
}

TEST(VehicleFile, PaperIsTheDefaultToTheBitButForItsFineCells) {
  const VehicleModel paper = load_vehicle("paper").model;
  const VehicleModel standard;
  const auto of_narrow_places = [](const VehicleKey& key) {
    const std::string_view name = key.key;
    return name == "finest_cell_m" || name == "slow_error_m" || name == "slow_speed_mps";
  };
  for (const VehicleKey& key : kVehicleKeys)
    EXPECT_TRUE(paper.*key.value == standard.*key.value || of_narrow_places(key)) << key.key;
  ASSERT_TRUE(paper.measured_stopping && standard.measured_stopping);
  EXPECT_EQ(paper.measured_stopping->quadratic_s2pm, standard.measured_stopping->quadratic_s2pm);
  EXPECT_EQ(paper.measured_stopping->linear_s, standard.measured_stopping->linear_s);
  EXPECT_EQ(paper.measured_stopping->constant_m, standard.measured_stopping->constant_m);
}

TEST(VehicleFile, NothingAboutAVehicleIsAssumed) {
  const std::string x500 = kShippedVehicles[1].text;
  ASSERT_EQ(refusal(x500), "");
  for (const VehicleKey& key : kVehicleKeys) {
    if (key.left_out) continue;
    const std::string line = std::string("\n") + key.key + " = ";
    const std::string said = refusal(replaced(x500, line, "\n#"));
    EXPECT_NE(said.find(key.key), std::string::npos) << said;
    EXPECT_NE(said.find("missing"), std::string::npos) << said;
  }
}

TEST(VehicleFile, TheThinnestThingMayBeLeftOut) {
  const std::string x500 = kShippedVehicles[1].text;
  EXPECT_EQ(vehicle_from_toml("x.toml", x500).model.thinnest_m, 0.02);
  EXPECT_EQ(
      vehicle_from_toml("x.toml", replaced(x500, "[limits]", "[limits]\nthinnest_m = 0.1")).model.thinnest_m,
      0.1);
  EXPECT_NE(refusal(replaced(x500, "[limits]", "[limits]\nthinnest_m = 0"))
                .find("thinnest_m: must be a number from 0.005 to 1"),
            std::string::npos);
}

TEST(VehicleFile, SaysFileLineKeyAndRange) {
  const std::string x500 = kShippedVehicles[1].text;
  for (const char* bad : {"mass_kg = nan", "mass_kg = -2", "mass_kg = 1e9", "mass_kg = \"2\""}) {
    const std::string said = refusal(replaced(x500, "mass_kg = 2.0", bad));
    EXPECT_EQ(said, "mine.toml:10: mass_kg: must be a number from 0.05 to 100") << bad;
  }
  EXPECT_NE(
      refusal(replaced(x500, "mass_kg = 2.0", "mass_kg = 2.0\nmas_kg = 2.0")).find("mas_kg: unknown key"),
      std::string::npos);
  EXPECT_NE(refusal(replaced(x500, "[drag]", "[darg]")), "");
  EXPECT_NE(refusal("not toml ["), "");
  EXPECT_NE(refusal(""), "");
  EXPECT_THROW((void)load_vehicle("/nowhere.toml"), InputError);
}

TEST(VehicleFile, RefusesAVehicleThatCannotFly) {
  const std::string x500 = kShippedVehicles[1].text;
  EXPECT_NE(refusal(replaced(x500, "max_thrust_N = 8.55", "max_thrust_N = 5")).find("cannot hover"),
            std::string::npos);
}

}  // namespace
}  // namespace roborun::vehicle
