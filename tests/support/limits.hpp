// What no measurement is, and what is farther than any.
#pragma once

#include <limits>

namespace roborun::test {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
inline constexpr float kNanF = std::numeric_limits<float>::quiet_NaN();

}  // namespace roborun::test
