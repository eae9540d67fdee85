/// Whether a ball, the vehicle with its room, can be moved straight through known free space.
#pragma once

#include "stages/perception/map_view.hpp"

namespace roborun::stages {

/// True if every cell of the view that comes nearer than `radius_m` to the straight piece from a to b is known to be free. Where the
/// box around it is free that is one question; otherwise the box is halved until what is not free is beside the ball, or
/// is a cell that it meets. So long as the piece is not much longer than the radius: kMostBoxes are asked for, and then it
/// is not free. False for what is not finite. RT-safe.
[[nodiscard]] bool is_swept_free(const MapView& view, const Vector3& a_W, const Vector3& b_W, double radius_m,
                                 std::uint64_t& lookups) noexcept;
inline constexpr int kMostBoxes = 512;

/// The same of a place.
[[nodiscard]] inline bool is_ball_free(const MapView& view, const Vector3& p_W, double radius_m,
                                       std::uint64_t& lookups) noexcept {
  return is_swept_free(view, p_W, p_W, radius_m, lookups);
}

}  // namespace roborun::stages
