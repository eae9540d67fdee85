#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "firmware_if/mavlink/ned.hpp"
#include "platform/sitl/autopilot/fake_autopilot.hpp"

namespace roborun::sitl {
namespace {

using namespace firmware_if::mavlink;  // NOLINT(google-build-using-namespace): messages by the dozen

std::array<double, 3> array_of(const Vector3& v) noexcept { return {v.x(), v.y(), v.z()}; }
float narrow(double x) noexcept { return static_cast<float>(x); }

}  // namespace

void FakeAutopilot::say(std::string_view text) noexcept {
  Statustext line;
  line.severity = 4;
  std::copy_n(text.begin(), std::min(text.size(), line.text.size()), line.text.begin());
  send(line);
}

std::uint32_t FakeAutopilot::custom_mode() const noexcept {
  constexpr std::array<std::uint32_t, 5> kPx4Modes{3U << 16U, 6U << 16U, 4U << 16U | 3U << 24U,
                                                   4U << 16U | 5U << 24U, 4U << 16U | 6U << 24U};
  constexpr std::array<std::uint32_t, 5> kArduCopterModes{0, 4, 17, 6, 9};
  return (is_px4() ? kPx4Modes : kArduCopterModes).at(static_cast<std::size_t>(mode_));
}

void FakeAutopilot::send_heartbeat() noexcept {
  Heartbeat beat;
  beat.type = 2;  // quadrotor
  beat.autopilot = dialect_of(kind_).autopilot;
  beat.base_mode = static_cast<std::uint8_t>(1U | (armed_ ? 128U : 0U));
  beat.custom_mode = custom_mode();
  beat.system_status = armed_ ? 4 : 3;
  send(beat);
}

void FakeAutopilot::send_odometry(MonotonicTime now) noexcept {
  if (!has_state_) return;
  Odometry m;
  m.time_usec = static_cast<std::uint64_t>(boot_ns(now - late) / 1000);
  m.frame_id = 1;
  m.child_frame_id = 12;
  const auto p = swap_world(array_of(state_.p_WB - origin_W_));
  const auto v = swap_body(array_of(state_.q_WB.conjugate() * state_.v_WB));
  const auto w = swap_body(array_of(state_.w_WB_B));
  const auto q = swap_attitude({state_.q_WB.w(), state_.q_WB.x(), state_.q_WB.y(), state_.q_WB.z()});
  m.x = narrow(p[0]), m.y = narrow(p[1]), m.z = narrow(p[2]);
  m.vx = narrow(v[0]), m.vy = narrow(v[1]), m.vz = narrow(v[2]);
  m.rollspeed = narrow(w[0]), m.pitchspeed = narrow(w[1]), m.yawspeed = narrow(w[2]);
  for (std::size_t i = 0; i < 4; ++i) m.q.at(i) = narrow(q.at(i));
  m.pose_covariance[0] = m.velocity_covariance[0] = std::numeric_limits<float>::quiet_NaN();
  m.quality = 100;
  m.reset_counter = resets_;
  send(m);
}

void FakeAutopilot::send_position(MonotonicTime now) noexcept {
  if (!has_state_) return;
  const auto p = swap_world(array_of(state_.p_WB - origin_W_));
  const auto v = swap_world(array_of(state_.v_WB));
  send(LocalPositionNed{static_cast<std::uint32_t>(boot_ns(now - late) / 1'000'000), narrow(p[0]),
                        narrow(p[1]), narrow(p[2]), narrow(v[0]), narrow(v[1]), narrow(v[2])});
}

void FakeAutopilot::send_attitude(MonotonicTime now) noexcept {
  if (!has_state_) return;
  const auto w = swap_body(array_of(state_.w_WB_B));
  const auto q = swap_attitude({state_.q_WB.w(), state_.q_WB.x(), state_.q_WB.y(), state_.q_WB.z()});
  send(AttitudeQuaternion{static_cast<std::uint32_t>(boot_ns(now - late) / 1'000'000),
                          narrow(q[0]),
                          narrow(q[1]),
                          narrow(q[2]),
                          narrow(q[3]),
                          narrow(w[0]),
                          narrow(w[1]),
                          narrow(w[2]),
                          {}});
}

void FakeAutopilot::send_stream(MonotonicTime now, std::uint32_t msgid, double battery_ratio) noexcept {
  switch (msgid) {
    case 0:
      return send_heartbeat();
    case 1:
      // -1: unknown; false for NaN.
      return send(SysStatus{battery_ratio >= 0.0
                                ? static_cast<std::int8_t>(100.0 * std::min(battery_ratio, 1.0))
                                : std::int8_t{-1}});
    case 2:
      return send(SystemTime{0, static_cast<std::uint32_t>(boot_ns(now - late) / 1'000'000)});
    case 31:
      return send_attitude(now);
    case 32:
      return send_position(now);
    case 245:
      if (is_mute_of_landing) return;
      return send(ExtendedSysState{0, landed_state.value_or(static_cast<std::uint8_t>(on_ground_ ? 1 : 2))});
    case 331:
      return send_odometry(now);
    default:
      return send(origin);
  }
}

void FakeAutopilot::send_parameter(const Parameter& p) noexcept {
  ParamValue m;
  const std::string_view name(p.name);
  std::copy_n(name.begin(), std::min(name.size(), m.param_id.size()), m.param_id.begin());
  const bool bits = is_px4() && p.is_integer;
  m.param_value = bits ? std::bit_cast<float>(static_cast<std::int32_t>(p.value)) : narrow(p.value);
  m.param_type = bits ? 6 : 9;
  m.param_count = static_cast<std::uint16_t>(parameters_.size());
  send(m);
}

}  // namespace roborun::sitl
