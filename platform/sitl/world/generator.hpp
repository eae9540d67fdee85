/// Worlds from the knobs of the paper's environment generator. Source: RoboRun, appendix "Environment
/// Generation".
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "platform/sitl/world/world.hpp"

namespace roborun::sitl {

enum class Distribution : std::uint8_t {
  kGaussian,  ///< density * exp(-r^2 / (2 (0.4 spread)^2)), fitted on the published obstacle lists.
  kUniform,   ///< density everywhere within the spread.
};

/// Package delivery flies between two warehouses, both ends equally congested. Search and rescue starts at a
/// hospital (half the density) and ends in a disaster zone, where free cells hold low rubble with the
/// probability of a pillar.
enum class Mission : std::uint8_t { kPackageDelivery, kSearchAndRescue };

/// "package_delivery" or "search_and_rescue". Throws InputError for anything else.
[[nodiscard]] Mission mission_of(const std::string& name);

struct EnvironmentKnobs {
  double density_ratio{0.45};         ///< [0, 1]. Probability of an obstacle at a centroid.
  double spread_m{80.0};              ///< (0, 1000]. Radius around a centroid within which obstacles stand.
  double centroid_distance_m{900.0};  ///< (0, 10000]. Between the two landing positions: the goal distance.
  double grid_m{10.0};                ///< [2, 100]. Side of a cell; at most one obstacle each.
  double gap_m{6.0};  ///< (0, grid). Free space between two obstacles; pillar diameter = grid - gap.
  Distribution distribution{Distribution::kGaussian};
  /// Clusters besides the two at start and goal: positions along the way as a ratio of the distance, 0 .. 1.
  std::vector<double> extra_centroids_ratio{};
};

/// Start at (0, 0), goal at (centroid_distance, 0), both at 5 m; the vehicle may fly at 1.5 to 10 m, the
/// pillars reach 20 m. The cells of start and goal stay free. The same knobs, mission and seed give the same
/// world on every machine. Throws InputError for a knob out of range.
[[nodiscard]] World generate(const EnvironmentKnobs& knobs, Mission mission, std::uint64_t seed);

/// The 27 environments of the paper: density {0.3, 0.45, 0.6} slowest, then spread {40, 80, 120} m, distance
/// {600, 900, 1200} m fastest; 14 is the middle. By number "1" .. "27", or by name such as
/// "density0.45-spread80-distance900". Throws InputError for anything else.
struct NamedEnvironment {
  int number{};
  std::string name;
  EnvironmentKnobs knobs;
};
[[nodiscard]] NamedEnvironment environment(std::string_view name_or_number);

}  // namespace roborun::sitl
