/// Precision and volume of every stage, so that the time granted is used and never exceeded. Source: RoboRun
/// Eq. 3.
#pragma once

#include <array>
#include <cstdint>

#include "firmware_if/status.hpp"
#include "governor/models/latency_model.hpp"

namespace roborun::governor {

/// Stages of Eq. 3: 0 perception (map), 1 perception to planning (export), 2 planning.
struct SolverProblem {
  double delta_d_s{};  ///< Time for the three stages together.
  std::array<LatencyModel, 3> model{};
  double g_min_m{};  ///< Lower bound of p0 (printed in Eq. 3: finer than the smallest gap is not needed).
  double g_avg_m{};  ///< Upper bounds of p0.
  double d_obs_m{};
  int p1_coarsest_level{kPrecisionLevels - 1};  ///< Policy: no coarser p1 than this.
  int p0_finest_level{0};  ///< Both 0 .. levels - 1; the static designs pin a level with them.
  double v_sensor_m3{};
  double v_map_m3{};  ///< What the map holds after this integration.
  double v0_max_m3{60e3};
  double v1_max_m3{1e6};
  double v2_max_m3{1e6};
};

/// Why the answer is not better, as bits.
enum Active : std::uint16_t {
  kActiveDeadline = 1,       ///< The whole time is used.
  kActiveGapAverage = 2,     ///< p0 is as coarse as g_avg allows.
  kActiveObstacle = 4,       ///< p0 is as coarse as d_obs allows.
  kActiveGapMin = 8,         ///< p0 is as fine as g_min allows.
  kActiveSensorVolume = 16,  ///< v1 = v_sensor.
  kActiveMapVolume = 32,     ///< v1 = v_map.
  kActiveV0 = 64,            ///< v0 at its largest value (v0_max or v1).
  kActiveV2 = 128,           ///< v2 = v2_max.
  kEmptyPrecision =
      256,  ///< g_min above min(g_avg, d_obs), or even the finest cell above it: the finer side won.
};

struct SolverSolution {
  Status status{Status::kInvalidArgument};  ///< kOk; kInfeasible: even zero volume at every allowed precision
                                            ///< is too slow.
  int p0_level{};
  int p1_level{};
  double v0_m3{};
  double v1_m3{};
  double v2_m3{};
  double latency_s{};
  double objective_s2{};  ///< (delta_d - latency)^2
  std::uint16_t active{};
};

/// The exact optimum of
///   minimise (delta_d - sum latency_i(p_i, v_i))^2  subject to  sum latency_i <= delta_d,
///   g_min <= p0 <= min(p1, g_avg, d_obs);  0 <= v0 <= v1 <= min(v_sensor, v_map);  p1 = p2;  p on the
///   lattice;  caps on v.
/// For a fixed pair (p0, p1) latency is linear in the volumes, so all pairs are solved in closed form. Total
/// order where several points are optimal (objectives within 1e-12 s2 are equal): more perceived volume v0,
/// then more planning volume v2, then finer p0, finer p1, more v1. What the space asks for is in the bounds
/// of p0; beyond that, volume comes first. Empty interval for p0: the finer side wins (kEmptyPrecision).
/// Infeasible: the coarsest allowed pair with zero volume, the quickest decision there is. NaN or negative
/// distance and volume bounds count as 0, NaN time as 0. RT-safe: 21 pairs, no iteration.
[[nodiscard]] SolverSolution solve(const SolverProblem& problem) noexcept;

/// True if the solution satisfies every constraint of the problem and its latency and objective are what they
/// claim. Independent of solve(). RT-safe: O(1).
[[nodiscard]] bool is_feasible(const SolverProblem& problem, const SolverSolution& solution) noexcept;

}  // namespace roborun::governor
