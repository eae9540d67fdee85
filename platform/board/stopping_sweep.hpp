/// How far the simulated vehicle travels until it stands, from each speed.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "core/stopping_model.hpp"

namespace roborun::board {

struct StoppingPoint {
  double speed_mps{};
  double distance_m{};  ///< The longest of the runs.
};

/// Flies straight at each speed, in wind and with noisy sensors, and takes the brake trajectory that the
/// runtime would: the distance is the true vehicle's, tracking error included. `runs` seeds each.
/// Deterministic.
[[nodiscard]] std::vector<StoppingPoint> stopping_sweep(std::span<const double> speeds_mps, int runs,
                                                        const std::function<void(double)>& progress);

struct StoppingFit {
  StoppingModel model{};
  double mean_squared_relative{};  ///< Of model / measured - 1.
};
/// Least squares of the relative error.
[[nodiscard]] StoppingFit fit_stopping(std::span<const StoppingPoint> points);

}  // namespace roborun::board
