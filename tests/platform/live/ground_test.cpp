#include "platform/live/ground.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "firmware_if/mavlink/flight_messages.hpp"
#include "platform/live/port_aircraft.hpp"

namespace roborun::live {
namespace {

namespace mav = firmware_if::mavlink;
using mavlink::LinkAddress;

constexpr sensor_port::EarthPlace kLocalOrigin{47.397742, 8.545594, 488.0};

class GroundTest : public ::testing::Test {
 protected:
  /// What becomes of a reposition to `height_m`, in `frame`, at the origin.
  std::optional<Vector3> asked(std::uint8_t frame, float height_m) {
    mav::CommandInt m;
    m.target_system = 1;
    m.target_component = kCompanion;
    m.command = mav::kDoReposition;
    m.frame = frame;
    m.x = 473977420;
    m.y = 85455940;
    m.z = height_m;
    m.param1 = -1.0F;
    std::array<std::uint8_t, mav::kMostFrame_bytes> bytes{};
    const auto length =
        mav::write_frame(mav::CommandInt::kType, {seq_++, kGroundStation, 190}, mav::pack(m), nullptr, bytes);
    std::array<std::uint8_t, 2048> heard{};
    for (int i = 0; i < 500; ++i) {  // until it is under way
      now_ += std::chrono::milliseconds(1);
      (void)station_.read(now_, heard);
      if (i == 0) (void)station_.write(now_, std::span<const std::uint8_t>(bytes).first(length.value()));
      if (const auto goal_W = sut_.step(now_)) return goal_W;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return std::nullopt;
  }

  static LinkAddress ear() {
    mavlink::Link free({LinkAddress::Kind::kUdpIn, "127.0.0.1", 0});
    std::array<std::uint8_t, 16> bytes{};
    (void)free.read(MonotonicTime{}, bytes);
    return {LinkAddress::Kind::kUdpIn, "127.0.0.1", free.local_port()};
  }

  LinkAddress ear_ = ear();
  PortAircraft far_{"nobody", SensorRig{}, Nanos{2'500'000}, Nanos{0}, kLocalOrigin, false};
  Ground sut_{GroundConfig{ear_, kGroundStation}, std::nullopt, far_};
  mavlink::Link station_{{LinkAddress::Kind::kUdpOut, "127.0.0.1", ear_.number}};
  MonotonicTime now_{Nanos{1'000'000'000}};
  std::uint8_t seq_{0};
};

TEST_F(GroundTest, MeasuresHeightsOverTheTakeOffFromWhereItStood) {
  constexpr std::uint8_t kOverHome = 6, kOverSea = 5;
  sut_.begins_at(kLocalOrigin);
  (void)sut_.step(now_);  // listens
  auto goal_W = asked(kOverHome, 20.0F);
  ASSERT_TRUE(goal_W.has_value());
  EXPECT_LT((*goal_W - Vector3(0.0, 0.0, 20.0)).norm(), 0.01);
  sut_.answer("only asked");
  sut_.stands_at(12.5);  // on a roof
  goal_W = asked(kOverHome, 20.0F);
  ASSERT_TRUE(goal_W.has_value());
  EXPECT_LT((*goal_W - Vector3(0.0, 0.0, 32.5)).norm(), 0.01);
  sut_.answer("only asked");
  goal_W = asked(kOverSea, 500.0F);
  ASSERT_TRUE(goal_W.has_value());
  EXPECT_LT((*goal_W - Vector3(0.0, 0.0, 12.0)).norm(), 0.01) << "over the sea it stays";
}

}  // namespace
}  // namespace roborun::live
