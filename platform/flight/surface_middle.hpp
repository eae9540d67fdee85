/// Where a body is of which a part was seen.
#pragma once

#include <optional>
#include <span>

#include "core/geometry/vector.hpp"
#include "stages/perception/point_cloud.hpp"

namespace roborun::flight {

/// A body reaches so far around the middle of what is seen of it.
inline constexpr double kBodyReach_m = 0.9;

/// The middle of the surface around this place, if it stands apart from all others: walls, trunks and the ground go on around
/// it, and their middle is nowhere. RT-safe: O(points), no allocation.
[[nodiscard]] std::optional<Vector3> surface_middle_W(const Vector3& place_W,
                                                      std::span<const stages::CloudPoint> points) noexcept;

}  // namespace roborun::flight
