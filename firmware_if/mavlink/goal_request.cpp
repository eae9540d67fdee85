#include "firmware_if/mavlink/goal_request.hpp"

#include <cmath>

#include "firmware_if/mavlink/flight_messages.hpp"
#include "firmware_if/mavlink/ned.hpp"

namespace roborun::firmware_if::mavlink {
namespace {

constexpr std::uint8_t kNedFrame = 1;      // MAV_FRAME_LOCAL_NED
constexpr std::uint16_t kNoPosition = 7;   // bits of a type_mask that ignore one of x, y, z
constexpr std::uint16_t kNoVelocity = 56;  // ... of vx, vy, vz
constexpr std::uint16_t kNoAcceleration = 448;
constexpr double kDegrees = 1e-7;
constexpr double kTenthOfMillimetre = 1e-4;

void refuse_goal(GoalRequest& request, CommandResult result, const char* wrong) noexcept {
  request.result = result;
  request.wrong = wrong;
}

/// `x`, `y`, `z` as MAVLink means them in `frame`, in degrees or metres.
void take_place(GoalRequest& request, std::uint8_t frame, double x, double y, double z) noexcept {
  constexpr std::uint8_t kGlobal = 0, kOverHome = 3, kGlobalInt = 5, kOverHomeInt = 6;
  if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z))
    return refuse_goal(request, CommandResult::kDenied, "its place is not finite");
  request.place = {x, y, z};
  if (frame == kNedFrame) {
    request.place = swap_world(request.place);
    return;
  }
  const bool over_home = frame == kOverHome || frame == kOverHomeInt;
  if (!over_home && frame != kGlobal && frame != kGlobalInt)
    return refuse_goal(request, CommandResult::kDenied, "its frame must be 0, 1, 3, 5 or 6");
  request.kind = over_home ? GoalRequest::Kind::kOverTakeOff : GoalRequest::Kind::kOverSea;
  if (std::fabs(x) > 90.0 || std::fabs(y) > 180.0)
    refuse_goal(request, CommandResult::kDenied, "its place is not on the earth");
}

void take_command(GoalRequest& request, const CommandInt& m) noexcept {
  const double scale = m.frame == kNedFrame ? kTenthOfMillimetre : kDegrees;
  take_place(request, m.frame, scale * m.x, scale * m.y, static_cast<double>(m.z));
  if (m.param1 > 0.0F) refuse_goal(request, CommandResult::kDenied, "a speed cannot be given with it");
}

/// A position alone; a velocity or an acceleration with it would be obeyed by nobody.
void check_mask(GoalRequest& request, std::uint16_t mask) noexcept {
  if ((mask & kNoPosition) != 0 || (mask & kNoVelocity) != kNoVelocity ||
      (mask & kNoAcceleration) != kNoAcceleration)
    refuse_goal(request, CommandResult::kDenied, "it must be a position alone");
}

}  // namespace

std::optional<GoalRequest> goal_request(const Frame& frame, std::uint8_t sysid,
                                        std::uint8_t compid) noexcept {
  GoalRequest request;
  request.sysid = frame.header.sysid;
  request.compid = frame.header.compid;
  const auto is_ours = [sysid, compid](const auto& m) {
    return m.target_system == sysid && (m.target_component == compid || m.target_component == 0);
  };
  if (frame.msgid == kCommandInt.id) {
    const auto m = unpack<CommandInt>(frame.payload);
    if (!is_ours(m) || m.command != kDoReposition) return std::nullopt;
    request.is_command = true;
    take_command(request, m);
    return request;
  }
  if (frame.msgid == kCommandLong.id) {
    const auto m = unpack<CommandLong>(frame.payload);
    if (!is_ours(m) || m.command != kDoReposition) return std::nullopt;
    request.is_command = true;
    refuse_goal(request, CommandResult::kIntOnly,
                "it must be a COMMAND_INT: a float is a place within metres");
    return request;
  }
  if (frame.msgid == kSetPositionTargetLocalNed.id) {
    const auto m = unpack<SetPositionTargetLocalNed>(frame.payload);
    if (!is_ours(m)) return std::nullopt;
    const auto p = wide(m.x, m.y, m.z);
    take_place(request, m.coordinate_frame, p[0], p[1], p[2]);
    if (m.coordinate_frame != kNedFrame) refuse_goal(request, CommandResult::kDenied, "its frame must be 1");
    check_mask(request, m.type_mask);
    return request;
  }
  if (frame.msgid == kSetPositionTargetGlobalInt.id) {
    const auto m = unpack<SetPositionTargetGlobalInt>(frame.payload);
    if (!is_ours(m)) return std::nullopt;
    take_place(request, m.coordinate_frame, kDegrees * m.lat_int, kDegrees * m.lon_int,
               static_cast<double>(m.alt));
    if (request.kind == GoalRequest::Kind::kWorld)
      refuse_goal(request, CommandResult::kDenied, "its frame must be 0, 3, 5 or 6");
    check_mask(request, m.type_mask);
    return request;
  }
  return std::nullopt;
}

}  // namespace roborun::firmware_if::mavlink
