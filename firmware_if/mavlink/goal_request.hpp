/// A goal as a ground station asks a companion computer for it: MAV_CMD_DO_REPOSITION, or a position as a set-point.
/// Source: MAVLink common messages. It asks; whoever owns the flight decides.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <tuple>

#include "firmware_if/mavlink/dictionary.hpp"
#include "firmware_if/mavlink/frame.hpp"
#include "firmware_if/mavlink/typed.hpp"

namespace roborun::firmware_if::mavlink {

inline constexpr std::uint16_t kDoReposition = 192;  ///< MAV_CMD.
/// MAV_RESULT, in answers.
enum class CommandResult : std::uint8_t {
  kAccepted = 0,
  kNotNow = 1,
  kDenied = 2,
  kUnsupported = 3,
  kIntOnly = 8
};

struct GoalRequest {
  enum class Kind : std::uint8_t {
    kWorld,        ///< place: m, ENU, from the origin of the autopilot's local frame.
    kOverSea,      ///< place: degrees north, degrees east, m above mean sea level.
    kOverTakeOff,  ///< The same, m over the place of the take-off.
  };
  Kind kind{Kind::kWorld};
  std::array<double, 3> place{};                   ///< Finite.
  std::uint8_t sysid{}, compid{};                  ///< Who asks.
  bool is_command{};                               ///< It wants a COMMAND_ACK.
  CommandResult result{CommandResult::kAccepted};  ///< Not kAccepted: it cannot be obeyed ...
  const char* wrong{""};                           ///< ... because of this.
};

/// None: no such message, or not for (sysid, compid): the component 0 means all. RT-safe: O(1).
[[nodiscard]] std::optional<GoalRequest> goal_request(const Frame& frame, std::uint8_t sysid,
                                                      std::uint8_t compid) noexcept;

/// A COMMAND_INT with the place of a request: x and y are scaled integers.
struct CommandInt {
  static constexpr MessageType kType = kCommandInt;
  std::uint8_t target_system{};
  std::uint8_t target_component{};
  std::uint8_t frame{};  ///< MAV_FRAME; 1: x, y in 1e-4 m NED; else 1e-7 degrees.
  std::uint16_t command{};
  float param1{};  ///< Of DO_REPOSITION: ground speed m/s; -1, 0, NaN: none.
  float param2{};
  float param3{};
  float param4{};
  std::int32_t x{};
  std::int32_t y{};
  float z{};
  static constexpr std::tuple kMembers{Member<&CommandInt::target_system>{"target_system"},
                                       Member<&CommandInt::target_component>{"target_component"},
                                       Member<&CommandInt::frame>{"frame"},
                                       Member<&CommandInt::command>{"command"},
                                       Member<&CommandInt::param1>{"param1"},
                                       Member<&CommandInt::param2>{"param2"},
                                       Member<&CommandInt::param3>{"param3"},
                                       Member<&CommandInt::param4>{"param4"},
                                       Member<&CommandInt::x>{"x"},
                                       Member<&CommandInt::y>{"y"},
                                       Member<&CommandInt::z>{"z"}};
};

/// The same as a set-point on the earth: 1e-7 degrees, m.
struct SetPositionTargetGlobalInt {
  static constexpr MessageType kType = kSetPositionTargetGlobalInt;
  std::uint8_t target_system{};
  std::uint8_t target_component{};
  std::uint8_t coordinate_frame{};
  std::uint16_t type_mask{};
  std::int32_t lat_int{};
  std::int32_t lon_int{};
  float alt{};
  static constexpr std::tuple kMembers{
      Member<&SetPositionTargetGlobalInt::target_system>{"target_system"},
      Member<&SetPositionTargetGlobalInt::target_component>{"target_component"},
      Member<&SetPositionTargetGlobalInt::coordinate_frame>{"coordinate_frame"},
      Member<&SetPositionTargetGlobalInt::type_mask>{"type_mask"},
      Member<&SetPositionTargetGlobalInt::lat_int>{"lat_int"},
      Member<&SetPositionTargetGlobalInt::lon_int>{"lon_int"},
      Member<&SetPositionTargetGlobalInt::alt>{"alt"}};
};

}  // namespace roborun::firmware_if::mavlink
