/// MAVLink messages of measurements towards the autopilot and from it, and the simulator link.
/// Names, types and order of the fields are those of the public definitions (mavlink/mavlink, common.xml and
/// minimal.xml); a table that does not give the published CRC_EXTRA does not compile.
#pragma once

#include "firmware_if/mavlink/message_type.hpp"

namespace roborun::firmware_if::mavlink {

using enum FieldType;

inline constexpr auto kScaledPressure = define(
    29, "SCALED_PRESSURE", 115,
    {{kUint32, "time_boot_ms"}, {kFloat, "press_abs"}, {kFloat, "press_diff"}, {kInt16, "temperature"}},
    {{kInt16, "temperature_press_diff"}});

inline constexpr auto kHilActuatorControls =
    define(93, "HIL_ACTUATOR_CONTROLS", 47,
           {{kUint64, "time_usec"}, {kFloat, "controls", 16}, {kUint8, "mode"}, {kUint64, "flags"}});

inline constexpr auto kVisionPositionEstimate =
    define(102, "VISION_POSITION_ESTIMATE", 158,
           {{kUint64, "usec"},
            {kFloat, "x"},
            {kFloat, "y"},
            {kFloat, "z"},
            {kFloat, "roll"},
            {kFloat, "pitch"},
            {kFloat, "yaw"}},
           {{kFloat, "covariance", 21}, {kUint8, "reset_counter"}});

inline constexpr auto kHighresImu = define(105, "HIGHRES_IMU", 93,
                                           {{kUint64, "time_usec"},
                                            {kFloat, "xacc"},
                                            {kFloat, "yacc"},
                                            {kFloat, "zacc"},
                                            {kFloat, "xgyro"},
                                            {kFloat, "ygyro"},
                                            {kFloat, "zgyro"},
                                            {kFloat, "xmag"},
                                            {kFloat, "ymag"},
                                            {kFloat, "zmag"},
                                            {kFloat, "abs_pressure"},
                                            {kFloat, "diff_pressure"},
                                            {kFloat, "pressure_alt"},
                                            {kFloat, "temperature"},
                                            {kUint16, "fields_updated"}},
                                           {{kUint8, "id"}});

inline constexpr auto kHilSensor = define(107, "HIL_SENSOR", 108,
                                          {{kUint64, "time_usec"},
                                           {kFloat, "xacc"},
                                           {kFloat, "yacc"},
                                           {kFloat, "zacc"},
                                           {kFloat, "xgyro"},
                                           {kFloat, "ygyro"},
                                           {kFloat, "zgyro"},
                                           {kFloat, "xmag"},
                                           {kFloat, "ymag"},
                                           {kFloat, "zmag"},
                                           {kFloat, "abs_pressure"},
                                           {kFloat, "diff_pressure"},
                                           {kFloat, "pressure_alt"},
                                           {kFloat, "temperature"},
                                           {kUint32, "fields_updated"}},
                                          {{kUint8, "id"}});

inline constexpr auto kHilGps = define(113, "HIL_GPS", 124,
                                       {{kUint64, "time_usec"},
                                        {kUint8, "fix_type"},
                                        {kInt32, "lat"},
                                        {kInt32, "lon"},
                                        {kInt32, "alt"},
                                        {kUint16, "eph"},
                                        {kUint16, "epv"},
                                        {kUint16, "vel"},
                                        {kInt16, "vn"},
                                        {kInt16, "ve"},
                                        {kInt16, "vd"},
                                        {kUint16, "cog"},
                                        {kUint8, "satellites_visible"}},
                                       {{kUint8, "id"}, {kUint16, "yaw"}});

inline constexpr auto kHilStateQuaternion = define(115, "HIL_STATE_QUATERNION", 4,
                                                   {{kUint64, "time_usec"},
                                                    {kFloat, "attitude_quaternion", 4},
                                                    {kFloat, "rollspeed"},
                                                    {kFloat, "pitchspeed"},
                                                    {kFloat, "yawspeed"},
                                                    {kInt32, "lat"},
                                                    {kInt32, "lon"},
                                                    {kInt32, "alt"},
                                                    {kInt16, "vx"},
                                                    {kInt16, "vy"},
                                                    {kInt16, "vz"},
                                                    {kUint16, "ind_airspeed"},
                                                    {kUint16, "true_airspeed"},
                                                    {kInt16, "xacc"},
                                                    {kInt16, "yacc"},
                                                    {kInt16, "zacc"}});

inline constexpr auto kDistanceSensor = define(132, "DISTANCE_SENSOR", 85,
                                               {{kUint32, "time_boot_ms"},
                                                {kUint16, "min_distance"},
                                                {kUint16, "max_distance"},
                                                {kUint16, "current_distance"},
                                                {kUint8, "type"},
                                                {kUint8, "id"},
                                                {kUint8, "orientation"},
                                                {kUint8, "covariance"}},
                                               {{kFloat, "horizontal_fov"},
                                                {kFloat, "vertical_fov"},
                                                {kFloat, "quaternion", 4},
                                                {kUint8, "signal_quality"}});

inline constexpr auto kObstacleDistance =
    define(330, "OBSTACLE_DISTANCE", 23,
           {{kUint64, "time_usec"},
            {kUint8, "sensor_type"},
            {kUint16, "distances", 72},
            {kUint8, "increment"},
            {kUint16, "min_distance"},
            {kUint16, "max_distance"}},
           {{kFloat, "increment_f"}, {kFloat, "angle_offset"}, {kUint8, "frame"}});

inline constexpr auto kOdometry =
    define(331, "ODOMETRY", 91,
           {{kUint64, "time_usec"},
            {kUint8, "frame_id"},
            {kUint8, "child_frame_id"},
            {kFloat, "x"},
            {kFloat, "y"},
            {kFloat, "z"},
            {kFloat, "q", 4},
            {kFloat, "vx"},
            {kFloat, "vy"},
            {kFloat, "vz"},
            {kFloat, "rollspeed"},
            {kFloat, "pitchspeed"},
            {kFloat, "yawspeed"},
            {kFloat, "pose_covariance", 21},
            {kFloat, "velocity_covariance", 21}},
           {{kUint8, "reset_counter"}, {kUint8, "estimator_type"}, {kInt8, "quality"}});

inline constexpr auto kObstacleDistance3d = define(11037, "OBSTACLE_DISTANCE_3D", 130,
                                                   {{kUint32, "time_boot_ms"},
                                                    {kUint8, "sensor_type"},
                                                    {kUint8, "frame"},
                                                    {kUint16, "obstacle_id"},
                                                    {kFloat, "x"},
                                                    {kFloat, "y"},
                                                    {kFloat, "z"},
                                                    {kFloat, "min_distance"},
                                                    {kFloat, "max_distance"}});

}  // namespace roborun::firmware_if::mavlink
