/// MAVLink messages of the link itself: who is there, clock, commands, parameters, missions, texts, signing.
/// Names, types and order of the fields are those of the public definitions (mavlink/mavlink, common.xml and
/// minimal.xml); a table that does not give the published CRC_EXTRA does not compile.
#pragma once

#include "firmware_if/mavlink/message_type.hpp"

namespace roborun::firmware_if::mavlink {

using enum FieldType;

inline constexpr auto kHeartbeat = define(0, "HEARTBEAT", 50,
                                          {{kUint8, "type"},
                                           {kUint8, "autopilot"},
                                           {kUint8, "base_mode"},
                                           {kUint32, "custom_mode"},
                                           {kUint8, "system_status"},
                                           {kUint8, "mavlink_version"}});

inline constexpr auto kSystemTime =
    define(2, "SYSTEM_TIME", 137, {{kUint64, "time_unix_usec"}, {kUint32, "time_boot_ms"}});

inline constexpr auto kPing = define(
    4, "PING", 237,
    {{kUint64, "time_usec"}, {kUint32, "seq"}, {kUint8, "target_system"}, {kUint8, "target_component"}});

inline constexpr auto kSetMode =
    define(11, "SET_MODE", 89, {{kUint8, "target_system"}, {kUint8, "base_mode"}, {kUint32, "custom_mode"}});

inline constexpr auto kParamRequestRead = define(20, "PARAM_REQUEST_READ", 214,
                                                 {{kUint8, "target_system"},
                                                  {kUint8, "target_component"},
                                                  {kChar, "param_id", 16},
                                                  {kInt16, "param_index"}});

inline constexpr auto kParamRequestList =
    define(21, "PARAM_REQUEST_LIST", 159, {{kUint8, "target_system"}, {kUint8, "target_component"}});

inline constexpr auto kParamValue = define(22, "PARAM_VALUE", 220,
                                           {{kChar, "param_id", 16},
                                            {kFloat, "param_value"},
                                            {kUint8, "param_type"},
                                            {kUint16, "param_count"},
                                            {kUint16, "param_index"}});

inline constexpr auto kParamSet = define(23, "PARAM_SET", 168,
                                         {{kUint8, "target_system"},
                                          {kUint8, "target_component"},
                                          {kChar, "param_id", 16},
                                          {kFloat, "param_value"},
                                          {kUint8, "param_type"}});

/// Deprecated, and what ArduCopter asks for items with.
inline constexpr auto kMissionRequest = define(
    40, "MISSION_REQUEST", 230, {{kUint8, "target_system"}, {kUint8, "target_component"}, {kUint16, "seq"}},
    {{kUint8, "mission_type"}});

inline constexpr auto kMissionSetCurrent =
    define(41, "MISSION_SET_CURRENT", 28,
           {{kUint8, "target_system"}, {kUint8, "target_component"}, {kUint16, "seq"}});

inline constexpr auto kMissionCurrent = define(42, "MISSION_CURRENT", 28, {{kUint16, "seq"}},
                                               {{kUint16, "total"},
                                                {kUint8, "mission_state"},
                                                {kUint8, "mission_mode"},
                                                {kUint32, "mission_id"},
                                                {kUint32, "fence_id"},
                                                {kUint32, "rally_points_id"}});

inline constexpr auto kMissionRequestList =
    define(43, "MISSION_REQUEST_LIST", 132, {{kUint8, "target_system"}, {kUint8, "target_component"}},
           {{kUint8, "mission_type"}});

inline constexpr auto kMissionCount = define(
    44, "MISSION_COUNT", 221, {{kUint8, "target_system"}, {kUint8, "target_component"}, {kUint16, "count"}},
    {{kUint8, "mission_type"}, {kUint32, "opaque_id"}});

inline constexpr auto kMissionClearAll =
    define(45, "MISSION_CLEAR_ALL", 232, {{kUint8, "target_system"}, {kUint8, "target_component"}},
           {{kUint8, "mission_type"}});

inline constexpr auto kMissionItemReached = define(46, "MISSION_ITEM_REACHED", 11, {{kUint16, "seq"}});

inline constexpr auto kMissionAck = define(
    47, "MISSION_ACK", 153, {{kUint8, "target_system"}, {kUint8, "target_component"}, {kUint8, "type"}},
    {{kUint8, "mission_type"}, {kUint32, "opaque_id"}});

inline constexpr auto kMissionRequestInt = define(
    51, "MISSION_REQUEST_INT", 196,
    {{kUint8, "target_system"}, {kUint8, "target_component"}, {kUint16, "seq"}}, {{kUint8, "mission_type"}});

inline constexpr auto kMissionItemInt = define(73, "MISSION_ITEM_INT", 38,
                                               {{kUint8, "target_system"},
                                                {kUint8, "target_component"},
                                                {kUint16, "seq"},
                                                {kUint8, "frame"},
                                                {kUint16, "command"},
                                                {kUint8, "current"},
                                                {kUint8, "autocontinue"},
                                                {kFloat, "param1"},
                                                {kFloat, "param2"},
                                                {kFloat, "param3"},
                                                {kFloat, "param4"},
                                                {kInt32, "x"},
                                                {kInt32, "y"},
                                                {kFloat, "z"}},
                                               {{kUint8, "mission_type"}});

inline constexpr auto kCommandInt = define(75, "COMMAND_INT", 158,
                                           {{kUint8, "target_system"},
                                            {kUint8, "target_component"},
                                            {kUint8, "frame"},
                                            {kUint16, "command"},
                                            {kUint8, "current"},
                                            {kUint8, "autocontinue"},
                                            {kFloat, "param1"},
                                            {kFloat, "param2"},
                                            {kFloat, "param3"},
                                            {kFloat, "param4"},
                                            {kInt32, "x"},
                                            {kInt32, "y"},
                                            {kFloat, "z"}});

inline constexpr auto kCommandLong = define(76, "COMMAND_LONG", 152,
                                            {{kUint8, "target_system"},
                                             {kUint8, "target_component"},
                                             {kUint16, "command"},
                                             {kUint8, "confirmation"},
                                             {kFloat, "param1"},
                                             {kFloat, "param2"},
                                             {kFloat, "param3"},
                                             {kFloat, "param4"},
                                             {kFloat, "param5"},
                                             {kFloat, "param6"},
                                             {kFloat, "param7"}});

inline constexpr auto kCommandAck = define(77, "COMMAND_ACK", 143, {{kUint16, "command"}, {kUint8, "result"}},
                                           {{kUint8, "progress"},
                                            {kInt32, "result_param2"},
                                            {kUint8, "target_system"},
                                            {kUint8, "target_component"}});

inline constexpr auto kRadioStatus = define(109, "RADIO_STATUS", 185,
                                            {{kUint8, "rssi"},
                                             {kUint8, "remrssi"},
                                             {kUint8, "txbuf"},
                                             {kUint8, "noise"},
                                             {kUint8, "remnoise"},
                                             {kUint16, "rxerrors"},
                                             {kUint16, "fixed"}});

inline constexpr auto kTimesync = define(111, "TIMESYNC", 34, {{kInt64, "tc1"}, {kInt64, "ts1"}},
                                         {{kUint8, "target_system"}, {kUint8, "target_component"}});

inline constexpr auto kEncapsulatedData =
    define(131, "ENCAPSULATED_DATA", 223, {{kUint16, "seqnr"}, {kUint8, "data", 253}});

inline constexpr auto kAutopilotVersion = define(148, "AUTOPILOT_VERSION", 178,
                                                 {{kUint64, "capabilities"},
                                                  {kUint32, "flight_sw_version"},
                                                  {kUint32, "middleware_sw_version"},
                                                  {kUint32, "os_sw_version"},
                                                  {kUint32, "board_version"},
                                                  {kUint8, "flight_custom_version", 8},
                                                  {kUint8, "middleware_custom_version", 8},
                                                  {kUint8, "os_custom_version", 8},
                                                  {kUint16, "vendor_id"},
                                                  {kUint16, "product_id"},
                                                  {kUint64, "uid"}},
                                                 {{kUint8, "uid2", 18}});

inline constexpr auto kMessageInterval =
    define(244, "MESSAGE_INTERVAL", 95, {{kUint16, "message_id"}, {kInt32, "interval_us"}});

inline constexpr auto kStatustext = define(253, "STATUSTEXT", 83, {{kUint8, "severity"}, {kChar, "text", 50}},
                                           {{kUint16, "id"}, {kUint8, "chunk_seq"}});

inline constexpr auto kSetupSigning = define(256, "SETUP_SIGNING", 71,
                                             {{kUint8, "target_system"},
                                              {kUint8, "target_component"},
                                              {kUint8, "secret_key", 32},
                                              {kUint64, "initial_timestamp"}});

inline constexpr auto kProtocolVersion = define(300, "PROTOCOL_VERSION", 217,
                                                {{kUint16, "version"},
                                                 {kUint16, "min_version"},
                                                 {kUint16, "max_version"},
                                                 {kUint8, "spec_version_hash", 8},
                                                 {kUint8, "library_version_hash", 8}});

}  // namespace roborun::firmware_if::mavlink
