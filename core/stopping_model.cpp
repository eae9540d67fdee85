#include "core/stopping_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace roborun {

double StoppingModel::distance_m(double speed_mps) const noexcept {
  if (std::isnan(speed_mps)) return std::numeric_limits<double>::infinity();
  const double v = std::max(speed_mps, 0.0);
  return std::max((quadratic_s2pm * v + linear_s) * v + constant_m, 0.0);
}

}  // namespace roborun
