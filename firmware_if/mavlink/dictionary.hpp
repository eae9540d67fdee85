/// Every MAVLink message that roborun knows, in the order of the ids.
#pragma once

#include <algorithm>
#include <array>

#include "firmware_if/mavlink/sensor_messages.hpp"
#include "firmware_if/mavlink/session_messages.hpp"
#include "firmware_if/mavlink/state_messages.hpp"

namespace roborun::firmware_if::mavlink {

inline constexpr std::array<MessageType, 63> kAllMessages{{kHeartbeat,
                                                           kSysStatus,
                                                           kSystemTime,
                                                           kPing,
                                                           kSetMode,
                                                           kParamRequestRead,
                                                           kParamRequestList,
                                                           kParamValue,
                                                           kParamSet,
                                                           kGpsRawInt,
                                                           kScaledPressure,
                                                           kAttitude,
                                                           kAttitudeQuaternion,
                                                           kLocalPositionNed,
                                                           kGlobalPositionInt,
                                                           kMissionRequest,
                                                           kMissionSetCurrent,
                                                           kMissionCurrent,
                                                           kMissionRequestList,
                                                           kMissionCount,
                                                           kMissionClearAll,
                                                           kMissionItemReached,
                                                           kMissionAck,
                                                           kSetGpsGlobalOrigin,
                                                           kGpsGlobalOrigin,
                                                           kMissionRequestInt,
                                                           kRcChannels,
                                                           kMissionItemInt,
                                                           kVfrHud,
                                                           kCommandInt,
                                                           kCommandLong,
                                                           kCommandAck,
                                                           kSetAttitudeTarget,
                                                           kAttitudeTarget,
                                                           kSetPositionTargetLocalNed,
                                                           kPositionTargetLocalNed,
                                                           kSetPositionTargetGlobalInt,
                                                           kPositionTargetGlobalInt,
                                                           kHilActuatorControls,
                                                           kVisionPositionEstimate,
                                                           kHighresImu,
                                                           kHilSensor,
                                                           kRadioStatus,
                                                           kTimesync,
                                                           kHilGps,
                                                           kHilStateQuaternion,
                                                           kEncapsulatedData,
                                                           kDistanceSensor,
                                                           kBatteryStatus,
                                                           kAutopilotVersion,
                                                           kFenceStatus,
                                                           kEstimatorStatus,
                                                           kVibration,
                                                           kHomePosition,
                                                           kMessageInterval,
                                                           kExtendedSysState,
                                                           kStatustext,
                                                           kSetupSigning,
                                                           kProtocolVersion,
                                                           kObstacleDistance,
                                                           kOdometry,
                                                           kTrajectoryRepresentationWaypoints,
                                                           kObstacleDistance3d}};

static_assert(std::is_sorted(kAllMessages.begin(), kAllMessages.end(),
                             [](const MessageType& a, const MessageType& b) { return a.id < b.id; }));

/// nullptr: unknown. RT-safe: O(log messages).
[[nodiscard]] constexpr const MessageType* find_message(std::uint32_t id) noexcept {
  const auto* at =
      std::lower_bound(kAllMessages.begin(), kAllMessages.end(), id,
                       [](const MessageType& type, std::uint32_t wanted) { return type.id < wanted; });
  return at != kAllMessages.end() && at->id == id ? at : nullptr;
}
/// nullptr: unknown. O(messages).
[[nodiscard]] constexpr const MessageType* find_message(std::string_view name) noexcept {
  for (const MessageType& type : kAllMessages) {
    if (type.name == name) return &type;
  }
  return nullptr;
}

}  // namespace roborun::firmware_if::mavlink
