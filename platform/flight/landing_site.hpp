/// Where to come down: the nearest place below which everything is known to be free.
#pragma once

#include <cstdint>
#include <optional>

#include "core/geometry/fence.hpp"
#include "stages/perception/map_view.hpp"

namespace roborun::flight {

/// Down to this height above the ground the column is checked: below it, cells of 0.6 m touch the ground
/// itself.
inline constexpr double kCheckedAbove_m = 1.2;

/// The point nearest to p_W, at its height and at most 9 m away, from which a vehicle of this radius can come
/// straight down to kCheckedAbove_m over the ground through known free space, inside the fence; none:
/// nothing. RT-safe: at most 73 boxes.
[[nodiscard]] std::optional<Vector3> landing_site_W(const stages::MapView& view, const core::Fence& fence,
                                                    const Vector3& p_W, double ground_m,
                                                    double radius_m) noexcept;

}  // namespace roborun::flight
