/// The earth's magnetic field: what a compass should measure, and a simulated one does.
#pragma once

#include "core/geometry/vector.hpp"

namespace roborun::live {

/// East, north, up in gauss at sea level, in 2020. Spherical harmonics to degree 4: within 3 degrees and 3 % of the whole model
/// where most people live. Source: IGRF-13 (Alken et al., 2021); Schmidt's semi-normalised functions.
[[nodiscard]] Vector3 earth_field_gauss(double latitude_deg, double longitude_deg);

}  // namespace roborun::live
