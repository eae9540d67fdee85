/// The messages between PX4 and a simulator, as structs. Names, units, signs and frames are MAVLink's.
#pragma once

#include <array>
#include <cstdint>
#include <tuple>

#include "firmware_if/mavlink/sensor_messages.hpp"
#include "firmware_if/mavlink/typed.hpp"

namespace roborun::firmware_if::mavlink {

/// What its motors are to do.
struct HilActuatorControls {
  static constexpr MessageType kType = kHilActuatorControls;
  std::uint64_t time_usec{};
  std::array<float, 16> controls{};  ///< 0 to 1.
  std::uint8_t mode{};               ///< 128: armed.
  std::uint64_t flags{};             ///< 1: lock-step.
  static constexpr std::tuple kMembers{Member<&HilActuatorControls::time_usec>{"time_usec"},
                                       Member<&HilActuatorControls::controls>{"controls"},
                                       Member<&HilActuatorControls::mode>{"mode"},
                                       Member<&HilActuatorControls::flags>{"flags"}};
};

/// What its sensors feel; its clock is `time_usec` of id 0.
struct HilSensor {
  static constexpr MessageType kType = kHilSensor;
  std::uint64_t time_usec{};
  float xacc{}, yacc{}, zacc{};           ///< Specific force, m/s2, FRD.
  float xgyro{}, ygyro{}, zgyro{};        ///< rad/s, FRD.
  float xmag{}, ymag{}, zmag{};           ///< Gauss, FRD.
  float abs_pressure{}, diff_pressure{};  ///< hPa.
  float pressure_alt{}, temperature{};    ///< m, degrees Celsius.
  std::uint32_t
      fields_updated{};  ///< 0x7 force, 0x38 rates, 0x1c0 field, 0x1a00 pressure, height and temperature.
  std::uint8_t id{};
  static constexpr std::tuple kMembers{Member<&HilSensor::time_usec>{"time_usec"},
                                       Member<&HilSensor::xacc>{"xacc"},
                                       Member<&HilSensor::yacc>{"yacc"},
                                       Member<&HilSensor::zacc>{"zacc"},
                                       Member<&HilSensor::xgyro>{"xgyro"},
                                       Member<&HilSensor::ygyro>{"ygyro"},
                                       Member<&HilSensor::zgyro>{"zgyro"},
                                       Member<&HilSensor::xmag>{"xmag"},
                                       Member<&HilSensor::ymag>{"ymag"},
                                       Member<&HilSensor::zmag>{"zmag"},
                                       Member<&HilSensor::abs_pressure>{"abs_pressure"},
                                       Member<&HilSensor::diff_pressure>{"diff_pressure"},
                                       Member<&HilSensor::pressure_alt>{"pressure_alt"},
                                       Member<&HilSensor::temperature>{"temperature"},
                                       Member<&HilSensor::fields_updated>{"fields_updated"},
                                       Member<&HilSensor::id>{"id"}};
};

/// A fix of its receiver.
struct HilGps {
  static constexpr MessageType kType = kHilGps;
  std::uint64_t time_usec{};
  std::uint8_t fix_type{};            ///< 3: three dimensions.
  std::int32_t lat{}, lon{}, alt{};   ///< 1e-7 degrees, mm over the sea.
  std::uint16_t eph{}, epv{}, vel{};  ///< cm, cm, cm/s over ground.
  std::int16_t vn{}, ve{}, vd{};      ///< cm/s.
  std::uint16_t cog{};                ///< Course, 0.01 degrees.
  std::uint8_t satellites_visible{};
  std::uint8_t id{};
  std::uint16_t yaw{};  ///< 0: not known.
  static constexpr std::tuple kMembers{Member<&HilGps::time_usec>{"time_usec"},
                                       Member<&HilGps::fix_type>{"fix_type"},
                                       Member<&HilGps::lat>{"lat"},
                                       Member<&HilGps::lon>{"lon"},
                                       Member<&HilGps::alt>{"alt"},
                                       Member<&HilGps::eph>{"eph"},
                                       Member<&HilGps::epv>{"epv"},
                                       Member<&HilGps::vel>{"vel"},
                                       Member<&HilGps::vn>{"vn"},
                                       Member<&HilGps::ve>{"ve"},
                                       Member<&HilGps::vd>{"vd"},
                                       Member<&HilGps::cog>{"cog"},
                                       Member<&HilGps::satellites_visible>{"satellites_visible"},
                                       Member<&HilGps::id>{"id"},
                                       Member<&HilGps::yaw>{"yaw"}};
};

}  // namespace roborun::firmware_if::mavlink
