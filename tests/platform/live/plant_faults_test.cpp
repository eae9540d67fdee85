#include "platform/live/plant_faults.hpp"

#include <gtest/gtest.h>

#include "platform/input/input_error.hpp"

namespace roborun::live {
namespace {

using governor::Phase;
using sitl::Component;
using sitl::FaultKind;

class PlantFaultsTest : public ::testing::Test {
 protected:
  void add(Component component, FaultKind kind, std::optional<Phase> phase, double at_s) {
    mission::TimedFault f;
    f.fault.component = component;
    f.fault.kind = kind;
    f.phase = phase;
    f.at_s = at_s;
    config.faults.push_back(f);
  }
  [[nodiscard]] std::string refusal() const {
    try {
      check_plant_faults("bad.toml", config);
    } catch (const InputError& error) {
      return error.what();
    }
    return {};
  }
  static MonotonicTime at(double time_s) { return MonotonicTime{} + from_seconds(100.0 + time_s); }
  mission::MissionConfig config;
};

TEST_F(PlantFaultsTest, BeginByWhatIsSeenOfTheFlight) {
  add(Component::kBarometer, FaultKind::kOff, Phase::kGround, 1.0);
  add(Component::kGnss, FaultKind::kOff, std::nullopt, 2.0);
  add(Component::kImu, FaultKind::kStuck, Phase::kTakeOff, 0.5);
  add(Component::kLink, FaultKind::kOff, Phase::kMission, 0.0);
  PlantFaults sut(config, 4.0);
  const auto begun = [&](double time_s, double height_m) {
    sut.advance(at(time_s), height_m);
    return sut.begun();
  };
  EXPECT_EQ(begun(0.0, 0.2), 0U);
  EXPECT_EQ(begun(0.9, 0.2), 0U);
  EXPECT_EQ(begun(1.0, 0.2), 1U) << "on the ground";
  EXPECT_EQ(begun(50.0, 0.25), 1U) << "however long it waits there";
  EXPECT_EQ(begun(60.0, 0.4), 1U);
  EXPECT_EQ(begun(60.5, 1.0), 2U) << "since it left the ground";
  EXPECT_EQ(sut.line().of(Component::kImu), FaultKind::kStuck);
  EXPECT_EQ(begun(61.9, 3.6), 2U);
  EXPECT_EQ(begun(62.0, 3.6), 3U) << "of no phase: as well";
  EXPECT_EQ(begun(62.1, 3.8), 4U) << "at the height of its hover";
  EXPECT_EQ(sut.line().of(Component::kLink), FaultKind::kOff);
}

TEST_F(PlantFaultsTest, WithoutFaultsThereIsNothing) {
  PlantFaults sut(config, 4.0);
  EXPECT_TRUE(sut.empty());
  sut.advance(at(0.0), 5.0);
  EXPECT_EQ(sut.begun(), 0U);
}

TEST_F(PlantFaultsTest, RefusesWhatIsNotThePlants) {
  add(Component::kGnss, FaultKind::kOff, Phase::kMission, 0.0);
  EXPECT_EQ(refusal(), "");
  add(Component::kCpu, FaultKind::kSlow, Phase::kMission, 0.0);
  EXPECT_EQ(refusal(),
            "--scenario: bad.toml: fault 2: component 'cpu' is the runtime's own: must be one of the plant's "
            "(roborun "
            "scenario run flies this one)");
  config.faults.pop_back();
  add(Component::kGnss, FaultKind::kOff, Phase::kReturn, 0.0);
  EXPECT_EQ(refusal(),
            "--scenario: bad.toml: fault 2: phase 'return' cannot be seen from outside: must be ground, "
            "take_off or "
            "mission");
}

}  // namespace
}  // namespace roborun::live
