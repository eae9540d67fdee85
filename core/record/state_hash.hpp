/// A running 64-bit hash of everything that must repeat: equal hashes, equal runs.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "core/geometry/vector.hpp"
#include "core/random/counter_rng.hpp"

namespace roborun::core {

/// Order matters. Every NaN counts as the same, and -0 as 0, because machines differ there. RT-safe: O(1) an
/// item.
class StateHash {
 public:
  void add(std::uint64_t value) noexcept { state_ = mix64(state_ ^ value) + 0x9E3779B97F4A7C15ULL; }
  void add(double value) noexcept {
    if (std::isnan(value)) {
      add(std::uint64_t{0x7FF8000000000000ULL});
    } else {
      add(std::bit_cast<std::uint64_t>(value + 0.0));
    }
  }
  void add(const Vector3& value) noexcept {
    for (int i = 0; i < 3; ++i) add(value[i]);
  }
  [[nodiscard]] std::uint64_t value() const noexcept { return state_; }

 private:
  std::uint64_t state_{0};
};

}  // namespace roborun::core
