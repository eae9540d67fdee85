#include "platform/live/physics_link.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "platform/input/input_error.hpp"
#include "platform/live/ardupilot_physics.hpp"
#include "platform/live/earth_field.hpp"
#include "platform/live/px4_physics.hpp"

namespace roborun::live {
namespace {

std::vector<std::uint8_t> packet(unsigned magic, unsigned rate_Hz, std::uint32_t frame,
                                 const std::vector<unsigned>& pwm_us, std::size_t servos) {
  std::vector<std::uint8_t> bytes;
  const auto put = [&bytes](unsigned value) {
    bytes.push_back(static_cast<std::uint8_t>(value & 0xffU));
    bytes.push_back(static_cast<std::uint8_t>(value >> 8U & 0xffU));
  };
  put(magic);
  put(rate_Hz);
  put(frame & 0xffffU);
  put(frame >> 16U);
  for (std::size_t i = 0; i < servos; ++i) put(i < pwm_us.size() ? pwm_us[i] : 1500U);
  return bytes;
}

TEST(ServoPacketTest, HasThrottlesInOurOrder) {
  const auto sut = servo_packet(packet(18458, 1200, 0x12345, {1000, 2000, 1500, 0}, 16));
  ASSERT_TRUE(sut.has_value());
  EXPECT_EQ(sut->frame, 0x12345U);
  EXPECT_EQ(sut->step.dt.count(), 833'333);
  // Front left is their third: 0.35 * 0.5 + 0.65 * 0.25.
  EXPECT_DOUBLE_EQ(sut->step.motors.thrust_ratio[0], 0.3375);
  EXPECT_DOUBLE_EQ(sut->step.motors.thrust_ratio[1], 0.0);
  EXPECT_DOUBLE_EQ(sut->step.motors.thrust_ratio[2], 1.0);
  EXPECT_DOUBLE_EQ(sut->step.motors.thrust_ratio[3], 0.0) << "0 us: off";
  const auto many = servo_packet(packet(29569, 400, 1, {2500}, 32));
  ASSERT_TRUE(many.has_value());
  EXPECT_DOUBLE_EQ(many->step.motors.thrust_ratio[1], 1.0) << "beyond full";
}

TEST(ServoPacketTest, IsNothingElse) {
  EXPECT_TRUE(servo_packet(packet(18458, 50, 1, {}, 16)).has_value());
  EXPECT_FALSE(servo_packet(packet(18458, 49, 1, {}, 16)).has_value()) << "a step of more than 20 ms";
  EXPECT_FALSE(servo_packet(packet(18458, 0, 1, {}, 16)).has_value());
  EXPECT_FALSE(servo_packet(packet(18457, 400, 1, {}, 16)).has_value());
  EXPECT_FALSE(servo_packet(packet(18458, 400, 1, {}, 32)).has_value());
  EXPECT_FALSE(servo_packet(packet(29569, 400, 1, {}, 16)).has_value());
  EXPECT_FALSE(servo_packet(packet(18458, 400, 1, {}, 15)).has_value());
  EXPECT_FALSE(servo_packet({}).has_value());
}

TEST(StateLineTest, IsCompactAndInTheirAxes) {
  sitl::VehicleState s;
  s.p_WB = {1.0, 2.0, 3.0};
  s.v_WB = {0.5, -0.25, 1.0};
  s.a_WB = {0.0, 0.0, 1.0};
  s.w_WB_B = {0.1, 0.2, 0.3};
  // Facing north, upright: forward is +y of the world.
  s.q_WB = Quaternion(std::sqrt(0.5), 0.0, 0.0, std::sqrt(0.5));
  const std::string line = state_line(12.5, s);
  const std::string head = "\n{\"timestamp\":12.500000000,\"imu\":{\"gyro\":[0.1,-0.2,-0.3],\"accel_body\":[";
  EXPECT_EQ(line.substr(0, head.size()), head);
  EXPECT_NE(line.find("-10.81]},\"position\":[2,1,-3],\"velocity\":[-0.25,0.5,-1],\"quaternion\":["),
            std::string::npos)
      << line;
  EXPECT_EQ(line.find(' '), std::string::npos);
  EXPECT_EQ(line.substr(line.size() - 3), "]}\n");
}

TEST(Px4MotorsTest, TurnOnlyWhereTheVehicleIsArmedAndTheNumberIsOne) {
  firmware_if::mavlink::HilActuatorControls m;
  m.controls = {0.1F, 0.2F, 0.3F, std::numeric_limits<float>::quiet_NaN()};
  EXPECT_EQ(motors_of(m).thrust_ratio, (std::array<double, 4>{})) << "not armed";
  m.mode = 129;
  const auto motors = motors_of(m).thrust_ratio;
  EXPECT_FLOAT_EQ(static_cast<float>(motors[0]), 0.3F);
  EXPECT_FLOAT_EQ(static_cast<float>(motors[1]), 0.1F);
  EXPECT_FLOAT_EQ(static_cast<float>(motors[2]), 0.2F);
  EXPECT_EQ(motors[3], 0.0);
  m.controls = {7.0F, -1.0F, 0.0F, 0.0F};
  EXPECT_EQ(motors_of(m).thrust_ratio, (std::array<double, 4>{0.0, 1.0, 0.0, 0.0}));
}

TEST(PhysicsLinkTest, SaysThatItsPortIsTaken) {
  ArduPilotPhysics first(0);
  ASSERT_GT(first.port(), 0);
  EXPECT_THROW(ArduPilotPhysics{first.port()}, InputError);
}

// Declination, inclination and strength of 2020 as compass charts show them, within the error that degree 4 leaves.
TEST(EarthFieldTest, IsThatOfTheCharts) {
  struct Place {
    double latitude_deg, longitude_deg, declination_deg, inclination_deg, gauss;
  };
  for (const Place& place : {Place{47.4, 8.5, 3.0, 63.3, 0.482}, Place{-33.9, 151.2, 12.7, -64.3, 0.570},
                             Place{37.8, -122.4, 13.2, 61.0, 0.487}}) {
    const Vector3 field = earth_field_gauss(place.latitude_deg, place.longitude_deg);
    constexpr double kDegree = M_PI / 180.0;
    EXPECT_NEAR(std::atan2(field.x(), field.y()) / kDegree, place.declination_deg, 3.0);
    EXPECT_NEAR(std::atan2(-field.z(), std::hypot(field.x(), field.y())) / kDegree, place.inclination_deg,
                3.0);
    EXPECT_NEAR(field.norm(), place.gauss, 0.03 * place.gauss);
  }
  EXPECT_TRUE(earth_field_gauss(90.0, 0.0).allFinite()) << "at the pole";
}

}  // namespace
}  // namespace roborun::live
