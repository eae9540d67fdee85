/// Says whether an answer of the solver is right, from the problem alone: shares no code with the solver.
#pragma once

#include <cstdint>

#include "governor/solver/lattice_solver.hpp"

namespace roborun::governor {

enum class Verdict : std::uint8_t {
  kAccepted,
  kPrecision,      ///< p0 or p1 outside its interval.
  kVolume,         ///< A volume below zero, above its bound, or v0 > v1.
  kLate,           ///< The latency exceeds the deadline.
  kArithmetic,     ///< Latency or objective are not what the knobs give.
  kSign,           ///< A multiplier below zero or not finite.
  kComplementary,  ///< A multiplier on a constraint that is not tight, or an active bit that is wrong.
  kStationary,     ///< The gradient of the Lagrangian is not zero: these volumes are not optimal.
  kBetterPair,     ///< Another pair of precisions comes closer to the deadline.
  kNotInfeasible,  ///< Called infeasible, but an answer exists.
  kNotInvalid,     ///< Called invalid, but the problem is well posed.
};
[[nodiscard]] const char* to_string(Verdict verdict) noexcept;

/// Checks primal and dual feasibility, complementary slackness and stationarity at the chosen pair (the
/// problem in the volumes is convex, so that proves it optimal there), and that no other pair can come
/// closer: latency at a pair is largest with all volumes at their bounds. Tolerance 1e-9, relative. RT-safe:
/// O(21).
[[nodiscard]] Verdict verify(const SolverProblem& problem, const SolverSolution& solution) noexcept;

}  // namespace roborun::governor
