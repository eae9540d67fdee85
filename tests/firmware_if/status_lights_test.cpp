#include "firmware_if/status_lights.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/firmware_if/recording_bus.hpp"

namespace roborun::firmware_if {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

struct LightsRig {
  test::RecordingBus bus;
  TransmitGate gate{{}, bus};
  StatusLights sut{3, gate};
  MonotonicTime now{seconds{10}};

  LightsRig() { gate.set_node_id(10); }
  /// What the light shows after each command that left.
  std::vector<dronecan::Rgb565> run(Nanos duration, VehicleState state) {
    bus.sent.clear();
    for (const MonotonicTime end = now + duration; now < end; now += milliseconds{10}) sut.step(now, state);
    std::vector<dronecan::Rgb565> out;
    for (const CanFrame& frame : bus.sent) {
      dronecan::LightsCommand command;
      EXPECT_EQ(dronecan::decode(frame.bytes().first(frame.size - 1U), command), Status::kOk);
      EXPECT_EQ(command.commands.count, 1);
      EXPECT_EQ(command.commands.items[0].light_id, 3);
      out.push_back(command.commands.items[0].color);
    }
    return out;
  }
};

TEST(StatusLights, AreGreenWhereNothingCanTurnAndRedWhereSomethingMay) {
  LightsRig rig;
  const auto safe = rig.run(seconds{2}, VehicleState::kSafe);
  ASSERT_EQ(safe.size(), 4U);
  for (const auto& colour : safe) EXPECT_TRUE(colour.green == 63 && colour.red == 0 && colour.blue == 0);
  const auto armed = rig.run(seconds{2}, VehicleState::kArmed);
  ASSERT_EQ(armed.size(), 4U);
  for (const auto& colour : armed) EXPECT_TRUE(colour.red == 31 && colour.green == 0 && colour.blue == 0);
}

TEST(StatusLights, ShowAFailsafeInTwoColoursInTurn) {
  LightsRig rig;
  const auto colours = rig.run(seconds{2}, VehicleState::kFailsafe);
  ASSERT_EQ(colours.size(), 4U);
  for (std::size_t i = 1; i < colours.size(); ++i) EXPECT_NE(colours[i].red, colours[i - 1].red);
}

TEST(StatusLights, ShowAChangeAtOnce) {
  LightsRig rig;
  EXPECT_EQ(rig.run(milliseconds{100}, VehicleState::kSafe).size(), 1U);
  EXPECT_EQ(rig.run(milliseconds{10}, VehicleState::kArmed).size(), 1U);
  // Too soon for the gate: said as soon as it takes it.
  EXPECT_EQ(rig.run(milliseconds{10}, VehicleState::kFailsafe).size(), 0U);
  EXPECT_EQ(rig.run(milliseconds{50}, VehicleState::kFailsafe).size(), 1U);
}

}  // namespace
}  // namespace roborun::firmware_if
