/// The DroneCAN messages of sensors, as messages.hpp has them.
#pragma once

#include <cstdint>
#include <string_view>
#include <tuple>

#include "firmware_if/dronecan/wire.hpp"

namespace roborun::firmware_if::dronecan {

/// Part of others. Microseconds, 0: unknown.
struct Timestamp {
  static constexpr std::string_view kName{"uavcan.Timestamp"};
  Uint<56, Cast::kTruncated>::Value usec{};
  static constexpr std::tuple kFields{
      Field<Uint<56, Cast::kTruncated>, &Timestamp::usec>{"usec"},
  };
};

/// Part of others. Fixed-axis angles, 15 degrees a step.
struct CoarseOrientation {
  static constexpr std::string_view kName{"uavcan.CoarseOrientation"};
  Fixed<Int<5>, 3>::Value fixed_axis_roll_pitch_yaw{};
  Bool::Value orientation_defined{};
  static constexpr std::tuple kFields{
      Field<Fixed<Int<5>, 3>, &CoarseOrientation::fixed_axis_roll_pitch_yaw>{"fixed_axis_roll_pitch_yaw"},
      Field<Bool, &CoarseOrientation::orientation_defined>{"orientation_defined"},
  };
};

/// Body frame FRD, SI units.
struct RawImu {
  static constexpr std::string_view kName{"uavcan.equipment.ahrs.RawIMU"};
  Nested<Timestamp>::Value timestamp{};
  Float<32>::Value integration_interval{};              ///< s
  Fixed<Float<16>, 3>::Value rate_gyro_latest{};        ///< rad/s
  Fixed<Float<32>, 3>::Value rate_gyro_integral{};      ///< rad
  Fixed<Float<16>, 3>::Value accelerometer_latest{};    ///< m/s2
  Fixed<Float<32>, 3>::Value accelerometer_integral{};  ///< m/s
  Dynamic<Float<16>, 36>::Value covariance{};
  static constexpr std::tuple kFields{
      Field<Nested<Timestamp>, &RawImu::timestamp>{"timestamp"},
      Field<Float<32>, &RawImu::integration_interval>{"integration_interval"},
      Field<Fixed<Float<16>, 3>, &RawImu::rate_gyro_latest>{"rate_gyro_latest"},
      Field<Fixed<Float<32>, 3>, &RawImu::rate_gyro_integral>{"rate_gyro_integral"},
      Field<Fixed<Float<16>, 3>, &RawImu::accelerometer_latest>{"accelerometer_latest"},
      Field<Fixed<Float<32>, 3>, &RawImu::accelerometer_integral>{"accelerometer_integral"},
      Field<Dynamic<Float<16>, 36>, &RawImu::covariance>{"covariance"},
  };
};

/// Attitude of the body (FRD) in NED.
struct AhrsSolution {
  static constexpr std::string_view kName{"uavcan.equipment.ahrs.Solution"};
  Nested<Timestamp>::Value timestamp{};
  Fixed<Float<16>, 4>::Value orientation_xyzw{};
  Dynamic<Float<16>, 9>::Value orientation_covariance{};
  Fixed<Float<16>, 3>::Value angular_velocity{};  ///< rad/s
  Dynamic<Float<16>, 9>::Value angular_velocity_covariance{};
  Fixed<Float<16>, 3>::Value linear_acceleration{};  ///< m/s2
  Dynamic<Float<16>, 9>::Value linear_acceleration_covariance{};
  static constexpr std::tuple kFields{
      Field<Nested<Timestamp>, &AhrsSolution::timestamp>{"timestamp"},
      Field<Fixed<Float<16>, 4>, &AhrsSolution::orientation_xyzw>{"orientation_xyzw"},
      Padding<4>{},
      Field<Dynamic<Float<16>, 9>, &AhrsSolution::orientation_covariance>{"orientation_covariance"},
      Field<Fixed<Float<16>, 3>, &AhrsSolution::angular_velocity>{"angular_velocity"},
      Padding<4>{},
      Field<Dynamic<Float<16>, 9>, &AhrsSolution::angular_velocity_covariance>{"angular_velocity_covariance"},
      Field<Fixed<Float<16>, 3>, &AhrsSolution::linear_acceleration>{"linear_acceleration"},
      Field<Dynamic<Float<16>, 9>, &AhrsSolution::linear_acceleration_covariance>{
          "linear_acceleration_covariance"},
  };
};

/// Part of GnssFix2.
struct EcefPositionVelocity {
  static constexpr std::string_view kName{"uavcan.equipment.gnss.ECEFPositionVelocity"};
  Fixed<Float<32>, 3>::Value velocity_xyz{};  ///< m/s
  Fixed<Int<36>, 3>::Value position_xyz_mm{};
  Dynamic<Float<16>, 36>::Value covariance{};
  static constexpr std::tuple kFields{
      Field<Fixed<Float<32>, 3>, &EcefPositionVelocity::velocity_xyz>{"velocity_xyz"},
      Field<Fixed<Int<36>, 3>, &EcefPositionVelocity::position_xyz_mm>{"position_xyz_mm"},
      Padding<6>{},
      Field<Dynamic<Float<16>, 36>, &EcefPositionVelocity::covariance>{"covariance"},
  };
};

/// From a GNSS receiver.
struct GnssFix2 {
  static constexpr std::string_view kName{"uavcan.equipment.gnss.Fix2"};
  Nested<Timestamp>::Value timestamp{};
  Nested<Timestamp>::Value gnss_timestamp{};
  Uint<3>::Value gnss_time_standard{};
  Uint<8>::Value num_leap_seconds{};  ///< 0: unknown.
  Int<37>::Value longitude_deg_1e8{};
  Int<37>::Value latitude_deg_1e8{};
  Int<27>::Value height_ellipsoid_mm{};
  Int<27>::Value height_msl_mm{};
  Fixed<Float<32>, 3>::Value ned_velocity{};  ///< m/s
  Uint<6>::Value sats_used{};
  Uint<2>::Value status{};  ///< 0 none, 1 time only, 2 2D, 3 3D.
  Uint<4>::Value mode{};
  Uint<6>::Value sub_mode{};
  Dynamic<Float<16>, 36>::Value covariance{};  ///< Position (m2), then velocity (m2/s2), NED.
  Float<16>::Value pdop{};
  Dynamic<Nested<EcefPositionVelocity>, 1>::Value ecef_position_velocity{};
  static constexpr std::tuple kFields{
      Field<Nested<Timestamp>, &GnssFix2::timestamp>{"timestamp"},
      Field<Nested<Timestamp>, &GnssFix2::gnss_timestamp>{"gnss_timestamp"},
      Field<Uint<3>, &GnssFix2::gnss_time_standard>{"gnss_time_standard"},
      Padding<13>{},
      Field<Uint<8>, &GnssFix2::num_leap_seconds>{"num_leap_seconds"},
      Field<Int<37>, &GnssFix2::longitude_deg_1e8>{"longitude_deg_1e8"},
      Field<Int<37>, &GnssFix2::latitude_deg_1e8>{"latitude_deg_1e8"},
      Field<Int<27>, &GnssFix2::height_ellipsoid_mm>{"height_ellipsoid_mm"},
      Field<Int<27>, &GnssFix2::height_msl_mm>{"height_msl_mm"},
      Field<Fixed<Float<32>, 3>, &GnssFix2::ned_velocity>{"ned_velocity"},
      Field<Uint<6>, &GnssFix2::sats_used>{"sats_used"},
      Field<Uint<2>, &GnssFix2::status>{"status"},
      Field<Uint<4>, &GnssFix2::mode>{"mode"},
      Field<Uint<6>, &GnssFix2::sub_mode>{"sub_mode"},
      Field<Dynamic<Float<16>, 36>, &GnssFix2::covariance>{"covariance"},
      Field<Float<16>, &GnssFix2::pdop>{"pdop"},
      Field<Dynamic<Nested<EcefPositionVelocity>, 1>, &GnssFix2::ecef_position_velocity>{
          "ecef_position_velocity"},
  };
};

/// From a range finder.
struct RangeMeasurement {
  static constexpr std::string_view kName{"uavcan.equipment.range_sensor.Measurement"};
  Nested<Timestamp>::Value timestamp{};
  Uint<8>::Value sensor_id{};
  Nested<CoarseOrientation>::Value beam_orientation_in_body_frame{};
  Float<16>::Value field_of_view{};  ///< rad
  Uint<5>::Value sensor_type{};
  Uint<3>::Value reading_type{};  ///< 0 undefined, 1 valid, 2 too close, 3 too far.
  Float<16>::Value range{};       ///< m
  static constexpr std::tuple kFields{
      Field<Nested<Timestamp>, &RangeMeasurement::timestamp>{"timestamp"},
      Field<Uint<8>, &RangeMeasurement::sensor_id>{"sensor_id"},
      Field<Nested<CoarseOrientation>, &RangeMeasurement::beam_orientation_in_body_frame>{
          "beam_orientation_in_body_frame"},
      Field<Float<16>, &RangeMeasurement::field_of_view>{"field_of_view"},
      Field<Uint<5>, &RangeMeasurement::sensor_type>{"sensor_type"},
      Field<Uint<3>, &RangeMeasurement::reading_type>{"reading_type"},
      Field<Float<16>, &RangeMeasurement::range>{"range"},
  };
};

/// From a barometer.
struct StaticPressure {
  static constexpr std::string_view kName{"uavcan.equipment.air_data.StaticPressure"};
  Float<32>::Value static_pressure{};           ///< Pa
  Float<16>::Value static_pressure_variance{};  ///< Pa2
  static constexpr std::tuple kFields{
      Field<Float<32>, &StaticPressure::static_pressure>{"static_pressure"},
      Field<Float<16>, &StaticPressure::static_pressure_variance>{"static_pressure_variance"},
  };
};

/// From a barometer. Its own temperature, not the air's.
struct StaticTemperature {
  static constexpr std::string_view kName{"uavcan.equipment.air_data.StaticTemperature"};
  Float<16>::Value static_temperature{};           ///< K
  Float<16>::Value static_temperature_variance{};  ///< K2
  static constexpr std::tuple kFields{
      Field<Float<16>, &StaticTemperature::static_temperature>{"static_temperature"},
      Field<Float<16>, &StaticTemperature::static_temperature_variance>{"static_temperature_variance"},
  };
};

/// From the magnetometer of a node that has one. Body frame FRD.
struct MagneticFieldStrength {
  static constexpr std::string_view kName{"uavcan.equipment.ahrs.MagneticFieldStrength"};
  Fixed<Float<16>, 3>::Value magnetic_field_ga{};  ///< Gauss
  Dynamic<Float<16>, 9>::Value magnetic_field_covariance{};
  static constexpr std::tuple kFields{
      Field<Fixed<Float<16>, 3>, &MagneticFieldStrength::magnetic_field_ga>{"magnetic_field_ga"},
      Field<Dynamic<Float<16>, 9>, &MagneticFieldStrength::magnetic_field_covariance>{
          "magnetic_field_covariance"},
  };
};

/// From one of the magnetometers of a node. Body frame FRD.
struct MagneticFieldStrength2 {
  static constexpr std::string_view kName{"uavcan.equipment.ahrs.MagneticFieldStrength2"};
  Uint<8>::Value sensor_id{};
  Fixed<Float<16>, 3>::Value magnetic_field_ga{};  ///< Gauss
  Dynamic<Float<16>, 9>::Value magnetic_field_covariance{};
  static constexpr std::tuple kFields{
      Field<Uint<8>, &MagneticFieldStrength2::sensor_id>{"sensor_id"},
      Field<Fixed<Float<16>, 3>, &MagneticFieldStrength2::magnetic_field_ga>{"magnetic_field_ga"},
      Field<Dynamic<Float<16>, 9>, &MagneticFieldStrength2::magnetic_field_covariance>{
          "magnetic_field_covariance"},
  };
};

/// From a GNSS receiver with two antennas: the heading of the body, clockwise from true north.
struct GnssHeading {
  static constexpr std::string_view kName{"ardupilot.gnss.Heading"};
  Bool::Value heading_valid{};
  Bool::Value heading_accuracy_valid{};
  Float<16>::Value heading_rad{};
  Float<16>::Value heading_accuracy_rad{};
  static constexpr std::tuple kFields{
      Field<Bool, &GnssHeading::heading_valid>{"heading_valid"},
      Field<Bool, &GnssHeading::heading_accuracy_valid>{"heading_accuracy_valid"},
      Field<Float<16>, &GnssHeading::heading_rad>{"heading_rad"},
      Field<Float<16>, &GnssHeading::heading_accuracy_rad>{"heading_accuracy_rad"},
  };
};

}  // namespace roborun::firmware_if::dronecan
