/// NED and FRD, which MAVLink speaks, to ENU and FLU and back. Source: REP 103; MAVLink common, MAV_FRAME.
#pragma once

#include <array>
#include <numbers>

namespace roborun::firmware_if::mavlink {

/// A message's numbers, as we calculate with them.
[[nodiscard]] constexpr std::array<double, 3> wide(float x, float y, float z) noexcept {
  return {static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
}
/// (north, east, down) and (east, north, up): the same swap in both directions. RT-safe: O(1).
[[nodiscard]] constexpr std::array<double, 3> swap_world(const std::array<double, 3>& v) noexcept {
  return {v[1], v[0], -v[2]};
}
/// (forward, right, down) and (forward, left, up), likewise.
[[nodiscard]] constexpr std::array<double, 3> swap_body(const std::array<double, 3>& v) noexcept {
  return {v[0], -v[1], -v[2]};
}
/// w, x, y, z. a then b, from right to left.
[[nodiscard]] constexpr std::array<double, 4> times(const std::array<double, 4>& a,
                                                    const std::array<double, 4>& b) noexcept {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
          a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
          a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}
/// Attitude of FRD in NED to FLU in ENU and back: half a turn about the middle of north and east, and about forward.
[[nodiscard]] constexpr std::array<double, 4> swap_attitude(const std::array<double, 4>& q) noexcept {
  constexpr double kHalf = 0.5 * std::numbers::sqrt2;
  return times(times({0.0, kHalf, kHalf, 0.0}, q), {0.0, 1.0, 0.0, 0.0});
}
/// From north, clockwise, and from east, counter-clockwise: the same in both directions, in (-pi, pi] for such.
[[nodiscard]] constexpr double swap_yaw(double yaw_rad) noexcept {
  const double other = 0.5 * std::numbers::pi - yaw_rad;
  return other > std::numbers::pi ? other - 2.0 * std::numbers::pi : other;
}
/// A vector of the body in the frame that q turns it into.
[[nodiscard]] constexpr std::array<double, 3> turned(const std::array<double, 4>& q,
                                                     const std::array<double, 3>& v) noexcept {
  const auto r = times(times(q, {0.0, v[0], v[1], v[2]}), {q[0], -q[1], -q[2], -q[3]});
  return {r[1], r[2], r[3]};
}

}  // namespace roborun::firmware_if::mavlink
