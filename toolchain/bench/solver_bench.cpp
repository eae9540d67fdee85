// Our exact solver of Eq. 3 beside general solvers on the relaxation, with rounding as the authors do it. The
// last line of output is JSON; with --callgrind N it runs N instances for the instruction counter instead.
#include <fmt/format.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>
#include <valgrind/callgrind.h>

#include <BonBonminSetup.hpp>
#include <BonCbc.hpp>
#include <BonTMINLP.hpp>
#include <IpIpoptApplication.hpp>
#include <IpTNLP.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <nlopt.hpp>
#include <string>
#include <vector>

#include "core/random/counter_rng.hpp"
#include "governor/solver/certificate.hpp"

namespace {

using namespace roborun;
using namespace roborun::governor;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kPatience_s = 1.0;

struct Instance {
  SolverProblem problem;
  std::array<Eq4, 3> eq4;
};

/// Costs around those of the published machine, spaces from a tight aisle to the open sky; one in four
/// degenerate.
Instance instance_of(std::uint64_t number) {
  core::CounterRng rng(number, 20);
  Instance n;
  SolverProblem& p = n.problem;
  p.delta_d_s = rng.uniform(0.05, 4.0);
  const std::array<double, 3> scale{2e-6, 2e-7, 3e-6};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) n.eq4[i].q[k] = scale[i] * rng.uniform();
    n.eq4[i].q[3] = 1.0;
    p.model[i] = from_eq4(n.eq4[i]);
  }
  p.g_min_m = rng.uniform(0.0, 0.6);
  p.g_avg_m = rng.uniform(0.6, 12.0);
  p.d_obs_m = rng.uniform(0.6, 25.0);
  p.v_sensor_m3 = rng.uniform(500.0, 6e4);
  p.v_map_m3 = rng.uniform(500.0, 1e6);
  p.v0_max_m3 = p.v1_max_m3 = 1e12;
  p.v2_max_m3 = rng.uniform(500.0, 1e6);
  if (rng.below(4) != 0) return n;
  const std::array<double, 6> odd{0.0, kInfinity, -1.0, std::nan(""), 1e300, 0.3};
  const std::array<double*, 8> field{
      &p.delta_d_s,   &p.g_min_m,  &p.g_avg_m,   &p.d_obs_m,
      &p.v_sensor_m3, &p.v_map_m3, &p.v2_max_m3, &p.model[rng.below(3)].slope_s_per_m3[rng.below(6)]};
  const std::uint64_t at = rng.below(8);
  const double value = odd[rng.below(6)];
  // Coefficients below zero are no model.
  *field[at] = at == 7 && value < 0.0 ? 0.0 : value;
  if (rng.below(3) == 0) p.g_avg_m = p.g_min_m;
  return n;
}

/// All lattice pairs, volumes on a grid of (steps + 1)^3 with both ends: written without a look at the
/// solver.
double exhaustive(const SolverProblem& p, int steps) {
  double best = kInfinity;
  if (std::isnan(p.v_sensor_m3) || std::isnan(p.v_map_m3)) return best;  // std::min would hide it
  const double time_s = std::min(p.delta_d_s, 1e12);                     // as documented for infinite times
  const double v1_most = std::min({p.v_sensor_m3, p.v_map_m3, 1e12});
  for (int k0 = 0; k0 < 6; ++k0) {
    const double p0 = 0.3 * (1 << k0);
    if (!(p0 >= p.g_min_m && p0 <= p.g_avg_m && p0 <= p.d_obs_m) || !(v1_most >= 0.0) ||
        !(p.v2_max_m3 >= 0.0))
      continue;
    for (int k1 = k0; k1 < 6; ++k1) {
      for (int a = 0; a <= steps; ++a) {
        for (int b = a; b <= steps; ++b) {
          for (int c = 0; c <= steps; ++c) {
            const double latency = p.model[0].latency_s(k0, v1_most * a / steps) +
                                   p.model[1].latency_s(k1, v1_most * b / steps) +
                                   p.model[2].latency_s(k1, std::min(p.v2_max_m3, 1e12) * c / steps);
            const double gap = time_s - latency;
            if (gap >= 0.0) best = std::min(best, gap * gap);
          }
        }
      }
    }
  }
  return best;
}

/// The relaxation that the peers get: x = (p0, p1, v0, v1, v2), volumes as a share of their upper bounds, so
/// that all variables are of order one.
struct Relaxed {
  const Instance& n;
  [[nodiscard]] std::array<double, 3> unit_m3() const {
    const double v1 = std::min(n.problem.v_sensor_m3, n.problem.v_map_m3);
    return {v1, v1, n.problem.v2_max_m3};
  }
  [[nodiscard]] std::array<double, 5> upper() const {
    return {std::min({9.6, n.problem.g_avg_m, n.problem.d_obs_m}), 9.6, 1.0, 1.0, 1.0};
  }
  [[nodiscard]] std::array<double, 5> lower() const {
    return {std::max(0.3, n.problem.g_min_m), 0.3, 0.0, 0.0, 0.0};
  }
  /// Latency and its gradient.
  double latency(const double* x, double* gradient) const {
    double sum = 0.0;
    if (gradient != nullptr) std::fill(gradient, gradient + 5, 0.0);
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t at = i == 0 ? 0 : 1;
      const double r = 1.0 / x[at];
      const auto& q = n.eq4[i].q;
      const double unit = unit_m3()[i];
      const double slope = ((q[0] * r + q[1]) * r + q[2]) * r * unit;
      sum += slope * x[2 + i];
      if (gradient == nullptr) continue;
      gradient[2 + i] += slope;
      gradient[at] -= ((3.0 * q[0] * r + 2.0 * q[1]) * r + q[2]) * r * r * unit * x[2 + i];
    }
    return sum;
  }
  double objective(const double* x, double* gradient) const {
    const double gap = n.problem.delta_d_s - latency(x, gradient);
    if (gradient != nullptr) {
      for (int i = 0; i < 5; ++i) gradient[i] *= -2.0 * gap;
    }
    return gap * gap;
  }
  /// Middle of everything.
  [[nodiscard]] std::array<double, 5> start() const {
    std::array<double, 5> x{};
    for (std::size_t i = 0; i < 5; ++i) x[i] = 0.5 * (lower()[i] + upper()[i]);
    x[1] = std::max(x[0], x[1]);
    x[2] = 0.5 * x[3];
    return x;
  }
};

struct Outcome {
  double time_us{};
  bool infeasible{};  ///< A bound or the order of the knobs is broken after rounding.
  bool late{};        ///< Latency above the deadline after rounding.
  bool unanswered{};  ///< Had to be killed.
  double objective{kInfinity};
};

/// Precision to the next coarser lattice point, as the authors round; volumes as they are.
Outcome judge(const Instance& n, std::array<double, 5> x, double time_us, bool shares = true) {
  Outcome o;
  for (std::size_t i = 0; i < 3 && shares; ++i) x[2 + i] *= Relaxed{n}.unit_m3()[i];
  o.time_us = time_us;
  const SolverProblem& p = n.problem;
  const auto level = [](double cell) {
    const int within = PrecisionLattice{}.coarsest_level_within(cell * (1.0 + 1e-6));
    return cell > PrecisionLattice{}.cell_size_m(within) * (1.0 + 1e-6) ? std::min(within + 1, kPrecisionLevels - 1) : within;
  };
  const int k0 = level(x[0]);
  const int k1 = level(x[1]);
  const double p0 = PrecisionLattice{}.cell_size_m(k0);
  const double slack = 1.0 + 1e-6;
  const double v1_most = std::min(p.v_sensor_m3, p.v_map_m3);
  bool finite = true;
  for (const double value : x) finite = finite && std::isfinite(value);
  o.infeasible = !finite || k1 < k0 || p0 * slack < p.g_min_m ||
                 p0 > slack * std::min(p.g_avg_m, p.d_obs_m) || x[2] > x[3] * slack + 1e-6 ||
                 x[3] > v1_most * slack + 1e-6 || x[4] > p.v2_max_m3 * slack + 1e-6 ||
                 std::min({x[2], x[3], x[4]}) < -1e-6;
  const double latency =
      p.model[0].latency_s(k0, x[2]) + p.model[1].latency_s(k1, x[3]) + p.model[2].latency_s(k1, x[4]);
  o.late = !(latency <= p.delta_d_s * slack);
  if (!o.infeasible && !o.late) o.objective = (p.delta_d_s - latency) * (p.delta_d_s - latency);
  return o;
}

double now_us() {
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

Outcome run_nlopt(const Instance& n, nlopt::algorithm algorithm) {
  const Relaxed relaxed{n};
  const double begin = now_us();
  nlopt::opt opt(algorithm, 5);
  const auto low = relaxed.lower();
  const auto high = relaxed.upper();
  opt.set_lower_bounds(std::vector<double>(low.begin(), low.end()));
  opt.set_upper_bounds(std::vector<double>(high.begin(), high.end()));
  opt.set_min_objective(
      [](unsigned, const double* x, double* g, void* d) { return static_cast<Relaxed*>(d)->objective(x, g); },
      const_cast<Relaxed*>(&relaxed));
  opt.add_inequality_constraint(
      [](unsigned, const double* x, double* g, void* d) {
        return static_cast<Relaxed*>(d)->latency(x, g) - static_cast<Relaxed*>(d)->n.problem.delta_d_s;
      },
      const_cast<Relaxed*>(&relaxed), 1e-9);
  opt.add_inequality_constraint(
      [](unsigned, const double* x, double* g, void*) {
        if (g != nullptr) std::copy_n(std::array<double, 5>{1, -1, 0, 0, 0}.begin(), 5, g);
        return x[0] - x[1];
      },
      nullptr, 1e-9);
  opt.add_inequality_constraint(
      [](unsigned, const double* x, double* g, void*) {
        if (g != nullptr) std::copy_n(std::array<double, 5>{0, 0, 1, -1, 0}.begin(), 5, g);
        return x[2] - x[3];
      },
      nullptr, 1e-9);
  opt.set_xtol_rel(1e-8);
  if (algorithm == nlopt::GN_ISRES) opt.set_maxeval(5000);  // it never stops by itself
  const auto first = relaxed.start();
  std::vector<double> x(first.begin(), first.end());
  double value = 0.0;
  try {
    (void)opt.optimize(x, value);
  } catch (const std::exception&) {
    // The best so far counts, as it would in flight.
  }
  std::array<double, 5> answer{};
  std::copy_n(x.begin(), 5, answer.begin());
  return judge(n, answer, now_us() - begin);
}

/// The same problem for Ipopt; and for Bonmin with whole levels instead of p: x[0], x[1] are then exponents.
class Tnlp : public Bonmin::TMINLP {
 public:
  Tnlp(const Instance& n, bool levels) : relaxed_{n}, levels_(levels) {}
  bool get_nlp_info(Ipopt::Index& n, Ipopt::Index& m, Ipopt::Index& jacobian, Ipopt::Index& hessian,
                    Ipopt::TNLP::IndexStyleEnum& style) override {
    n = 5;
    m = 3;
    jacobian = 9;
    hessian = 0;
    style = Ipopt::TNLP::C_STYLE;
    return true;
  }
  bool get_bounds_info(Ipopt::Index, Ipopt::Number* low, Ipopt::Number* high, Ipopt::Index,
                       Ipopt::Number* g_low, Ipopt::Number* g_high) override {
    const auto l = relaxed_.lower();
    const auto u = relaxed_.upper();
    for (std::size_t i = 0; i < 5; ++i) {
      low[i] = i < 2 && levels_ ? std::ceil(std::log2(l[i] / 0.3) - 1e-9) : l[i];
      high[i] = i < 2 && levels_ ? std::floor(std::log2(u[i] / 0.3) + 1e-9) : u[i];
    }
    std::fill_n(g_low, 3, -1e20);
    g_high[0] = relaxed_.n.problem.delta_d_s;
    g_high[1] = g_high[2] = 0.0;
    return true;
  }
  bool get_starting_point(Ipopt::Index, bool, Ipopt::Number* x, bool, Ipopt::Number*, Ipopt::Number*,
                          Ipopt::Index, bool, Ipopt::Number*) override {
    const auto first = relaxed_.start();
    for (std::size_t i = 0; i < 5; ++i)
      x[i] = i < 2 && levels_ ? std::floor(std::log2(first[i] / 0.3)) : first[i];
    return true;
  }
  bool eval_f(Ipopt::Index, const Ipopt::Number* x, bool, Ipopt::Number& f) override {
    f = relaxed_.objective(metres(x).data(), nullptr);
    return true;
  }
  bool eval_grad_f(Ipopt::Index, const Ipopt::Number* x, bool, Ipopt::Number* g) override {
    const auto y = metres(x);
    (void)relaxed_.objective(y.data(), g);
    chain(y, g);
    return true;
  }
  bool eval_g(Ipopt::Index, const Ipopt::Number* x, bool, Ipopt::Index, Ipopt::Number* g) override {
    g[0] = relaxed_.latency(metres(x).data(), nullptr);
    g[1] = x[0] - x[1];
    g[2] = x[2] - x[3];
    return true;
  }
  bool eval_jac_g(Ipopt::Index, const Ipopt::Number* x, bool, Ipopt::Index, Ipopt::Index, Ipopt::Index* row,
                  Ipopt::Index* column, Ipopt::Number* value) override {
    if (value == nullptr) {
      const std::array<int, 9> r{0, 0, 0, 0, 0, 1, 1, 2, 2};
      const std::array<int, 9> c{0, 1, 2, 3, 4, 0, 1, 2, 3};
      std::copy(r.begin(), r.end(), row);
      std::copy(c.begin(), c.end(), column);
      return true;
    }
    const auto y = metres(x);
    (void)relaxed_.latency(y.data(), value);
    chain(y, value);
    value[5] = value[7] = 1.0;
    value[6] = value[8] = -1.0;
    return true;
  }
  bool eval_h(Ipopt::Index, const Ipopt::Number*, bool, Ipopt::Number, Ipopt::Index, const Ipopt::Number*,
              bool, Ipopt::Index, Ipopt::Index*, Ipopt::Index*, Ipopt::Number*) override {
    return false;
  }
  bool get_variables_types(Ipopt::Index, VariableType* type) override {
    for (int i = 0; i < 5; ++i) type[i] = i < 2 ? INTEGER : CONTINUOUS;
    return true;
  }
  bool get_variables_linearity(Ipopt::Index n, Ipopt::TNLP::LinearityType* type) override {
    std::fill_n(type, n, Ipopt::TNLP::NON_LINEAR);
    return true;
  }
  bool get_constraints_linearity(Ipopt::Index, Ipopt::TNLP::LinearityType* type) override {
    type[0] = Ipopt::TNLP::NON_LINEAR;
    type[1] = type[2] = Ipopt::TNLP::LINEAR;
    return true;
  }
  void finalize_solution(SolverReturn, Ipopt::Index, const Ipopt::Number* x, Ipopt::Number) override {
    if (x != nullptr) answer = metres(x);
  }
  const SosInfo* sosConstraints() const override { return nullptr; }
  const BranchingInfo* branchingInfo() const override { return nullptr; }

  std::array<double, 5> answer{kInfinity, 0, 0, 0, 0};
  [[nodiscard]] std::array<double, 5> metres(const double* x) const {
    std::array<double, 5> y{};
    std::copy_n(x, 5, y.begin());
    if (levels_) {
      y[0] = 0.3 * std::exp2(x[0]);
      y[1] = 0.3 * std::exp2(x[1]);
    }
    return y;
  }

 private:
  void chain(const std::array<double, 5>& y, double* gradient) const {
    if (!levels_) return;
    gradient[0] *= y[0] * std::log(2.0);
    gradient[1] *= y[1] * std::log(2.0);
  }
  Relaxed relaxed_;
  bool levels_;
};

/// Ipopt wants the base class without the integer parts.
class Continuous : public Ipopt::TNLP {
 public:
  explicit Continuous(const Instance& n) : inner(new Tnlp(n, false)) {}
  bool get_nlp_info(Ipopt::Index& n, Ipopt::Index& m, Ipopt::Index& j, Ipopt::Index& h,
                    IndexStyleEnum& s) override {
    return inner->get_nlp_info(n, m, j, h, s);
  }
  bool get_bounds_info(Ipopt::Index n, Ipopt::Number* l, Ipopt::Number* u, Ipopt::Index m, Ipopt::Number* gl,
                       Ipopt::Number* gu) override {
    return inner->get_bounds_info(n, l, u, m, gl, gu);
  }
  bool get_starting_point(Ipopt::Index n, bool ix, Ipopt::Number* x, bool iz, Ipopt::Number* zl,
                          Ipopt::Number* zu, Ipopt::Index m, bool il, Ipopt::Number* l) override {
    return inner->get_starting_point(n, ix, x, iz, zl, zu, m, il, l);
  }
  bool eval_f(Ipopt::Index n, const Ipopt::Number* x, bool isnew, Ipopt::Number& f) override {
    return inner->eval_f(n, x, isnew, f);
  }
  bool eval_grad_f(Ipopt::Index n, const Ipopt::Number* x, bool isnew, Ipopt::Number* g) override {
    return inner->eval_grad_f(n, x, isnew, g);
  }
  bool eval_g(Ipopt::Index n, const Ipopt::Number* x, bool isnew, Ipopt::Index m, Ipopt::Number* g) override {
    return inner->eval_g(n, x, isnew, m, g);
  }
  bool eval_jac_g(Ipopt::Index n, const Ipopt::Number* x, bool isnew, Ipopt::Index m, Ipopt::Index k,
                  Ipopt::Index* r, Ipopt::Index* c, Ipopt::Number* v) override {
    return inner->eval_jac_g(n, x, isnew, m, k, r, c, v);
  }
  void finalize_solution(Ipopt::SolverReturn, Ipopt::Index, const Ipopt::Number* x, const Ipopt::Number*,
                         const Ipopt::Number*, Ipopt::Index, const Ipopt::Number*, const Ipopt::Number*,
                         Ipopt::Number, const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) override {
    inner->answer = inner->metres(x);
  }
  Ipopt::SmartPtr<Tnlp> inner;
};

Outcome run_ipopt(const Instance& n) {
  const double begin = now_us();
  Ipopt::SmartPtr<Ipopt::IpoptApplication> app = new Ipopt::IpoptApplication(false);
  app->Options()->SetIntegerValue("print_level", 0);
  app->Options()->SetStringValue("sb", "yes");
  app->Options()->SetStringValue("hessian_approximation", "limited-memory");
  Ipopt::SmartPtr<Continuous> problem = new Continuous(n);
  if (app->Initialize() == Ipopt::Solve_Succeeded) {
    Ipopt::SmartPtr<Ipopt::TNLP> base = Ipopt::GetRawPtr(problem);
    (void)app->OptimizeTNLP(base);
  }
  return judge(n, problem->inner->answer, now_us() - begin);
}

Outcome run_bonmin(const Instance& n) {
  const double begin = now_us();
  Ipopt::SmartPtr<Tnlp> problem = new Tnlp(n, true);
  try {
    Bonmin::BonminSetup setup;
    setup.initializeOptionsAndJournalist();
    setup.readOptionsString(
        "print_level 0\nsb yes\nbonmin.bb_log_level 0\nbonmin.nlp_log_level 0\nbonmin.lp_log_level 0\n"
        "bonmin.milp_log_level 0\nbonmin.algorithm B-BB\nhessian_approximation limited-memory\n");
    setup.initialize(Ipopt::GetRawPtr(problem));
    Bonmin::Bab search;
    search(setup);
  } catch (...) {
    // Counts as no answer.
  }
  return judge(n, problem->answer, now_us() - begin);
}

/// A peer in a process of its own, killed after kPatience_s: some never come back, whatever limit they are
/// given.
Outcome run_in_child(Outcome (*run)(const Instance&), const Instance& n) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) std::perror("pipe"), std::exit(2);
  const pid_t child = fork();
  if (child < 0) std::perror("fork"), std::exit(2);
  if (child == 0) {
    const Outcome o = run(n);
    _exit(write(ends[1], &o, sizeof o) == sizeof o ? 0 : 1);
  }
  close(ends[1]);
  Outcome o;
  pollfd answer{ends[0], POLLIN, 0};
  if (poll(&answer, 1, static_cast<int>(1e3 * kPatience_s)) != 1 || read(ends[0], &o, sizeof o) != sizeof o) {
    o = Outcome{};
    o.time_us = 1e6 * kPatience_s;
    o.unanswered = true;
  }
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  close(ends[0]);
  return o;
}

double quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

/// Instances on which all solvers can be compared: all numbers finite, and an answer exists.
std::vector<Instance> comparable(std::size_t count) {
  std::vector<Instance> instances;
  for (std::uint64_t number = 0; instances.size() < count; ++number) {
    const Instance n = instance_of(number);
    const SolverProblem& p = n.problem;
    const bool finite = p.delta_d_s > 0.01 && p.delta_d_s < 10.0 && std::isfinite(p.g_avg_m) &&
                        std::isfinite(p.d_obs_m) && p.v_sensor_m3 < 1e9 && p.v_map_m3 < 1e9 &&
                        p.v2_max_m3 < 1e9;
    bool same = true;
    for (std::size_t i = 0; i < 3; ++i)
      same = same && p.model[i].slope_s_per_m3 == from_eq4(n.eq4[i]).slope_s_per_m3;
    if (finite && same && solve(p).status == Status::kOk) instances.push_back(n);
  }
  return instances;
}

struct Row {
  const char* name;
  std::vector<double> time_us;
  int infeasible{};
  int late{};
  int unanswered{};
  int better{};
};

void print(const Row& row, const Row& ours) {
  const double n = static_cast<double>(row.time_us.size());
  fmt::print("{:<22} {:>11.2f} {:>12.1f} {:>10.1f} {:>10.1f} {:>10.1f} {:>8} {:>10.0f}\n", row.name,
             quantile(row.time_us, 0.5), quantile(row.time_us, 1.0), 100.0 * row.infeasible / n,
             100.0 * row.late / n, 100.0 * row.unanswered / n, row.better,
             quantile(row.time_us, 0.5) / quantile(ours.time_us, 0.5));
}

int count_instructions(std::uint64_t count) {
  for (std::uint64_t number = 0; number < count; ++number) {
    const Instance n = instance_of(number);
    CALLGRIND_ZERO_STATS;
    CALLGRIND_TOGGLE_COLLECT;
    const SolverSolution s = solve(n.problem);
    CALLGRIND_TOGGLE_COLLECT;
    CALLGRIND_DUMP_STATS_AT("solve");
    if (verify(n.problem, s) != Verdict::kAccepted) return 1;
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 3 && std::strcmp(argv[1], "--callgrind") == 0)
    return count_instructions(std::strtoull(argv[2], nullptr, 10));
  const std::uint64_t instances =
      argc == 3 && std::strcmp(argv[1], "--instances") == 0 ? std::strtoull(argv[2], nullptr, 10) : 1000000;

  std::uint64_t violations = 0;
  double worst_gap = 0.0;
  std::uint64_t answered = 0;
  for (std::uint64_t number = 0; number < instances; ++number) {
    const Instance n = instance_of(number);
    const SolverSolution s = solve(n.problem);
    if (verify(n.problem, s) != Verdict::kAccepted) ++violations;
    answered += s.status == Status::kOk ? 1 : 0;
    const double reference =
        exhaustive(n.problem, number % 50 == 0 ? 10 : 3);  // the dense one takes ten times as long
    if ((s.status == Status::kOk) != (reference < kInfinity)) ++violations;
    if (s.status == Status::kOk && reference < kInfinity)
      worst_gap = std::max(worst_gap, (s.objective_s2 - reference) / std::max(reference, 1e-12));
  }
  fmt::print(
      "{} instances, {} with an answer; {} not accepted by the checker; against an exhaustive search (4^3 "
      "volumes a pair, 11^3 "
      "in every 50th): objective above it by at most {:.2g}\n\n",
      instances, answered, violations, worst_gap);

  const std::vector<Instance> compared = comparable(200);
  Row ours{"roborun", {}};
  Row dense{"exhaustive, 11^3 grid", {}};
  std::vector<double> objective;
  double sink = 0.0;
  for (const Instance& n : compared) {
    constexpr int kRepeats = 200;
    const double begin = now_us();
    for (int i = 0; i < kRepeats; ++i) {
      SolverProblem p = n.problem;
      p.delta_d_s += 1e-15 * i;  // not to be taken out of the loop
      sink += solve(p).latency_s;
    }
    ours.time_us.push_back((now_us() - begin) / kRepeats);
    const SolverSolution s = solve(n.problem);
    objective.push_back(s.objective_s2);
    const Outcome o =
        judge(n, {PrecisionLattice{}.cell_size_m(s.p0_level), PrecisionLattice{}.cell_size_m(s.p1_level), s.v0_m3, s.v1_m3, s.v2_m3}, 0.0, false);
    ours.infeasible += o.infeasible ? 1 : 0;
    ours.late += o.late ? 1 : 0;
    const double dense_begin = now_us();
    sink += exhaustive(n.problem, 10);
    dense.time_us.push_back(now_us() - dense_begin);
  }
  const std::array<std::pair<const char*, Outcome (*)(const Instance&)>, 5> peers{
      {{"NLopt SLSQP", [](const Instance& n) { return run_nlopt(n, nlopt::LD_SLSQP); }},
       {"NLopt COBYLA", [](const Instance& n) { return run_nlopt(n, nlopt::LN_COBYLA); }},
       {"NLopt ISRES", [](const Instance& n) { return run_nlopt(n, nlopt::GN_ISRES); }},
       {"Ipopt", run_ipopt},
       {"Bonmin B-BB", run_bonmin}}};
  fmt::print("{:<22} {:>11} {:>12} {:>10} {:>10} {:>10} {:>8} {:>10}\n", "200 instances", "median us",
             "max us", "infeas. %", "late %", "none %", "better", "x roborun");
  print(ours, ours);
  print(dense, ours);
  double median_ratio_slsqp = 0.0;
  int slsqp_better = 0;
  for (const auto& [name, run] : peers) {
    Row row{name, {}};
    for (std::size_t i = 0; i < compared.size(); ++i) {
      const Outcome o = run_in_child(run, compared[i]);
      row.time_us.push_back(o.time_us);
      row.infeasible += o.infeasible ? 1 : 0;
      row.late += o.late ? 1 : 0;
      row.unanswered += o.unanswered ? 1 : 0;
      row.better += o.objective < objective[i] - 1e-9 * (1.0 + objective[i]) ? 1 : 0;
    }
    print(row, ours);
    std::fflush(stdout);
    if (std::strcmp(name, "NLopt SLSQP") != 0) continue;
    median_ratio_slsqp = quantile(row.time_us, 0.5) / quantile(ours.time_us, 0.5);
    slsqp_better = row.better;
  }
  fmt::print("(checksum {:.3f})\n", sink);
  const char* instructions = std::getenv("WORST_INSTRUCTIONS");
  fmt::print(
      R"({{"instances":{},"violations":{},"worst_gap":{:.3g},"worst_instructions":{},"median_ratio_slsqp":{:.1f},"slsqp_better":{}}})"
      "\n",
      instances, violations, std::max(worst_gap, 0.0), instructions != nullptr ? instructions : "null",
      median_ratio_slsqp, slsqp_better);
  return violations == 0 ? 0 : 1;
}
