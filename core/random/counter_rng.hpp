/// Random numbers as a pure function of (seed, stream, counter): the same on every machine, and any draw can
/// be had without the ones before it.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/geometry/math.hpp"

namespace roborun::core {

/// A bijective mix of 64 bits (the finaliser of SplitMix64, Steele et al. 2014). RT-safe: O(1).
[[nodiscard]] constexpr std::uint64_t mix64(std::uint64_t x) noexcept {
  x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27U)) * 0x94D049BB133111EBULL;
  return x ^ (x >> 31U);
}

/// The upper half of the 128-bit product, from four products of 32 bits: not every machine has the type.
/// RT-safe: O(1).
[[nodiscard]] constexpr std::uint64_t multiply_high(std::uint64_t a, std::uint64_t b) noexcept {
  constexpr std::uint64_t kLow = 0xFFFFFFFFULL;
  // None of these sums can overflow: (2^32 - 1)^2 + 2 (2^32 - 1) = 2^64 - 1.
  const std::uint64_t middle = (a >> 32U) * (b & kLow) + ((a & kLow) * (b & kLow) >> 32U);
  const std::uint64_t other = (a & kLow) * (b >> 32U) + (middle & kLow);
  return (a >> 32U) * (b >> 32U) + (middle >> 32U) + (other >> 32U);
}

/// SplitMix64 with a key of its own for each (seed, stream). Copying copies the position. RT-safe: O(1) a
/// draw.
class CounterRng {
 public:
  explicit CounterRng(std::uint64_t seed, std::uint64_t stream = 0) noexcept
      : key_(mix64(mix64(seed + kGolden) ^ (stream * 0xD1342543DE82EF95ULL + 1U))) {}

  std::uint64_t next() noexcept { return mix64(key_ + kGolden * ++counter_); }
  /// In [0, 1), multiples of 2^-53.
  double uniform() noexcept { return static_cast<double>(next() >> 11U) * 0x1.0p-53; }
  double uniform(double low, double high) noexcept { return low + (high - low) * uniform(); }
  /// In [0, count); 0 for count 0. Bias below count / 2^64.
  std::uint64_t below(std::uint64_t count) noexcept { return multiply_high(next(), count); }
  /// Standard normal by Box and Muller; two draws each, so that the position never depends on earlier calls.
  double normal() noexcept {
    const double radius = std::sqrt(-2.0 * core::log(1.0 - uniform()));
    return radius * core::cos(2.0 * kPi * uniform());
  }
  /// Jumps to the n-th draw.
  void seek(std::uint64_t counter) noexcept { counter_ = counter; }

 private:
  static constexpr std::uint64_t kGolden = 0x9E3779B97F4A7C15ULL;
  std::uint64_t key_;
  std::uint64_t counter_{0};
};

}  // namespace roborun::core
