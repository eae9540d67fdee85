/// A map as the leaves of an OctoMap file.
#pragma once

#include "platform/sitl/world/octomap_file.hpp"
#include "stages/perception/map_view.hpp"

namespace roborun::dataset {

/// All that is known within a box, at the finest, pruned. Cells keep their places: both count from the world's origin. Throws
/// InputError if the box is larger than the 65,536 cells that such a file has on an axis.
[[nodiscard]] sitl::OctomapLeaves leaves_of(const stages::MapView& view, const Aabb& box_W);

}  // namespace roborun::dataset
