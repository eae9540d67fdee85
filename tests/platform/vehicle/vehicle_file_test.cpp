#include "platform/vehicle/vehicle_file.hpp"

#include <gtest/gtest.h>

#include <string>

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

TEST(VehicleFile, EveryShippedVehicleReadsAndCanFly) {
  ASSERT_EQ(shipped_vehicles().size(), 5U);
  EXPECT_EQ(shipped_vehicles().front(), "paper");
  for (const std::string& name : shipped_vehicles()) {
    const Vehicle v = load_vehicle(name);
    EXPECT_EQ(v.name, name);
    EXPECT_EQ(v.digest.size(), 16U);
  }
}

TEST(VehicleFile, PaperIsTheDefaultToTheBit) {
  const VehicleModel paper = load_vehicle("paper").model;
  const VehicleModel standard;
  for (const VehicleKey& key : kVehicleKeys) EXPECT_EQ(paper.*key.value, standard.*key.value) << key.key;
  ASSERT_TRUE(paper.measured_stopping && standard.measured_stopping);
  EXPECT_EQ(paper.measured_stopping->quadratic_s2pm, standard.measured_stopping->quadratic_s2pm);
  EXPECT_EQ(paper.measured_stopping->linear_s, standard.measured_stopping->linear_s);
  EXPECT_EQ(paper.measured_stopping->constant_m, standard.measured_stopping->constant_m);
}

TEST(VehicleFile, NothingAboutAVehicleIsAssumed) {
  const std::string x500 = kShippedVehicles[1].text;
  ASSERT_EQ(refusal(x500), "");
  for (const VehicleKey& key : kVehicleKeys) {
    const std::string line = std::string("\n") + key.key + " = ";
    const std::string said = refusal(replaced(x500, line, "\n#"));
    EXPECT_NE(said.find(key.key), std::string::npos) << said;
    EXPECT_NE(said.find("missing"), std::string::npos) << said;
  }
}

TEST(VehicleFile, SaysFileLineKeyAndRange) {
  const std::string x500 = kShippedVehicles[1].text;
  for (const char* bad : {"mass_kg = nan", "mass_kg = -2", "mass_kg = 1e9", "mass_kg = \"2\""}) {
    const std::string said = refusal(replaced(x500, "mass_kg = 2.0", bad));
    EXPECT_EQ(said, "mine.toml:9: mass_kg: must be a number from 0.05 to 100") << bad;
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
