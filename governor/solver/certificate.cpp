#include "governor/solver/certificate.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace roborun::governor {
namespace {

constexpr double kTolerance = 1e-9;
constexpr double kInfinite = 1e12;

/// False for what is not finite: the tolerance is relative to what is right, not to what is said.
bool near(double right, double said) noexcept {
  return std::fabs(right - said) <= kTolerance * (1.0 + std::fabs(right));
}

bool well_posed(const SolverProblem& p) noexcept {
  const std::array<double, 10> numbers{p.delta_d_s, p.g_min_m,   p.g_avg_m,   p.d_obs_m,   p.v_sensor_m3,
                                       p.v_map_m3,  p.v0_max_m3, p.v1_max_m3, p.v2_max_m3, p.p_min_m};
  for (const double x : numbers) {
    if (x != x) return false;
  }
  return p.p_min_m > 0.0 && p.levels >= 1 && p.levels <= kPrecisionLevels;
}

double size_m(const SolverProblem& p, int level) noexcept {
  return p.p_min_m * static_cast<double>(1U << static_cast<unsigned>(level));
}

bool allowed(const SolverProblem& p, int p0, int p1) noexcept {
  if (p0 < 0 || p1 < p0 || p1 >= p.levels || (p1 > p.p1_coarsest_level && p1 > 0)) return false;
  const double cell_m = size_m(p, p0);
  return p.g_min_m <= cell_m && cell_m <= p.g_avg_m && cell_m <= p.d_obs_m;
}

struct Terms {
  double fixed_s, slope0, slope1, slope2;
};

Terms terms(const SolverProblem& p, int p0, int p1) noexcept {
  const auto i = static_cast<std::size_t>(p0);
  const auto k = static_cast<std::size_t>(p1);
  return {p.model[Knob::kPerceive].fixed_s[i] + p.model[Knob::kExport].fixed_s[k] +
              p.model[Knob::kPlan].fixed_s[k],
          p.model[Knob::kPerceive].slope_s_per_m3[i], p.model[Knob::kExport].slope_s_per_m3[k],
          p.model[Knob::kPlan].slope_s_per_m3[k]};
}

/// Smallest distance to the deadline that any allowed pair can reach; negative if none is in time.
double least_gap_s(const SolverProblem& p, double time_s) noexcept {
  const double hand_on = std::min({p.v_sensor_m3, p.v_map_m3, p.v1_max_m3, kInfinite});
  const double perceive = std::min(p.v0_max_m3, hand_on);
  const double plan = std::min(p.v2_max_m3, kInfinite);
  if (perceive < 0.0 || plan < 0.0) return -1.0;
  double least_s = -1.0;
  for (int p0 = 0; p0 < p.levels; ++p0) {
    for (int p1 = p0; p1 < p.levels; ++p1) {
      if (!allowed(p, p0, p1)) continue;
      const Terms t = terms(p, p0, p1);
      const double longest_s = t.fixed_s + t.slope0 * perceive + t.slope1 * hand_on + t.slope2 * plan;
      if (!(t.fixed_s <= time_s) || !std::isfinite(t.slope0 + t.slope1 + t.slope2)) continue;
      const double gap_s = std::max(time_s - longest_s, 0.0);
      if (least_s < 0.0 || gap_s < least_s) least_s = gap_s;
    }
  }
  return least_s;
}

/// The chosen pair and volumes, put into the problem.
struct Claim {
  const SolverProblem& problem;
  const SolverSolution& solution;
  Terms terms;
  double time_s;
  double latency_s;
  double gap_s;                   ///< time - latency.
  ConstraintArray<double> slack;  ///< g(v) of each constraint g(v) >= 0.
  ConstraintArray<double> scale;  ///< What a tolerance of a slack is relative to.

  [[nodiscard]] bool tight(std::size_t i) const noexcept { return slack[i] <= kTolerance * scale[i]; }
};

Claim claim_of(const SolverProblem& p, const SolverSolution& s, double time_s) noexcept {
  const Terms t = terms(p, s.p0_level, s.p1_level);
  const double latency_s = t.fixed_s + t.slope0 * s.v0_m3 + t.slope1 * s.v1_m3 + t.slope2 * s.v2_m3;
  const double gap_s = time_s - latency_s;
  const double volume_m3 = 1.0 + std::max({s.v0_m3, s.v1_m3, s.v2_m3});
  Claim claim{p, s, t, time_s, latency_s, gap_s, {}, {}};
  claim.slack[Constraint::kDeadline] = gap_s;
  claim.slack[Constraint::kPerceiveSome] = s.v0_m3;
  claim.slack[Constraint::kChain] = s.v1_m3 - s.v0_m3;
  claim.slack[Constraint::kSensor] = std::min(p.v_sensor_m3, kInfinite) - s.v1_m3;
  claim.slack[Constraint::kMap] = std::min(p.v_map_m3, kInfinite) - s.v1_m3;
  claim.slack[Constraint::kPlanSome] = s.v2_m3;
  claim.slack[Constraint::kV0Max] = std::min(p.v0_max_m3, kInfinite) - s.v0_m3;
  claim.slack[Constraint::kV1Max] = std::min(p.v1_max_m3, kInfinite) - s.v1_m3;
  claim.slack[Constraint::kV2Max] = std::min(p.v2_max_m3, kInfinite) - s.v2_m3;
  claim.scale.fill(volume_m3);
  claim.scale[Constraint::kDeadline] = 1.0 + std::fabs(time_s);
  return claim;
}

/// Step 1, primal feasibility: every slack is >= 0, and latency and objective are what the knobs give.
Verdict check_primal(const Claim& c) noexcept {
  for (std::size_t i = c.slack.size(); --i > 0;) {
    // An infinite volume would have an infinite tolerance.
    if (!(c.slack[i] >= -kTolerance * c.scale[i]) || std::isinf(c.slack[i])) return Verdict::kVolume;
  }
  if (!(c.gap_s >= -kTolerance * c.scale[Constraint::kDeadline])) return Verdict::kLate;
  if (!near(c.latency_s, c.solution.latency_s) || !near(c.gap_s * c.gap_s, c.solution.objective_s2))
    return Verdict::kArithmetic;
  return Verdict::kAccepted;
}

/// Step 2, dual feasibility and complementary slackness: m_i >= 0, and m_i g_i = 0.
Verdict check_multipliers(const Claim& c) noexcept {
  for (std::size_t i = 0; const double multiplier : c.solution.multiplier) {
    if (!(multiplier >= 0.0) || !std::isfinite(multiplier)) return Verdict::kSign;
    if (multiplier > 0.0 && !c.tight(i)) return Verdict::kComplementary;
    if (((c.solution.active >> i) & 1U) != 0 && !c.tight(i)) return Verdict::kComplementary;
    ++i;
  }
  return Verdict::kAccepted;
}

/// Step 3, stationarity of the Lagrangian L(v) = gap^2 - sum m_i g_i in each volume:
///   dL/dv_k = -2 gap slope_k + m_deadline slope_k - sum m_i dg_i/dv_k = 0
/// With pull = 2 gap - m_deadline the first two terms are -pull slope_k.
Verdict check_stationary(const Claim& c) noexcept {
  const ConstraintArray<double>& m = c.solution.multiplier;
  const Terms& t = c.terms;
  const double pull = 2.0 * std::max(c.gap_s, 0.0) - m[Constraint::kDeadline];
  const std::array<double, 3> gradient{
      -pull * t.slope0 - m[Constraint::kPerceiveSome] + m[Constraint::kChain] + m[Constraint::kV0Max],
      -pull * t.slope1 - m[Constraint::kChain] + m[Constraint::kSensor] + m[Constraint::kMap] +
          m[Constraint::kV1Max],
      -pull * t.slope2 - m[Constraint::kPlanSome] + m[Constraint::kV2Max]};
  const std::array<double, 3> slope{t.slope0, t.slope0 + t.slope1, t.slope2};
  for (std::size_t i = 0; const double residual : gradient) {
    // A gap within the tolerance of the deadline is no gap.
    if (!(std::fabs(residual) <= kTolerance * (1.0 + 2.0 * std::fabs(c.time_s)) * (slope[i] + 1e-12)))
      return Verdict::kStationary;
    ++i;
  }
  return Verdict::kAccepted;
}

}  // namespace

const char* to_string(Verdict verdict) noexcept {
  switch (verdict) {
    case Verdict::kAccepted:
      return "accepted";
    case Verdict::kPrecision:
      return "precision outside its interval";
    case Verdict::kVolume:
      return "volume outside its bounds";
    case Verdict::kLate:
      return "late";
    case Verdict::kArithmetic:
      return "latency or objective wrong";
    case Verdict::kSign:
      return "multiplier negative";
    case Verdict::kComplementary:
      return "multiplier or active bit on a constraint that is not tight";
    case Verdict::kStationary:
      return "not stationary";
    case Verdict::kBetterPair:
      return "another pair is better";
    case Verdict::kNotInfeasible:
      return "not infeasible";
    case Verdict::kNotInvalid:
      return "not invalid";
  }
  return "unknown";
}

Verdict verify(const SolverProblem& p, const SolverSolution& s) noexcept {
  if (!well_posed(p)) return s.status == Status::kInvalidArgument ? Verdict::kAccepted : Verdict::kArithmetic;
  const double time_s = std::min(p.delta_d_s, kInfinite);
  const double least_s = least_gap_s(p, time_s);
  if (s.status == Status::kInvalidArgument) return Verdict::kNotInvalid;
  if (s.status == Status::kInfeasible) return least_s < 0.0 ? Verdict::kAccepted : Verdict::kNotInfeasible;

  if (!allowed(p, s.p0_level, s.p1_level)) return Verdict::kPrecision;
  const Claim claim = claim_of(p, s, time_s);
  for (const auto check : {check_primal, check_multipliers, check_stationary}) {
    const Verdict verdict = check(claim);
    if (verdict != Verdict::kAccepted) return verdict;
  }
  // Step 4: no other pair comes closer to the deadline.
  return claim.gap_s - least_s <= kTolerance * (claim.gap_s + 1e-6 * (1.0 + std::fabs(time_s)))
             ? Verdict::kAccepted
             : Verdict::kBetterPair;
}

}  // namespace roborun::governor
