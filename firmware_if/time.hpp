/// Time is a type. Vocabulary of the whole project, hence directly in namespace roborun.
#pragma once

#include <chrono>
#include <cstdint>

namespace roborun {

using Nanos = std::chrono::duration<std::int64_t, std::nano>;

/// A clock that only moves forward. It has no now(): time is read from firmware_if::Clock, so that
/// simulation, replay and flight run the same code. The epoch is the start of the run.
struct MonotonicEpoch {
  using duration = Nanos;
  using rep = duration::rep;
  using period = duration::period;
  using time_point = std::chrono::time_point<MonotonicEpoch, Nanos>;
  static constexpr bool is_steady = true;  // NOLINT(readability-identifier-naming): named by the standard
};
using MonotonicTime = MonotonicEpoch::time_point;

/// Seconds as a double, for formulas. Exact to 1 ns for the first 100 days.
[[nodiscard]] constexpr double seconds(Nanos duration) noexcept {
  return static_cast<double>(duration.count()) * 1e-9;
}

/// A duration from seconds, rounded towards zero. NaN gives zero; beyond +-1e9 s it is clamped.
[[nodiscard]] constexpr Nanos from_seconds(double value_s) noexcept {
  if (!(value_s == value_s)) return Nanos{0};
  const double clamped_s = value_s > 1e9 ? 1e9 : (value_s < -1e9 ? -1e9 : value_s);
  return Nanos{static_cast<std::int64_t>(clamped_s * 1e9)};
}

}  // namespace roborun
