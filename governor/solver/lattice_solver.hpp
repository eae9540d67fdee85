/// Precision and volume of every stage, so that the time granted is used and never exceeded. Source: RoboRun
/// Eq. 3.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "firmware_if/status.hpp"
#include "governor/models/knob.hpp"
#include "governor/models/latency_model.hpp"

namespace roborun::governor {

/// The instance of Eq. 3 that one decision solves.
struct SolverProblem {
  double delta_d_s{};  ///< Time for the three stages together.
  KnobArray<LatencyModel> model{};
  double p_min_m{kPublishedCell_m};  ///< Finest cell of the lattice p_min * 2^k. > 0.
  int levels{kPrecisionLevels};      ///< Of the lattice, 1 .. kPrecisionLevels.
  double g_min_m{};                  ///< Lower bound of p0.
  double g_avg_m{};                  ///< Upper bounds of p0.
  double d_obs_m{};
  int p1_coarsest_level{kPrecisionLevels - 1};  ///< Policy: no coarser p1 than this.
  double v_sensor_m3{};
  double v_map_m3{};       ///< What the map holds after this integration.
  double v0_max_m3{60e3};  ///< Upper ends of the knobs.
  double v1_max_m3{1e6};
  double v2_max_m3{1e6};
};

/// The inequality constraints on the volumes, in the order of the multipliers.
enum class Constraint : std::uint8_t {
  kDeadline,      ///< sum of latencies <= delta_d
  kPerceiveSome,  ///< 0 <= v0
  kChain,         ///< v0 <= v1
  kSensor,        ///< v1 <= v_sensor
  kMap,           ///< v1 <= v_map
  kPlanSome,      ///< 0 <= v2
  kV0Max,
  kV1Max,
  kV2Max,
};
inline constexpr std::size_t kConstraintCount = 9;
/// One value per constraint.
template <typename T>
using ConstraintArray = core::EnumArray<Constraint, T, kConstraintCount>;
[[nodiscard]] const char* to_string(Constraint constraint) noexcept;

/// Why p0 is what it is, or why there is no answer; bits above those of the constraints.
enum Reason : std::uint16_t {
  kGapAverage = 1U << 9U,       ///< p0 could be coarser but for g_avg.
  kObstacle = 1U << 10U,        ///< p0 could be coarser but for d_obs.
  kGapMin = 1U << 11U,          ///< p0 could be finer but for g_min.
  kEmptyPrecision = 1U << 12U,  ///< No lattice point in [g_min, min(g_avg, d_obs)].
  kEmptyVolume = 1U << 13U,     ///< A volume bound below zero.
  kTooSlow = 1U << 14U,         ///< Even zero volume takes longer than delta_d at every allowed precision.
};

/// The name of a single Reason bit; "unknown" for anything else.
[[nodiscard]] const char* to_string(Reason reason) noexcept;
inline constexpr std::array<Reason, 6> kReasons{kGapAverage,     kObstacle,    kGapMin,
                                                kEmptyPrecision, kEmptyVolume, kTooSlow};

struct SolverSolution {
  /// kOk; kInfeasible: `active` says which bound is empty; kInvalidArgument: NaN among the bounds or the
  /// time, p_min not above zero, or levels out of range.
  Status status{Status::kInvalidArgument};
  int p0_level{};
  int p1_level{};
  double v0_m3{};
  double v1_m3{};
  double v2_m3{};
  double latency_s{};
  double objective_s2{};   ///< (delta_d - latency)^2
  std::uint16_t active{};  ///< 1 << Constraint of those that hold with equality, and Reason bits.
  /// Of min (delta_d - latency)^2 at the chosen pair of precisions: d objective / d bound, >= 0. s2/s for the
  /// deadline, s2/m3 for the others.
  ConstraintArray<double> multiplier{};
};

/// Returns the exact optimum of
///   minimise    (delta_d - sum latency_i(p_i, v_i))^2
///   subject to  sum latency_i <= delta_d
///               g_min <= p0 <= min(p1, g_avg, d_obs);  p1 = p2;  p0, p1 on the lattice
///               0 <= v0 <= v1 <= min(v_sensor, v_map);  0 <= v2 <= v2_max
///               v0 <= v0_max;  v1 <= v1_max
///
/// For a pair (p0, p1) latency is linear in the volumes with slopes >= 0, so its optimum is at a vertex: all
/// volumes at their bounds if that fits into the time, otherwise the deadline is active and v0, v2, v1 are
/// filled in this order.
/// Total order among pairs whose distance to the deadline is the same to ten digits: more perceived volume
/// v0, then more planning volume v2, then finer p0, finer p1, more v1. (What precision the space asks for is
/// in the bounds of p0; beyond that, volume comes first.)
/// No answer: the coarsest allowed pair with zero volumes, the quickest decision there is.
/// An infinite time or bound counts as 1e12; a pair whose coefficients are not finite or whose latency is NaN
/// is left out.
/// RT-safe: 21 pairs of at most three steps each, no iteration, no allocation.
[[nodiscard]] SolverSolution solve(const SolverProblem& problem) noexcept;

}  // namespace roborun::governor
