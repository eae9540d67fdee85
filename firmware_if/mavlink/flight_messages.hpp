/// The messages that the flight loop reads and writes, as structs. Names, units, signs and frames are MAVLink's
/// (NED, FRD, scaled integers): whoever turns them into ours is the only one to see them.
#pragma once

#include <array>
#include <cstdint>
#include <tuple>

#include "firmware_if/mavlink/dictionary.hpp"
#include "firmware_if/mavlink/typed.hpp"

namespace roborun::firmware_if::mavlink {

/// At 1 Hz from everybody.
struct Heartbeat {
  static constexpr MessageType kType = kHeartbeat;
  std::uint8_t type{};              ///< MAV_TYPE; 18: onboard controller.
  std::uint8_t autopilot{};         ///< MAV_AUTOPILOT; 8: not an autopilot.
  std::uint8_t base_mode{};         ///< Flags; 128: armed.
  std::uint32_t custom_mode{};      ///< The autopilot's own number of its mode.
  std::uint8_t system_status{};     ///< MAV_STATE; 4: active.
  std::uint8_t mavlink_version{3};  ///< 3 in every frame of today.
  static constexpr std::tuple kMembers{Member<&Heartbeat::type>{"type"},
                                       Member<&Heartbeat::autopilot>{"autopilot"},
                                       Member<&Heartbeat::base_mode>{"base_mode"},
                                       Member<&Heartbeat::custom_mode>{"custom_mode"},
                                       Member<&Heartbeat::system_status>{"system_status"},
                                       Member<&Heartbeat::mavlink_version>{"mavlink_version"}};
};

/// Clock of the sender.
struct SystemTime {
  static constexpr MessageType kType = kSystemTime;
  std::uint64_t time_unix_usec{};  ///< us since 1970 UTC.
  std::uint32_t time_boot_ms{};    ///< ms since its start: falls when it restarts.
  static constexpr std::tuple kMembers{Member<&SystemTime::time_unix_usec>{"time_unix_usec"},
                                       Member<&SystemTime::time_boot_ms>{"time_boot_ms"}};
};

/// Question (tc1 = 0) and answer of the clocks, ns.
struct Timesync {
  static constexpr MessageType kType = kTimesync;
  std::int64_t tc1{};  ///< The answerer's time; 0: a question.
  std::int64_t ts1{};  ///< The asker's time, mirrored.
  std::uint8_t target_system{};
  std::uint8_t target_component{};
  static constexpr std::tuple kMembers{Member<&Timesync::tc1>{"tc1"}, Member<&Timesync::ts1>{"ts1"},
                                       Member<&Timesync::target_system>{"target_system"},
                                       Member<&Timesync::target_component>{"target_component"}};
};

/// A command; answered by a CommandAck.
struct CommandLong {
  static constexpr MessageType kType = kCommandLong;
  std::uint8_t target_system{};
  std::uint8_t target_component{};
  std::uint16_t command{};      ///< MAV_CMD.
  std::uint8_t confirmation{};  ///< 0, and one more with each repetition.
  float param1{};
  float param2{};
  float param3{};
  float param4{};
  float param5{};
  float param6{};
  float param7{};
  static constexpr std::tuple kMembers{Member<&CommandLong::target_system>{"target_system"},
                                       Member<&CommandLong::target_component>{"target_component"},
                                       Member<&CommandLong::command>{"command"},
                                       Member<&CommandLong::confirmation>{"confirmation"},
                                       Member<&CommandLong::param1>{"param1"},
                                       Member<&CommandLong::param2>{"param2"},
                                       Member<&CommandLong::param3>{"param3"},
                                       Member<&CommandLong::param4>{"param4"},
                                       Member<&CommandLong::param5>{"param5"},
                                       Member<&CommandLong::param6>{"param6"},
                                       Member<&CommandLong::param7>{"param7"}};
};

/// The answer.
struct CommandAck {
  static constexpr MessageType kType = kCommandAck;
  std::uint16_t command{};  ///< MAV_CMD.
  std::uint8_t
      result{};  ///< 0 accepted, 1 not now, 2 denied, 3 unsupported, 4 failed, 5 in progress, 6 cancelled.
  std::uint8_t progress{};  ///< Percent; 255: unknown.
  std::int32_t result_param2{};
  std::uint8_t target_system{};
  std::uint8_t target_component{};
  static constexpr std::tuple kMembers{Member<&CommandAck::command>{"command"},
                                       Member<&CommandAck::result>{"result"},
                                       Member<&CommandAck::progress>{"progress"},
                                       Member<&CommandAck::result_param2>{"result_param2"},
                                       Member<&CommandAck::target_system>{"target_system"},
                                       Member<&CommandAck::target_component>{"target_component"}};
};

/// Attitude of the body (FRD) in NED: q1..q4 = w, x, y, z; rates rad/s.
struct AttitudeQuaternion {
  static constexpr MessageType kType = kAttitudeQuaternion;
  std::uint32_t time_boot_ms{};  ///< ms since the start of the sender.
  float q1{};
  float q2{};
  float q3{};
  float q4{};
  float rollspeed{};
  float pitchspeed{};
  float yawspeed{};
  std::array<float, 4> repr_offset_q{};
  static constexpr std::tuple kMembers{Member<&AttitudeQuaternion::time_boot_ms>{"time_boot_ms"},
                                       Member<&AttitudeQuaternion::q1>{"q1"},
                                       Member<&AttitudeQuaternion::q2>{"q2"},
                                       Member<&AttitudeQuaternion::q3>{"q3"},
                                       Member<&AttitudeQuaternion::q4>{"q4"},
                                       Member<&AttitudeQuaternion::rollspeed>{"rollspeed"},
                                       Member<&AttitudeQuaternion::pitchspeed>{"pitchspeed"},
                                       Member<&AttitudeQuaternion::yawspeed>{"yawspeed"},
                                       Member<&AttitudeQuaternion::repr_offset_q>{"repr_offset_q"}};
};

/// Position (m) and velocity (m/s) in NED from the local origin.
struct LocalPositionNed {
  static constexpr MessageType kType = kLocalPositionNed;
  std::uint32_t time_boot_ms{};  ///< ms since the start of the sender.
  float x{};
  float y{};
  float z{};  ///< Down.
  float vx{};
  float vy{};
  float vz{};
  static constexpr std::tuple kMembers{Member<&LocalPositionNed::time_boot_ms>{"time_boot_ms"},
                                       Member<&LocalPositionNed::x>{"x"},
                                       Member<&LocalPositionNed::y>{"y"},
                                       Member<&LocalPositionNed::z>{"z"},
                                       Member<&LocalPositionNed::vx>{"vx"},
                                       Member<&LocalPositionNed::vy>{"vy"},
                                       Member<&LocalPositionNed::vz>{"vz"}};
};

/// Pose in frame_id, velocity in child_frame_id.
struct Odometry {
  static constexpr MessageType kType = kOdometry;
  std::uint64_t time_usec{};      ///< us, since 1970 or since the start.
  std::uint8_t frame_id{};        ///< MAV_FRAME; 1 local NED, 20 local FRD.
  std::uint8_t child_frame_id{};  ///< MAV_FRAME; 12 body FRD.
  float x{};
  float y{};
  float z{};
  std::array<float, 4> q{};  ///< w, x, y, z.
  float vx{};
  float vy{};
  float vz{};
  float rollspeed{};
  float pitchspeed{};
  float yawspeed{};
  std::array<float, 21>
      pose_covariance{};  ///< Upper right triangle of x y z roll pitch yaw; NaN first: unknown.
  std::array<float, 21> velocity_covariance{};  ///< The same of the velocities.
  std::uint8_t reset_counter{};                 ///< Rises when the pose jumps.
  std::uint8_t estimator_type{};
  std::int8_t quality{};  ///< Percent; 0 unknown, -1 failed.
  static constexpr std::tuple kMembers{Member<&Odometry::time_usec>{"time_usec"},
                                       Member<&Odometry::frame_id>{"frame_id"},
                                       Member<&Odometry::child_frame_id>{"child_frame_id"},
                                       Member<&Odometry::x>{"x"},
                                       Member<&Odometry::y>{"y"},
                                       Member<&Odometry::z>{"z"},
                                       Member<&Odometry::q>{"q"},
                                       Member<&Odometry::vx>{"vx"},
                                       Member<&Odometry::vy>{"vy"},
                                       Member<&Odometry::vz>{"vz"},
                                       Member<&Odometry::rollspeed>{"rollspeed"},
                                       Member<&Odometry::pitchspeed>{"pitchspeed"},
                                       Member<&Odometry::yawspeed>{"yawspeed"},
                                       Member<&Odometry::pose_covariance>{"pose_covariance"},
                                       Member<&Odometry::velocity_covariance>{"velocity_covariance"},
                                       Member<&Odometry::reset_counter>{"reset_counter"},
                                       Member<&Odometry::estimator_type>{"estimator_type"},
                                       Member<&Odometry::quality>{"quality"}};
};

/// A set-point: position m, velocity m/s, acceleration m/s2, yaw rad, yaw rate rad/s.
struct SetPositionTargetLocalNed {
  static constexpr MessageType kType = kSetPositionTargetLocalNed;
  std::uint32_t time_boot_ms{};
  std::uint8_t target_system{};
  std::uint8_t target_component{};
  std::uint8_t coordinate_frame{};  ///< MAV_FRAME; 1: local NED.
  std::uint16_t type_mask{};        ///< Bits of what is to be IGNORED.
  float x{};
  float y{};
  float z{};
  float vx{};
  float vy{};
  float vz{};
  float afx{};
  float afy{};
  float afz{};
  float yaw{};
  float yaw_rate{};
  static constexpr std::tuple kMembers{
      Member<&SetPositionTargetLocalNed::time_boot_ms>{"time_boot_ms"},
      Member<&SetPositionTargetLocalNed::target_system>{"target_system"},
      Member<&SetPositionTargetLocalNed::target_component>{"target_component"},
      Member<&SetPositionTargetLocalNed::coordinate_frame>{"coordinate_frame"},
      Member<&SetPositionTargetLocalNed::type_mask>{"type_mask"},
      Member<&SetPositionTargetLocalNed::x>{"x"},
      Member<&SetPositionTargetLocalNed::y>{"y"},
      Member<&SetPositionTargetLocalNed::z>{"z"},
      Member<&SetPositionTargetLocalNed::vx>{"vx"},
      Member<&SetPositionTargetLocalNed::vy>{"vy"},
      Member<&SetPositionTargetLocalNed::vz>{"vz"},
      Member<&SetPositionTargetLocalNed::afx>{"afx"},
      Member<&SetPositionTargetLocalNed::afy>{"afy"},
      Member<&SetPositionTargetLocalNed::afz>{"afz"},
      Member<&SetPositionTargetLocalNed::yaw>{"yaw"},
      Member<&SetPositionTargetLocalNed::yaw_rate>{"yaw_rate"}};
};

/// Where the local origin is: 1e-7 degrees WGS84, mm above mean sea level.
struct GpsGlobalOrigin {
  static constexpr MessageType kType = kGpsGlobalOrigin;
  std::int32_t latitude{};
  std::int32_t longitude{};
  std::int32_t altitude{};
  std::uint64_t time_usec{};
  static constexpr std::tuple kMembers{
      Member<&GpsGlobalOrigin::latitude>{"latitude"}, Member<&GpsGlobalOrigin::longitude>{"longitude"},
      Member<&GpsGlobalOrigin::altitude>{"altitude"}, Member<&GpsGlobalOrigin::time_usec>{"time_usec"}};
};

/// Distances around the vehicle, clockwise from angle_offset.
struct ObstacleDistance {
  static constexpr MessageType kType = kObstacleDistance;
  std::uint64_t time_usec{};
  std::uint8_t sensor_type{};                 ///< MAV_DISTANCE_SENSOR.
  std::array<std::uint16_t, 72> distances{};  ///< cm; max + 1: free, 65535: not known.
  std::uint8_t increment{};                   ///< Degrees; increment_f wins if it is not 0.
  std::uint16_t min_distance{};               ///< cm.
  std::uint16_t max_distance{};               ///< cm.
  float increment_f{};
  float angle_offset{};  ///< Degrees.
  std::uint8_t frame{};  ///< MAV_FRAME; 12: body FRD, 0: north.
  static constexpr std::tuple kMembers{Member<&ObstacleDistance::time_usec>{"time_usec"},
                                       Member<&ObstacleDistance::sensor_type>{"sensor_type"},
                                       Member<&ObstacleDistance::distances>{"distances"},
                                       Member<&ObstacleDistance::increment>{"increment"},
                                       Member<&ObstacleDistance::min_distance>{"min_distance"},
                                       Member<&ObstacleDistance::max_distance>{"max_distance"},
                                       Member<&ObstacleDistance::increment_f>{"increment_f"},
                                       Member<&ObstacleDistance::angle_offset>{"angle_offset"},
                                       Member<&ObstacleDistance::frame>{"frame"}};
};

/// Whether it flies.
struct ExtendedSysState {
  static constexpr MessageType kType = kExtendedSysState;
  std::uint8_t vtol_state{};
  std::uint8_t landed_state{};  ///< 1 on the ground, 2 in the air, 3 taking off, 4 landing.
  static constexpr std::tuple kMembers{Member<&ExtendedSysState::vtol_state>{"vtol_state"},
                                       Member<&ExtendedSysState::landed_state>{"landed_state"}};
};

/// A line for people; a long one in pieces.
struct Statustext {
  static constexpr MessageType kType = kStatustext;
  std::uint8_t severity{};      ///< 0 emergency .. 7 debug.
  std::array<char, 50> text{};  ///< No terminator if it is full.
  std::uint16_t id{};           ///< Of the line that it is a piece of; 0: whole.
  std::uint8_t chunk_seq{};     ///< Which piece.
  static constexpr std::tuple kMembers{Member<&Statustext::severity>{"severity"},
                                       Member<&Statustext::text>{"text"}, Member<&Statustext::id>{"id"},
                                       Member<&Statustext::chunk_seq>{"chunk_seq"}};
};

/// A parameter by its name. PX4 has an INT32's bits in the float, ArduPilot the number.
struct ParamRequestRead {
  static constexpr MessageType kType = kParamRequestRead;
  std::uint8_t target_system{};
  std::uint8_t target_component{};
  std::array<char, 16> param_id{};  ///< No terminator if it is full.
  std::int16_t param_index{-1};     ///< -1: by name.
  static constexpr std::tuple kMembers{Member<&ParamRequestRead::target_system>{"target_system"},
                                       Member<&ParamRequestRead::target_component>{"target_component"},
                                       Member<&ParamRequestRead::param_id>{"param_id"},
                                       Member<&ParamRequestRead::param_index>{"param_index"}};
};
struct ParamSet {
  static constexpr MessageType kType = kParamSet;
  std::uint8_t target_system{};
  std::uint8_t target_component{};
  std::array<char, 16> param_id{};
  float param_value{};
  std::uint8_t param_type{};  ///< MAV_PARAM_TYPE; 6 INT32, 9 REAL32.
  static constexpr std::tuple kMembers{
      Member<&ParamSet::target_system>{"target_system"},
      Member<&ParamSet::target_component>{"target_component"}, Member<&ParamSet::param_id>{"param_id"},
      Member<&ParamSet::param_value>{"param_value"}, Member<&ParamSet::param_type>{"param_type"}};
};
/// The answer to both, with the value that is really held.
struct ParamValue {
  static constexpr MessageType kType = kParamValue;
  std::array<char, 16> param_id{};
  float param_value{};
  std::uint8_t param_type{};
  std::uint16_t param_count{};
  std::uint16_t param_index{};
  static constexpr std::tuple kMembers{
      Member<&ParamValue::param_id>{"param_id"}, Member<&ParamValue::param_value>{"param_value"},
      Member<&ParamValue::param_type>{"param_type"}, Member<&ParamValue::param_count>{"param_count"},
      Member<&ParamValue::param_index>{"param_index"}};
};

/// Of the system's state only the battery.
struct SysStatus {
  static constexpr MessageType kType = kSysStatus;
  std::int8_t battery_remaining{};  ///< Percent; -1: unknown.
  static constexpr std::tuple kMembers{Member<&SysStatus::battery_remaining>{"battery_remaining"}};
};

}  // namespace roborun::firmware_if::mavlink
