/// Elementary functions that give the same bits on every machine.
///
/// libm's results differ in the last bit between CPUs and versions; these use only + - * / sqrt and integer
/// operations in a fixed order, and the build forbids fused multiply-adds. Error bounds are against libm,
/// checked by tests/core/math_test.cpp. NaN in, NaN out, everywhere. RT-safe: O(1), no allocation.
#pragma once

namespace roborun::core {

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kDegree = kPi / 180.0;  ///< Radians.
inline constexpr double kGravity_mps2 = 9.81;

struct SinCos {
  double sin;
  double cos;
};

/// Absolute error <= 1e-13 for |angle| <= 1e5 rad; NaN for infinite or larger angles.
[[nodiscard]] SinCos sin_cos(double angle_rad) noexcept;
[[nodiscard]] inline double sin(double angle_rad) noexcept { return sin_cos(angle_rad).sin; }
[[nodiscard]] inline double cos(double angle_rad) noexcept { return sin_cos(angle_rad).cos; }
/// In (-pi, pi]; 0 for (0, 0). Absolute error <= 1e-13 for finite arguments.
[[nodiscard]] double atan2(double y, double x) noexcept;
/// Argument clamped into [-1, 1]: rounding may carry a unit vector's component just outside.
[[nodiscard]] double asin(double x) noexcept;
[[nodiscard]] double acos(double x) noexcept;
/// Relative error <= 1e-13. +infinity above 709, 0 below -745.
[[nodiscard]] double exp(double x) noexcept;
/// Relative error <= 1e-13 (absolute near 1). -infinity at 0, NaN below, +infinity at +infinity.
[[nodiscard]] double log(double x) noexcept;
/// Euclidean length, without libm's protection against overflow (arguments below 1e150).
[[nodiscard]] double hypot2(double x, double y) noexcept;
/// The angle plus a multiple of 2 pi, in [-pi, pi]; NaN beyond 1e5 rad.
[[nodiscard]] double wrap_angle(double angle_rad) noexcept;

}  // namespace roborun::core
