/// The picture of the map benchmark: what a scan costs.
#pragma once

#include <string>
#include <vector>

namespace roborun::bench {

struct CostAtPrecision {
  int range_m{};
  double p0_m{}, own_ms{}, stock_ms{};  ///< stock: its best combination.
};
/// One scan at 0.3 m of growing range.
struct CostOfSpace {
  double range_m{}, own_ms{}, known_m3{}, surface_cells{};
};

/// Left: time against precision, own and stock. Right: own time against known volume and against surface, each
/// relative to the shortest range. All axes logarithmic.
[[nodiscard]] std::string map_cost_svg(const std::vector<CostAtPrecision>& precision,
                                       const std::vector<CostOfSpace>& space);

}  // namespace roborun::bench
