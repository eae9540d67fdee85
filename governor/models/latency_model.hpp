/// How long a stage takes at a precision and volume. Source: RoboRun Eq. 4, with one constant per level added.
#pragma once

#include <array>
#include <span>

#include "core/executive/cost_profile.hpp"
#include "core/precision.hpp"
#include "firmware_if/status.hpp"
#include "governor/models/knob.hpp"

namespace roborun::governor {

/// latency(level, v) = fixed_s[level] + slope_s_per_m3[level] v. Linear in the volume at each precision, as
/// Eq. 4 is; Eq. 4 itself is one way to fill the slopes. Non-negative everywhere.
struct LatencyModel {
  std::array<double, kPrecisionLevels> fixed_s{};
  std::array<double, kPrecisionLevels> slope_s_per_m3{};

  /// kOk if all coefficients are finite and >= 0.
  [[nodiscard]] Status validate() const noexcept;
  [[nodiscard]] double latency_s(int level, double volume_m3) const noexcept;
};

/// Everything `factor` times as long. RT-safe: O(1).
[[nodiscard]] LatencyModel slower(const LatencyModel& model, double factor) noexcept;

/// Eq. 4: (q0 / p^3 + q1 / p^2 + q2 / p) (q3 v). Negative results are raised to 0.
struct Eq4 {
  std::array<double, 4> q{};
};
/// On the lattice finest_m * 2^level.
[[nodiscard]] LatencyModel from_eq4(const Eq4& eq4, double finest_m = kPublishedCell_m) noexcept;
/// The part of a cost profile that depends on level and volume.
[[nodiscard]] LatencyModel from_cost(const core::StageCost& cost) noexcept;

/// One measured point of a precision x volume sweep.
struct LatencyPoint {
  int level{};
  double volume_m3{};
  double latency_s{};
};
struct ModelError {
  double mean_relative{};
  double max_relative{};
};
/// Eq. 4 with two terms added that our own kernels need: a cost of volume that does not depend on precision,
/// and a constant a level, never larger for coarser cells. Least squares of the relative error with all
/// coefficients >= 0 (so that the model is monotone), by trying every set of active ones. Points with
/// latency <= 0 are left out. Start-up only: O(points).
[[nodiscard]] LatencyModel fit_latency(std::span<const LatencyPoint> points) noexcept;
/// Of a model on points, which are best not those it was fitted on. Start-up only.
[[nodiscard]] ModelError error_of(const LatencyModel& model, std::span<const LatencyPoint> points) noexcept;

/// Follows a machine that became slower than its model: predicted times are multiplied by it. Rises at once
/// to what was seen, falls by 2 % a decision; always within [1, 4].
class DriftScale {
 public:
  void observe(double predicted_s, double spent_s) noexcept;
  [[nodiscard]] double value() const noexcept { return value_; }

 private:
  double value_{1.0};
};

}  // namespace roborun::governor
