#include "governor/solver/lattice_solver.hpp"

#include <algorithm>
#include <cmath>

namespace roborun::governor {
namespace {

constexpr double kHuge = 1e12;  // infinite bounds, kept out of differences
constexpr double kSameGap_ratio = 1e-10;
constexpr double kSameGap_s = 1e-14;
constexpr double kSameVolume_m3 = 1e-6;

struct Bounds {
  int p0_finest{};
  int p0_coarsest{};
  int p1_coarsest{};
  double v0_m3{};
  double v1_m3{};
  double v2_m3{};
};

constexpr std::uint16_t bit(Constraint c) noexcept {
  return static_cast<std::uint16_t>(1U << static_cast<unsigned>(c));
}

void set(SolverSolution& s, bool on, std::uint16_t mask) noexcept {
  if (on) s.active = static_cast<std::uint16_t>(s.active | mask);
}

/// Fills `b`, and into `s` the reasons why there is no answer. NaN fails every comparison.
Status bounds_of(const SolverProblem& p, Bounds& b, SolverSolution& s) noexcept {
  const double upper_m = std::min(p.g_avg_m, p.d_obs_m);
  b.v1_m3 = std::min({p.v_sensor_m3, p.v_map_m3, p.v1_max_m3, kHuge});
  b.v0_m3 = std::min(p.v0_max_m3, b.v1_m3);
  b.v2_m3 = std::min(p.v2_max_m3, kHuge);
  const bool numbers = !std::isnan(p.delta_d_s) && !std::isnan(p.g_min_m) && !std::isnan(p.g_avg_m) &&
                       !std::isnan(p.d_obs_m) && !std::isnan(p.v_sensor_m3) && !std::isnan(p.v_map_m3) &&
                       !std::isnan(p.v0_max_m3) && !std::isnan(p.v1_max_m3) && !std::isnan(p.v2_max_m3);
  if (!numbers || !(p.p_min_m > 0.0) || p.levels < 1 || p.levels > kPrecisionLevels)
    return Status::kInvalidArgument;

  b.p1_coarsest = std::clamp(p.p1_coarsest_level, 0, p.levels - 1);
  double cell_m = p.p_min_m;
  while (b.p0_finest <= b.p1_coarsest && cell_m < p.g_min_m) {
    ++b.p0_finest;
    cell_m *= 2.0;
  }
  b.p0_coarsest = b.p0_finest - 1;
  while (b.p0_coarsest < b.p1_coarsest && cell_m <= upper_m) {
    ++b.p0_coarsest;
    cell_m *= 2.0;
  }
  set(s, b.p0_finest > b.p0_coarsest, kEmptyPrecision);
  set(s, !(b.v0_m3 >= 0.0) || !(b.v2_m3 >= 0.0), kEmptyVolume);
  return s.active == 0 ? Status::kOk : Status::kInfeasible;
}

struct Candidate {
  int p0{};
  int p1{};
  double v0_m3{};
  double v1_m3{};
  double v2_m3{};
  double latency_s{};
  double gap_s{};
};

/// Largest x in [0, most] with slope * x <= time.
double affordable(double time_s, double slope, double most) noexcept {
  return slope * most <= time_s ? most : time_s / slope;
}

/// Of a pair with zero volumes.
double fixed_s_of(const SolverProblem& p, std::size_t i0, std::size_t i1) noexcept {
  return p.model[Knob::kPerceive].fixed_s[i0] + p.model[Knob::kExport].fixed_s[i1] +
         p.model[Knob::kPlan].fixed_s[i1];
}

/// False if the pair has no answer.
bool solve_pair(const SolverProblem& p, const Bounds& b, double delta_d_s, int p0, int p1,
                Candidate& out) noexcept {
  const auto i0 = static_cast<std::size_t>(p0);
  const auto i1 = static_cast<std::size_t>(p1);
  const double a = p.model[Knob::kPerceive].slope_s_per_m3[i0];
  const double e = p.model[Knob::kExport].slope_s_per_m3[i1];
  const double c = p.model[Knob::kPlan].slope_s_per_m3[i1];
  const double fixed_s = fixed_s_of(p, i0, i1);
  const double most_s = fixed_s + a * b.v0_m3 + e * b.v1_m3 + c * b.v2_m3;
  if (!(fixed_s <= delta_d_s) || !std::isfinite(a + e + c)) return false;
  out = {p0, p1, b.v0_m3, b.v1_m3, b.v2_m3, most_s, delta_d_s - most_s};
  if (most_s <= delta_d_s) return true;
  double rest_s = delta_d_s - fixed_s;
  // What is perceived must also be handed on: v1 = v0 comes with it.
  out.v0_m3 = affordable(rest_s, a + e, b.v0_m3);
  rest_s = std::max(rest_s - (a + e) * out.v0_m3, 0.0);
  out.v2_m3 = affordable(rest_s, c, b.v2_m3);
  rest_s = std::max(rest_s - c * out.v2_m3, 0.0);
  out.v1_m3 = out.v0_m3 + affordable(rest_s, e, b.v1_m3 - out.v0_m3);
  out.latency_s = fixed_s + a * out.v0_m3 + e * out.v1_m3 + c * out.v2_m3;
  out.gap_s = 0.0;
  return true;
}

bool better(const Candidate& a, const Candidate& b) noexcept {
  const double same_s = kSameGap_ratio * std::min(a.gap_s, b.gap_s) + kSameGap_s;
  if (a.gap_s < b.gap_s - same_s) return true;
  if (a.gap_s > b.gap_s + same_s) return false;
  if (std::fabs(a.v0_m3 - b.v0_m3) > kSameVolume_m3) return a.v0_m3 > b.v0_m3;
  if (std::fabs(a.v2_m3 - b.v2_m3) > kSameVolume_m3) return a.v2_m3 > b.v2_m3;
  // Pairs come in the order of p0, then p1, so the one at hand is never finer.
  return false;
}

void certify(const SolverProblem& p, const Bounds& b, bool deadline, SolverSolution& s) noexcept {
  set(s, deadline, bit(Constraint::kDeadline));
  set(s, s.v0_m3 <= 0.0, bit(Constraint::kPerceiveSome));
  set(s, s.v1_m3 <= s.v0_m3, bit(Constraint::kChain));
  set(s, s.v1_m3 >= p.v_sensor_m3, bit(Constraint::kSensor));
  set(s, s.v1_m3 >= p.v_map_m3, bit(Constraint::kMap));
  set(s, s.v2_m3 <= 0.0, bit(Constraint::kPlanSome));
  set(s, s.v0_m3 >= p.v0_max_m3, bit(Constraint::kV0Max));
  set(s, s.v1_m3 >= p.v1_max_m3, bit(Constraint::kV1Max));
  set(s, s.v2_m3 >= b.v2_m3, bit(Constraint::kV2Max));
  const double next_m = p.p_min_m * static_cast<double>(2U << static_cast<unsigned>(s.p0_level));
  set(s, next_m > p.g_avg_m, kGapAverage);
  set(s, next_m > p.d_obs_m, kObstacle);
  set(s, s.p0_level == b.p0_finest && b.p0_finest > 0, kGapMin);
  if (deadline) return;  // the objective is zero: so are all multipliers
  const auto i0 = static_cast<std::size_t>(s.p0_level);
  const auto i1 = static_cast<std::size_t>(s.p1_level);
  const double twice_gap_s = 2.0 * (std::min(p.delta_d_s, kHuge) - s.latency_s);
  const double perceive = twice_gap_s * p.model[Knob::kPerceive].slope_s_per_m3[i0];
  double hand_on = twice_gap_s * p.model[Knob::kExport].slope_s_per_m3[i1];
  if ((s.active & bit(Constraint::kV0Max)) != 0) {
    s.multiplier[Constraint::kV0Max] = perceive;
  } else {
    s.multiplier[Constraint::kChain] = perceive;
    hand_on += perceive;
  }
  const bool sensor = (s.active & bit(Constraint::kSensor)) != 0;
  const bool map = (s.active & bit(Constraint::kMap)) != 0;
  s.multiplier[sensor ? Constraint::kSensor : (map ? Constraint::kMap : Constraint::kV1Max)] = hand_on;
  s.multiplier[Constraint::kV2Max] = twice_gap_s * p.model[Knob::kPlan].slope_s_per_m3[i1];
}

}  // namespace

const char* to_string(Constraint constraint) noexcept {
  switch (constraint) {
    case Constraint::kDeadline:
      return "deadline";
    case Constraint::kPerceiveSome:
      return "v0_zero";
    case Constraint::kChain:
      return "v0_v1";
    case Constraint::kSensor:
      return "v_sensor";
    case Constraint::kMap:
      return "v_map";
    case Constraint::kPlanSome:
      return "v2_zero";
    case Constraint::kV0Max:
      return "v0_max";
    case Constraint::kV1Max:
      return "v1_max";
    case Constraint::kV2Max:
      return "v2_max";
  }
  return "unknown";
}

const char* to_string(Reason reason) noexcept {
  switch (reason) {
    case kGapAverage:
      return "g_avg";
    case kObstacle:
      return "d_obs";
    case kGapMin:
      return "g_min";
    case kEmptyPrecision:
      return "empty_precision";
    case kEmptyVolume:
      return "empty_volume";
    case kTooSlow:
      return "too_slow";
  }
  return "unknown";
}

SolverSolution solve(const SolverProblem& problem) noexcept {
  SolverSolution s;
  Bounds b;
  s.status = bounds_of(problem, b, s);
  if (s.status == Status::kInvalidArgument) return s;
  const double delta_d_s = std::min(problem.delta_d_s, kHuge);
  Candidate best;
  bool found = false;
  if (s.status == Status::kOk) {
    for (int p0 = b.p0_finest; p0 <= b.p0_coarsest; ++p0) {
      for (int p1 = p0; p1 <= b.p1_coarsest; ++p1) {
        Candidate candidate;
        if (!solve_pair(problem, b, delta_d_s, p0, p1, candidate)) continue;
        if (!found || better(candidate, best)) best = candidate;
        found = true;
      }
    }
    if (!found) {
      s.status = Status::kInfeasible;
      s.active = kTooSlow;
    }
  }
  if (found) {
    s.p0_level = best.p0;
    s.p1_level = best.p1;
    s.v0_m3 = best.v0_m3;
    s.v1_m3 = best.v1_m3;
    s.v2_m3 = best.v2_m3;
    s.latency_s = best.latency_s;
    s.objective_s2 = (delta_d_s - best.latency_s) * (delta_d_s - best.latency_s);
    certify(problem, b, best.gap_s <= 0.0, s);
    return s;
  }
  s.p0_level = std::clamp(b.p0_coarsest, 0, b.p1_coarsest);
  s.p1_level = b.p1_coarsest;
  s.latency_s =
      fixed_s_of(problem, static_cast<std::size_t>(s.p0_level), static_cast<std::size_t>(s.p1_level));
  s.objective_s2 = (delta_d_s - s.latency_s) * (delta_d_s - s.latency_s);
  return s;
}

}  // namespace roborun::governor
