/// Ranges of config fields, as their comments write them. NaN lies in none.
#pragma once

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

}  // namespace roborun::core
