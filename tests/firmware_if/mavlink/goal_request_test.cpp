#include "firmware_if/mavlink/goal_request.hpp"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <new>

#include "firmware_if/mavlink/flight_messages.hpp"

namespace roborun::firmware_if::mavlink {
namespace {

/// As system 1, component 191 reads it.
template <typename T>
std::optional<GoalRequest> asked(const T& message) {
  std::array<std::uint8_t, kMostFrame_bytes> bytes{};
  const auto length = write_frame(T::kType, {0, 255, 190}, pack(message), nullptr, bytes);
  Frame frame;
  EXPECT_EQ(read_frame(std::span<const std::uint8_t>(bytes).first(length.value()), frame),
            FrameState::kComplete);
  return goal_request(frame, 1, 191);
}

CommandInt reposition(std::uint8_t frame, std::int32_t x, std::int32_t y, float z) {
  CommandInt m;
  m.target_system = 1;
  m.target_component = 191;
  m.frame = frame;
  m.command = kDoReposition;
  m.param1 = -1.0F;
  m.x = x, m.y = y, m.z = z;
  return m;
}

TEST(GoalRequest, TurnsNorthEastDownIntoTheWorld) {
  const auto sut = asked(reposition(1, 30'000, -45'000, -5.0F));
  ASSERT_TRUE(sut.has_value());
  EXPECT_EQ(sut->result, CommandResult::kAccepted);
  EXPECT_EQ(sut->kind, GoalRequest::Kind::kWorld);
  EXPECT_DOUBLE_EQ(sut->place[0], -4.5);
  EXPECT_DOUBLE_EQ(sut->place[1], 3.0);
  EXPECT_DOUBLE_EQ(sut->place[2], 5.0);
  EXPECT_TRUE(sut->is_command);
  EXPECT_EQ(sut->sysid, 255);
  EXPECT_EQ(sut->compid, 190);
}

TEST(GoalRequest, TellsHeightsOverTheSeaFromThoseOverTheTakeOff) {
  for (const auto& [frame, kind] :
       {std::pair{0, GoalRequest::Kind::kOverSea}, std::pair{5, GoalRequest::Kind::kOverSea},
        std::pair{3, GoalRequest::Kind::kOverTakeOff}, std::pair{6, GoalRequest::Kind::kOverTakeOff}}) {
    const auto sut = asked(reposition(static_cast<std::uint8_t>(frame), 473'977'420, 85'455'940, 493.0F));
    ASSERT_TRUE(sut.has_value());
    EXPECT_EQ(sut->result, CommandResult::kAccepted);
    EXPECT_EQ(sut->kind, kind);
    EXPECT_NEAR(sut->place[0], 47.397742, 1e-9);
    EXPECT_NEAR(sut->place[1], 8.545594, 1e-9);
    EXPECT_EQ(sut->place[2], 493.0);
  }
}

TEST(GoalRequest, RefusesWhatItCannotObey) {
  EXPECT_EQ(asked(reposition(8, 0, 0, 1.0F))->result, CommandResult::kDenied) << "a body frame";
  EXPECT_EQ(asked(reposition(5, 910'000'000, 0, 1.0F))->result, CommandResult::kDenied) << "91 degrees north";
  EXPECT_EQ(asked(reposition(1, 0, 0, std::numeric_limits<float>::quiet_NaN()))->result,
            CommandResult::kDenied);
  CommandInt fast = reposition(1, 0, 0, -5.0F);
  fast.param1 = 3.0F;
  EXPECT_EQ(asked(fast)->result, CommandResult::kDenied) << "a speed";
  CommandLong coarse;
  coarse.target_system = 1;
  coarse.command = kDoReposition;
  EXPECT_EQ(asked(coarse)->result, CommandResult::kIntOnly);
}

TEST(GoalRequest, TakesPositionsAloneAsSetPoints) {
  SetPositionTargetLocalNed local;
  local.target_system = 1;
  local.coordinate_frame = 1;
  local.type_mask = 0x9f8;  // position and yaw
  local.x = 2.0F, local.y = 3.0F, local.z = -4.0F;
  const auto sut = asked(local);
  ASSERT_TRUE(sut.has_value());
  EXPECT_EQ(sut->result, CommandResult::kAccepted);
  EXPECT_FALSE(sut->is_command);
  EXPECT_EQ(sut->place, (std::array<double, 3>{3.0, 2.0, 4.0}));
  local.type_mask = 0x9c0;  // a velocity, too
  EXPECT_EQ(asked(local)->result, CommandResult::kDenied);
  SetPositionTargetGlobalInt global;
  global.target_system = 1;
  global.coordinate_frame = 6;
  global.type_mask = 0xff8;
  global.lat_int = 10'000'000;
  EXPECT_EQ(asked(global)->kind, GoalRequest::Kind::kOverTakeOff);
  global.coordinate_frame = 1;
  EXPECT_EQ(asked(global)->result, CommandResult::kDenied);
}

TEST(GoalRequest, IsNotForSomebodyElse) {
  CommandInt m = reposition(1, 0, 0, -5.0F);
  m.target_system = 2;
  EXPECT_FALSE(asked(m).has_value());
  m.target_system = 1;
  m.target_component = 1;  // the autopilot's
  EXPECT_FALSE(asked(m).has_value());
  m.target_component = 0;
  EXPECT_TRUE(asked(m).has_value());
  m.command = 16;
  EXPECT_FALSE(asked(m).has_value());
  EXPECT_FALSE(asked(Heartbeat{}).has_value());
}

TEST(SecretKey, LeavesNothingInMemory) {
  alignas(SecretKey) std::array<unsigned char, sizeof(SecretKey)> memory{};
  SigningKey key{};
  key.fill(0x5a);
  const auto* const sut = new (memory.data()) SecretKey(key);
  EXPECT_EQ(memory[3], 0x5a) << "there was something";
  sut->~SecretKey();
  for (const unsigned char byte : memory) EXPECT_EQ(byte, 0);
}

}  // namespace
}  // namespace roborun::firmware_if::mavlink
