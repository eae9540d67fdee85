/// The power-of-two precision lattice: cell sizes finest * 2^level. Source: RoboRun Table "Knob values", Eq. 3.
#pragma once

namespace roborun {

inline constexpr double kPublishedCell_m = 0.3;  ///< (1.8 m aisle - 1.2 m vehicle) / 2.
inline constexpr int kPrecisionLevels = 6;

/// The published one: 0.3, 0.6, 1.2, 2.4, 4.8, 9.6 m.
struct PrecisionLattice {
  double finest_m{kPublishedCell_m};  ///< > 0.

  /// Edge of a cell. level is clamped into [0, kPrecisionLevels - 1]. RT-safe: O(1).
  [[nodiscard]] constexpr double cell_size_m(int level) const noexcept {
    const int clamped = level < 0 ? 0 : (level >= kPrecisionLevels ? kPrecisionLevels - 1 : level);
    return finest_m * static_cast<double>(1 << clamped);
  }
  /// The coarsest level whose cell is not larger than size_m; 0 if even the finest is, and for NaN. RT-safe: O(1).
  [[nodiscard]] constexpr int coarsest_level_within(double size_m) const noexcept {
    int level = 0;
    while (level + 1 < kPrecisionLevels && cell_size_m(level + 1) <= size_m) ++level;
    return level;
  }
};

}  // namespace roborun
