#include "core/geometry/math.hpp"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace roborun::core {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLn2High = 6.93147180369123816490e-01;  // 32 leading bits, so that k * high is exact
constexpr double kLn2Low = 1.90821492927058770002e-10;
constexpr double kHalfPiHigh = 1.57079632673412561417e+00;  // 33 leading bits
constexpr double kHalfPiLow = 6.07710050650619224932e-11;

// Taylor series on [-pi/4, pi/4]; the first omitted terms are below 1e-16.
double sin_kernel(double x) noexcept {
  const double z = x * x;
  double sum = -1.0 / 1307674368000.0;
  sum = sum * z + 1.0 / 6227020800.0;
  sum = sum * z - 1.0 / 39916800.0;
  sum = sum * z + 1.0 / 362880.0;
  sum = sum * z - 1.0 / 5040.0;
  sum = sum * z + 1.0 / 120.0;
  sum = sum * z - 1.0 / 6.0;
  return x + x * z * sum;
}

double cos_kernel(double x) noexcept {
  const double z = x * x;
  double sum = 1.0 / 20922789888000.0;
  sum = sum * z - 1.0 / 87178291200.0;
  sum = sum * z + 1.0 / 479001600.0;
  sum = sum * z - 1.0 / 3628800.0;
  sum = sum * z + 1.0 / 40320.0;
  sum = sum * z - 1.0 / 720.0;
  sum = sum * z + 1.0 / 24.0;
  sum = sum * z - 0.5;
  return 1.0 + z * sum;
}

// Arc tangent on [0, 1]: the argument is halved twice by atan(x) = 2 atan(x / (1 + sqrt(1 + x^2))), then the
// series.
double atan_kernel(double x) noexcept {
  for (int i = 0; i < 2; ++i) x = x / (1.0 + std::sqrt(1.0 + x * x));
  const double z = x * x;
  double sum = 0.0;
  for (int n = 12; n >= 1; --n) {
    const double term = 1.0 / (2.0 * n + 1.0);
    sum = sum * z + ((n % 2 == 0) ? term : -term);
  }
  return 4.0 * (x + x * z * sum);
}

double power_of_two(int exponent) noexcept {
  return std::bit_cast<double>(static_cast<std::uint64_t>(exponent + 1023) << 52U);
}

}  // namespace

SinCos sin_cos(double angle_rad) noexcept {
  if (!(std::fabs(angle_rad) <= 1e5)) return {kNan, kNan};
  const double turns = std::floor(angle_rad / (kHalfPiHigh + kHalfPiLow) + 0.5);
  const double x = (angle_rad - turns * kHalfPiHigh) - turns * kHalfPiLow;
  const double s = sin_kernel(x);
  const double c = cos_kernel(x);
  switch (static_cast<std::int64_t>(turns) & 3) {
    case 0:
      return {s, c};
    case 1:
      return {c, -s};
    case 2:
      return {-s, -c};
    default:
      return {-c, s};
  }
}

double atan2(double y, double x) noexcept {
  if (std::isnan(x) || std::isnan(y)) return kNan;
  const double ax = std::fabs(x);
  const double ay = std::fabs(y);
  if (ax == 0.0 && ay == 0.0) return 0.0;
  double angle = ay <= ax ? atan_kernel(ay / ax) : 0.5 * kPi - atan_kernel(ax / ay);
  if (x < 0.0) angle = kPi - angle;
  return y < 0.0 ? -angle : angle;
}

double asin(double x) noexcept {
  if (std::isnan(x)) return kNan;
  const double clamped = std::fmin(1.0, std::fmax(-1.0, x));
  return atan2(clamped, std::sqrt((1.0 - clamped) * (1.0 + clamped)));
}

double acos(double x) noexcept {
  if (std::isnan(x)) return kNan;
  const double clamped = std::fmin(1.0, std::fmax(-1.0, x));
  return atan2(std::sqrt((1.0 - clamped) * (1.0 + clamped)), clamped);
}

double exp(double x) noexcept {
  if (std::isnan(x)) return kNan;
  if (x > 709.0) return kInfinity;
  if (x < -745.0) return 0.0;
  const double k = std::floor(x / (kLn2High + kLn2Low) + 0.5);
  const double r = (x - k * kLn2High) - k * kLn2Low;
  double sum = 1.0;
  for (int n = 14; n >= 1; --n) sum = 1.0 + sum * r / n;
  const int exponent = static_cast<int>(k);
  // In two steps, so that results below the normal range stay right.
  const int half = exponent / 2;
  return sum * power_of_two(half) * power_of_two(exponent - half);
}

double log(double x) noexcept {
  if (std::isnan(x) || x < 0.0) return kNan;
  if (x == 0.0) return -kInfinity;
  if (x == kInfinity) return kInfinity;
  int exponent = 0;
  if (x < std::numeric_limits<double>::min()) {
    x *= 0x1.0p54;
    exponent = -54;
  }
  const auto bits = std::bit_cast<std::uint64_t>(x);
  exponent += static_cast<int>(bits >> 52U) - 1023;
  double mantissa = std::bit_cast<double>((bits & 0x000FFFFFFFFFFFFFULL) | 0x3FF0000000000000ULL);
  if (mantissa > 1.4142135623730951) {
    mantissa *= 0.5;
    ++exponent;
  }
  // log(m) = 2 atanh((m - 1) / (m + 1)); |s| <= 0.1716, so 12 terms leave less than 1e-18.
  const double s = (mantissa - 1.0) / (mantissa + 1.0);
  const double z = s * s;
  double sum = 0.0;
  for (int n = 12; n >= 1; --n) sum = (sum + 1.0 / (2.0 * n + 1.0)) * z;
  return exponent * kLn2High + (exponent * kLn2Low + 2.0 * (s + s * sum));
}

double hypot2(double x, double y) noexcept { return std::sqrt(x * x + y * y); }

double wrap_angle(double angle_rad) noexcept {
  if (!(std::fabs(angle_rad) <= 1e5)) return kNan;
  return angle_rad - 2.0 * kPi * std::floor(angle_rad / (2.0 * kPi) + 0.5);
}

}  // namespace roborun::core
