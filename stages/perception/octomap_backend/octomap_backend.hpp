/// The baseline map: stock OctoMap with the stock insertion, behind the interface of the own map.
/// Allocates: it lives outside the flight loop, in a target of its own.
#pragma once

#include <memory>

#include "core/geometry/vector.hpp"
#include "core/precision.hpp"
#include "core/range.hpp"
#include "core/vehicle_model.hpp"
#include "stages/perception/occupancy_map.hpp"

namespace roborun::stages {

struct OctomapConfig {
  Aabb bounds_W{};                                   ///< Space outside is never stored: unknown.
  double vehicle_radius_m{VehicleModel{}.radius_m};  ///< Where the vehicle is, nothing else is.
  PrecisionLattice lattice{};
  double view_reach_m{30.0};  ///< Half the side of the exported window. (0, 1000]
  [[nodiscard]] Status validate() const noexcept {
    const bool ok = is_finite(bounds_W.min_W) && is_finite(bounds_W.max_W) &&
                    bounds_W.size().minCoeff() > 0.0 && core::above(view_reach_m, 0.0, 1000.0);
    return ok ? Status::kOk : Status::kInvalidArgument;
  }
};

/// One stock octomap::OcTree for each precision; a scan at p0 goes into the tree of that resolution by
/// insertPointCloud() of the p0-grid-averaged cloud (pixels without a return clear up to the range). A place
/// is what the finest tree that knows it says. The export copies the window around the vehicle into cells of
/// p1, as stock users do. nullptr if memory is short. The library's exceptions end here.
/// Precondition, asserted: config.validate() is kOk.
[[nodiscard]] std::unique_ptr<OccupancyMap> make_octomap_backend(const OctomapConfig& config) noexcept;

}  // namespace roborun::stages
