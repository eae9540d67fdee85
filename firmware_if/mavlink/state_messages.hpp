/// MAVLink messages of what the vehicle says of its state, and where it is to go.
/// Names, types and order of the fields are those of the public definitions (mavlink/mavlink, common.xml and
/// minimal.xml); a table that does not give the published CRC_EXTRA does not compile.
#pragma once

#include "firmware_if/mavlink/message_type.hpp"

namespace roborun::firmware_if::mavlink {

using enum FieldType;

inline constexpr auto kSysStatus = define(1, "SYS_STATUS", 124,
                                          {{kUint32, "onboard_control_sensors_present"},
                                           {kUint32, "onboard_control_sensors_enabled"},
                                           {kUint32, "onboard_control_sensors_health"},
                                           {kUint16, "load"},
                                           {kUint16, "voltage_battery"},
                                           {kInt16, "current_battery"},
                                           {kInt8, "battery_remaining"},
                                           {kUint16, "drop_rate_comm"},
                                           {kUint16, "errors_comm"},
                                           {kUint16, "errors_count1"},
                                           {kUint16, "errors_count2"},
                                           {kUint16, "errors_count3"},
                                           {kUint16, "errors_count4"}},
                                          {{kUint32, "onboard_control_sensors_present_extended"},
                                           {kUint32, "onboard_control_sensors_enabled_extended"},
                                           {kUint32, "onboard_control_sensors_health_extended"}});

inline constexpr auto kGpsRawInt = define(24, "GPS_RAW_INT", 24,
                                          {{kUint64, "time_usec"},
                                           {kUint8, "fix_type"},
                                           {kInt32, "lat"},
                                           {kInt32, "lon"},
                                           {kInt32, "alt"},
                                           {kUint16, "eph"},
                                           {kUint16, "epv"},
                                           {kUint16, "vel"},
                                           {kUint16, "cog"},
                                           {kUint8, "satellites_visible"}},
                                          {{kInt32, "alt_ellipsoid"},
                                           {kUint32, "h_acc"},
                                           {kUint32, "v_acc"},
                                           {kUint32, "vel_acc"},
                                           {kUint32, "hdg_acc"},
                                           {kUint16, "yaw"}});

inline constexpr auto kAttitude = define(30, "ATTITUDE", 39,
                                         {{kUint32, "time_boot_ms"},
                                          {kFloat, "roll"},
                                          {kFloat, "pitch"},
                                          {kFloat, "yaw"},
                                          {kFloat, "rollspeed"},
                                          {kFloat, "pitchspeed"},
                                          {kFloat, "yawspeed"}});

inline constexpr auto kAttitudeQuaternion = define(31, "ATTITUDE_QUATERNION", 246,
                                                   {{kUint32, "time_boot_ms"},
                                                    {kFloat, "q1"},
                                                    {kFloat, "q2"},
                                                    {kFloat, "q3"},
                                                    {kFloat, "q4"},
                                                    {kFloat, "rollspeed"},
                                                    {kFloat, "pitchspeed"},
                                                    {kFloat, "yawspeed"}},
                                                   {{kFloat, "repr_offset_q", 4}});

inline constexpr auto kLocalPositionNed = define(32, "LOCAL_POSITION_NED", 185,
                                                 {{kUint32, "time_boot_ms"},
                                                  {kFloat, "x"},
                                                  {kFloat, "y"},
                                                  {kFloat, "z"},
                                                  {kFloat, "vx"},
                                                  {kFloat, "vy"},
                                                  {kFloat, "vz"}});

inline constexpr auto kGlobalPositionInt = define(33, "GLOBAL_POSITION_INT", 104,
                                                  {{kUint32, "time_boot_ms"},
                                                   {kInt32, "lat"},
                                                   {kInt32, "lon"},
                                                   {kInt32, "alt"},
                                                   {kInt32, "relative_alt"},
                                                   {kInt16, "vx"},
                                                   {kInt16, "vy"},
                                                   {kInt16, "vz"},
                                                   {kUint16, "hdg"}});

inline constexpr auto kSetGpsGlobalOrigin =
    define(48, "SET_GPS_GLOBAL_ORIGIN", 41,
           {{kUint8, "target_system"}, {kInt32, "latitude"}, {kInt32, "longitude"}, {kInt32, "altitude"}},
           {{kUint64, "time_usec"}});

inline constexpr auto kGpsGlobalOrigin =
    define(49, "GPS_GLOBAL_ORIGIN", 39, {{kInt32, "latitude"}, {kInt32, "longitude"}, {kInt32, "altitude"}},
           {{kUint64, "time_usec"}});

inline constexpr auto kRcChannels = define(
    65, "RC_CHANNELS", 118,
    {{kUint32, "time_boot_ms"}, {kUint8, "chancount"},   {kUint16, "chan1_raw"},  {kUint16, "chan2_raw"},
     {kUint16, "chan3_raw"},    {kUint16, "chan4_raw"},  {kUint16, "chan5_raw"},  {kUint16, "chan6_raw"},
     {kUint16, "chan7_raw"},    {kUint16, "chan8_raw"},  {kUint16, "chan9_raw"},  {kUint16, "chan10_raw"},
     {kUint16, "chan11_raw"},   {kUint16, "chan12_raw"}, {kUint16, "chan13_raw"}, {kUint16, "chan14_raw"},
     {kUint16, "chan15_raw"},   {kUint16, "chan16_raw"}, {kUint16, "chan17_raw"}, {kUint16, "chan18_raw"},
     {kUint8, "rssi"}});

inline constexpr auto kVfrHud = define(74, "VFR_HUD", 20,
                                       {{kFloat, "airspeed"},
                                        {kFloat, "groundspeed"},
                                        {kInt16, "heading"},
                                        {kUint16, "throttle"},
                                        {kFloat, "alt"},
                                        {kFloat, "climb"}});

inline constexpr auto kSetAttitudeTarget = define(82, "SET_ATTITUDE_TARGET", 49,
                                                  {{kUint32, "time_boot_ms"},
                                                   {kUint8, "target_system"},
                                                   {kUint8, "target_component"},
                                                   {kUint8, "type_mask"},
                                                   {kFloat, "q", 4},
                                                   {kFloat, "body_roll_rate"},
                                                   {kFloat, "body_pitch_rate"},
                                                   {kFloat, "body_yaw_rate"},
                                                   {kFloat, "thrust"}},
                                                  {{kFloat, "thrust_body", 3}});

inline constexpr auto kAttitudeTarget = define(83, "ATTITUDE_TARGET", 22,
                                               {{kUint32, "time_boot_ms"},
                                                {kUint8, "type_mask"},
                                                {kFloat, "q", 4},
                                                {kFloat, "body_roll_rate"},
                                                {kFloat, "body_pitch_rate"},
                                                {kFloat, "body_yaw_rate"},
                                                {kFloat, "thrust"}});

inline constexpr auto kSetPositionTargetLocalNed = define(84, "SET_POSITION_TARGET_LOCAL_NED", 143,
                                                          {{kUint32, "time_boot_ms"},
                                                           {kUint8, "target_system"},
                                                           {kUint8, "target_component"},
                                                           {kUint8, "coordinate_frame"},
                                                           {kUint16, "type_mask"},
                                                           {kFloat, "x"},
                                                           {kFloat, "y"},
                                                           {kFloat, "z"},
                                                           {kFloat, "vx"},
                                                           {kFloat, "vy"},
                                                           {kFloat, "vz"},
                                                           {kFloat, "afx"},
                                                           {kFloat, "afy"},
                                                           {kFloat, "afz"},
                                                           {kFloat, "yaw"},
                                                           {kFloat, "yaw_rate"}});

inline constexpr auto kPositionTargetLocalNed = define(85, "POSITION_TARGET_LOCAL_NED", 140,
                                                       {{kUint32, "time_boot_ms"},
                                                        {kUint8, "coordinate_frame"},
                                                        {kUint16, "type_mask"},
                                                        {kFloat, "x"},
                                                        {kFloat, "y"},
                                                        {kFloat, "z"},
                                                        {kFloat, "vx"},
                                                        {kFloat, "vy"},
                                                        {kFloat, "vz"},
                                                        {kFloat, "afx"},
                                                        {kFloat, "afy"},
                                                        {kFloat, "afz"},
                                                        {kFloat, "yaw"},
                                                        {kFloat, "yaw_rate"}});

inline constexpr auto kSetPositionTargetGlobalInt = define(86, "SET_POSITION_TARGET_GLOBAL_INT", 5,
                                                           {{kUint32, "time_boot_ms"},
                                                            {kUint8, "target_system"},
                                                            {kUint8, "target_component"},
                                                            {kUint8, "coordinate_frame"},
                                                            {kUint16, "type_mask"},
                                                            {kInt32, "lat_int"},
                                                            {kInt32, "lon_int"},
                                                            {kFloat, "alt"},
                                                            {kFloat, "vx"},
                                                            {kFloat, "vy"},
                                                            {kFloat, "vz"},
                                                            {kFloat, "afx"},
                                                            {kFloat, "afy"},
                                                            {kFloat, "afz"},
                                                            {kFloat, "yaw"},
                                                            {kFloat, "yaw_rate"}});

inline constexpr auto kPositionTargetGlobalInt = define(87, "POSITION_TARGET_GLOBAL_INT", 150,
                                                        {{kUint32, "time_boot_ms"},
                                                         {kUint8, "coordinate_frame"},
                                                         {kUint16, "type_mask"},
                                                         {kInt32, "lat_int"},
                                                         {kInt32, "lon_int"},
                                                         {kFloat, "alt"},
                                                         {kFloat, "vx"},
                                                         {kFloat, "vy"},
                                                         {kFloat, "vz"},
                                                         {kFloat, "afx"},
                                                         {kFloat, "afy"},
                                                         {kFloat, "afz"},
                                                         {kFloat, "yaw"},
                                                         {kFloat, "yaw_rate"}});

inline constexpr auto kBatteryStatus = define(147, "BATTERY_STATUS", 154,
                                              {{kUint8, "id"},
                                               {kUint8, "battery_function"},
                                               {kUint8, "type"},
                                               {kInt16, "temperature"},
                                               {kUint16, "voltages", 10},
                                               {kInt16, "current_battery"},
                                               {kInt32, "current_consumed"},
                                               {kInt32, "energy_consumed"},
                                               {kInt8, "battery_remaining"}},
                                              {{kInt32, "time_remaining"},
                                               {kUint8, "charge_state"},
                                               {kUint16, "voltages_ext", 4},
                                               {kUint8, "mode"},
                                               {kUint32, "fault_bitmask"}});

inline constexpr auto kFenceStatus = define(
    162, "FENCE_STATUS", 189,
    {{kUint8, "breach_status"}, {kUint16, "breach_count"}, {kUint8, "breach_type"}, {kUint32, "breach_time"}},
    {{kUint8, "breach_mitigation"}});

inline constexpr auto kEstimatorStatus = define(230, "ESTIMATOR_STATUS", 163,
                                                {{kUint64, "time_usec"},
                                                 {kUint16, "flags"},
                                                 {kFloat, "vel_ratio"},
                                                 {kFloat, "pos_horiz_ratio"},
                                                 {kFloat, "pos_vert_ratio"},
                                                 {kFloat, "mag_ratio"},
                                                 {kFloat, "hagl_ratio"},
                                                 {kFloat, "tas_ratio"},
                                                 {kFloat, "pos_horiz_accuracy"},
                                                 {kFloat, "pos_vert_accuracy"}});

inline constexpr auto kVibration = define(241, "VIBRATION", 90,
                                          {{kUint64, "time_usec"},
                                           {kFloat, "vibration_x"},
                                           {kFloat, "vibration_y"},
                                           {kFloat, "vibration_z"},
                                           {kUint32, "clipping_0"},
                                           {kUint32, "clipping_1"},
                                           {kUint32, "clipping_2"}});

inline constexpr auto kHomePosition = define(242, "HOME_POSITION", 104,
                                             {{kInt32, "latitude"},
                                              {kInt32, "longitude"},
                                              {kInt32, "altitude"},
                                              {kFloat, "x"},
                                              {kFloat, "y"},
                                              {kFloat, "z"},
                                              {kFloat, "q", 4},
                                              {kFloat, "approach_x"},
                                              {kFloat, "approach_y"},
                                              {kFloat, "approach_z"}},
                                             {{kUint64, "time_usec"}});

inline constexpr auto kExtendedSysState =
    define(245, "EXTENDED_SYS_STATE", 130, {{kUint8, "vtol_state"}, {kUint8, "landed_state"}});

inline constexpr auto kTrajectoryRepresentationWaypoints =
    define(332, "TRAJECTORY_REPRESENTATION_WAYPOINTS", 236,
           {{kUint64, "time_usec"},
            {kUint8, "valid_points"},
            {kFloat, "pos_x", 5},
            {kFloat, "pos_y", 5},
            {kFloat, "pos_z", 5},
            {kFloat, "vel_x", 5},
            {kFloat, "vel_y", 5},
            {kFloat, "vel_z", 5},
            {kFloat, "acc_x", 5},
            {kFloat, "acc_y", 5},
            {kFloat, "acc_z", 5},
            {kFloat, "pos_yaw", 5},
            {kFloat, "vel_yaw", 5},
            {kUint16, "command", 5}});

}  // namespace roborun::firmware_if::mavlink
