/// What differs between PX4 and ArduCopter for a companion computer that flies them. Sources: PX4 user guide ("Offboard
/// mode"), ArduPilot developer documentation ("Copter commands in Guided mode"), and measurements of ArduCopter 4.7-dev.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>

#include "firmware_if/autopilot.hpp"

namespace roborun::firmware_if::mavlink {

inline constexpr std::uint16_t kArmDisarm = 400;          ///< MAV_CMD_COMPONENT_ARM_DISARM.
inline constexpr std::uint16_t kFlightTermination = 185;  ///< MAV_CMD_DO_FLIGHTTERMINATION.

enum class AutopilotKind : std::uint8_t { kPx4, kArduCopter };

/// A parameter that is read before the take-off.
struct ParameterCheck {
  enum class Rule : std::uint8_t {
    kAtMost,   ///< The value may not be more than planned. Set if it is.
    kAtLeast,  ///< ... not less than planned. Set only if the owner of the vehicle agreed (may_tune).
    kRaised,   ///< Not less than planned, and set if it is: a limit that no flight of ours can live with.
    kExactly,  ///< Set if it differs.
  };
  const char* name;                ///< At most 16 characters.
  double scale;                    ///< Value times this is SI.
  double AutopilotLimits::*value;  ///< Null: `wanted` counts.
  Rule rule;
  double wanted{};
  bool is_integer{false};  ///< An INT32 of PX4, which travels with its bits in the float.
};

struct StreamRequest {
  std::uint32_t msgid;
  std::int32_t interval_us;
};

struct Dialect {
  std::uint8_t autopilot;     ///< MAV_AUTOPILOT of its heartbeat.
  std::uint32_t mode;         ///< custom_mode in which set-points count ...
  std::uint32_t mode_mask;    ///< ... in these bits.
  float mode_parameter;       ///< Of DO_SET_MODE.
  double lead_s;              ///< The link, and half a period for one that holds a set-point's position.
  bool takes_off_by_command;  ///< NAV_TAKEOFF; else set-points do it.
  AutopilotLimits planned;    ///< Of an autopilot whose time-out was set to half a second.
  std::span<const StreamRequest> streams;
  std::span<const ParameterCheck> parameters;
};

namespace detail {

using L = AutopilotLimits;
using Rule = ParameterCheck::Rule;

// SYS_STATUS, SYSTEM_TIME, EXTENDED_SYS_STATE; HEARTBEAT at 10 Hz, so that a change of the mode is seen at once; the origin.
inline constexpr std::array<StreamRequest, 6> kPx4Streams{
    {{331, 10'000}, {1, 500'000}, {2, 1'000'000}, {245, 200'000}, {0, 100'000}, {49, 1'000'000}}};
inline constexpr std::array<StreamRequest, 7> kArduCopterStreams{{{31, 10'000},
                                                                  {32, 10'000},
                                                                  {1, 500'000},
                                                                  {2, 1'000'000},
                                                                  {245, 200'000},
                                                                  {0, 100'000},
                                                                  {49, 1'000'000}}};

// COM_OBL_RC_ACT 5: Hold. The vehicle stops where it is, instead of flying home through what nobody has seen.
inline constexpr std::array<ParameterCheck, 7> kPx4Parameters{{
    {"COM_OF_LOSS_T", 1.0, &L::silence_s, Rule::kAtMost},
    {"COM_OBL_RC_ACT", 1.0, nullptr, Rule::kExactly, 5.0, true},
    {"MPC_ACC_HOR", 1.0, &L::stop_mps2, Rule::kAtLeast},
    {"MPC_JERK_AUTO", 1.0, &L::stop_jerk_mps3, Rule::kAtLeast},
    {"MPC_XY_VEL_MAX", 1.0, &L::speed_mps, Rule::kAtLeast},
    {"MPC_Z_VEL_MAX_UP", 1.0, &L::climb_mps, Rule::kAtLeast},
    {"MPC_Z_VEL_MAX_DN", 1.0, &L::descent_mps, Rule::kAtLeast},
}};
inline constexpr std::array<ParameterCheck, 7> kArduCopterParameters{{
    {"GUID_TIMEOUT", 1.0, &L::silence_s, Rule::kAtMost},
    {"WPNAV_ACCEL", 0.01, &L::stop_mps2, Rule::kAtLeast},
    {"WPNAV_ACCEL_Z", 0.01, &L::acceleration_mps2,
     Rule::kRaised},  // 1 m/s2 by default; plans know one acceleration for all directions
    {"PSC_JERK_XY", 1.0, &L::stop_jerk_mps3, Rule::kAtLeast},
    {"WPNAV_SPEED", 0.01, &L::speed_mps, Rule::kAtLeast},
    {"WPNAV_SPEED_UP", 0.01, &L::climb_mps, Rule::kAtLeast},
    {"WPNAV_SPEED_DN", 0.01, &L::descent_mps, Rule::kAtLeast},
}};

// Offboard set-points go to its controller as they are.
inline constexpr double kUnlimited = std::numeric_limits<double>::infinity();
inline constexpr Dialect kPx4{
    .autopilot = 12,
    .mode = 6U << 16U,
    .mode_mask = 0x00ff'0000U,
    .mode_parameter = 6.0F,
    .lead_s = 0.015,
    .takes_off_by_command = false,
    .planned = {0.5, 0.15, 3.0, 4.0, kUnlimited, kUnlimited, 12.0, 3.0, 1.5},
    .streams = kPx4Streams,
    .parameters = kPx4Parameters,
};
// The delay: 0.38 s of the stop measured from 9 m/s, of which the jerk limit makes 2.5 / (2 x 5) s.
inline constexpr Dialect kArduCopter{
    .autopilot = 3,
    .mode = 4,
    .mode_mask = 0xffff'ffffU,
    .mode_parameter = 4.0F,
    .lead_s = 0.005,
    .takes_off_by_command = true,
    .planned = {0.5, 0.13, 2.5, 5.0, 2.5, 5.0, 10.0, 2.5, 1.5},
    .streams = kArduCopterStreams,
    .parameters = kArduCopterParameters,
};

}  // namespace detail

[[nodiscard]] constexpr const Dialect& dialect_of(AutopilotKind kind) noexcept {
  return kind == AutopilotKind::kPx4 ? detail::kPx4 : detail::kArduCopter;
}

}  // namespace roborun::firmware_if::mavlink
