/// Ranges of config fields, as their comments write them. NaN lies in none.
#pragma once

#include <limits>

namespace roborun::core {

/// x in [low, high].
template <typename T>
[[nodiscard]] constexpr bool within(T x, T low, T high) noexcept {
  return x >= low && x <= high;
}

/// x in (low, high].
template <typename T>
[[nodiscard]] constexpr bool above(T x, T low, T high) noexcept {
  return x > low && x <= high;
}

/// A standard deviation that something can be weighed with: positive and finite.
[[nodiscard]] constexpr bool is_sigma(double x) noexcept {
  return above(x, 0.0, std::numeric_limits<double>::max());
}

}  // namespace roborun::core
