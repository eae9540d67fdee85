/// Properties that belong to places: random numbers for the cells of a lattice in the world.
#pragma once

#include <bit>
#include <cstdint>

#include "core/geometry/vector.hpp"
#include "core/random/counter_rng.hpp"

namespace roborun::sitl {

/// A lattice that is turned against the world's axes, so that no wall lies along its cells. Pure functions of (seed, place).
class SurfaceLattice {
 public:
  explicit SurfaceLattice(std::uint64_t seed) noexcept : key_(core::mix64(seed ^ 0x5EA5C0DEULL)) {}

  /// The turned frame: cells are [i, i + 1) cell_m of each axis in it.
  [[nodiscard]] static Matrix3 turn() noexcept {
    return Quaternion(0.7, 0.1, 0.5, 0.5).toRotationMatrix();  // of length 1
  }
  /// The largest power of two that is not more than x; x > 0. No libm.
  [[nodiscard]] static double power_of_two(double x) noexcept {
    return std::bit_cast<double>(std::bit_cast<std::uint64_t>(x) & 0x7FF0000000000000ULL);
  }
  /// 64 random bits of the cell of a place in the turned frame; cells of another size are others.
  [[nodiscard]] std::uint64_t bits(const Vector3& p_T, double cell_m) const noexcept {
    const double inverse = 1.0 / cell_m;
    return core::mix64(
        key_ + std::bit_cast<std::uint64_t>(cell_m) + index(p_T.x() * inverse) * 0x9E3779B97F4A7C15ULL +
        index(p_T.y() * inverse) * 0xC2B2AE3D27D4EB4FULL + index(p_T.z() * inverse) * 0x165667B19E3779F9ULL);
  }
  /// In [0, 1).
  [[nodiscard]] static double uniform(std::uint64_t bits) noexcept {
    return static_cast<double>(bits >> 40U) * 0x1.0p-24;
  }

 private:
  /// Of what is above -2^40.
  [[nodiscard]] static std::uint64_t index(double x) noexcept {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(x + 0x1.0p40));
  }
  std::uint64_t key_;
};

}  // namespace roborun::sitl
