// Our minimum snap beside the textbook form of the same problem with dense matrices. The last line of output is JSON.
#include <Eigen/LU>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <vector>

#include "core/random/counter_rng.hpp"
#include "stages/planning/smoother.hpp"
#include "tests/support/box_view.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace {

using namespace roborun;
using namespace roborun::stages;

constexpr int kCases = 300;
constexpr int kRepeats = 20;

double cpu_us() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

struct Case {
  std::vector<Vector3> knot_W;
  std::vector<double> time_s;
  TrajectoryPoint start;
};

/// A path of winding pieces of 2 to 8 m, flown at about 4 m/s, from a moving start.
Case case_of(std::size_t segments, std::uint64_t number) {
  core::CounterRng rng(number, segments);
  Case c;
  Vector3 heading(1, 0, 0);
  c.knot_W.push_back(Vector3::Zero());
  c.time_s.push_back(0.0);
  for (std::size_t k = 0; k < segments; ++k) {
    heading = (heading + Vector3(rng.uniform(-0.8, 0.8), rng.uniform(-0.8, 0.8), rng.uniform(-0.2, 0.2))).normalized();
    const double length_m = rng.uniform(2.0, 8.0);
    c.knot_W.push_back(c.knot_W.back() + length_m * heading);
    c.time_s.push_back(length_m / rng.uniform(3.0, 5.0));
  }
  c.start.p_W = c.knot_W[0];
  c.start.v_W = 3.0 * (c.knot_W[1] - c.knot_W[0]).normalized();
  c.start.a_W = Vector3(rng.uniform(-1, 1), rng.uniform(-1, 1), 0);
  return c;
}

/// The unconstrained form of Richter et al. with dense matrices: cost of each segment's end derivatives A^-T Q A^-1, summed
/// into one matrix over all derivatives, the fixed ones first, and the free ones from its lower block by LU.
class DenseReference {
 public:
  void solve(const Case& c) {
    const auto segments = static_cast<Eigen::Index>(c.knot_W.size()) - 1;
    const Eigen::Index free_count = 4 * (segments - 1);
    const Eigen::Index fixed_count = 5 * (segments + 1) - free_count;
    std::vector<Eigen::Index> place(static_cast<std::size_t>(5 * (segments + 1)));
    Eigen::Index next_fixed = 0, next_free = fixed_count;
    for (Eigen::Index k = 0; k <= segments; ++k) {
      for (Eigen::Index d = 0; d < 5; ++d)
        place[static_cast<std::size_t>(5 * k + d)] = d == 0 || k == 0 || k == segments ? next_fixed++ : next_free++;
    }
    Eigen::MatrixXd R = Eigen::MatrixXd::Zero(fixed_count + free_count, fixed_count + free_count);
    Eigen::MatrixXd derivatives = Eigen::MatrixXd::Zero(fixed_count + free_count, 3);
    std::vector<Eigen::MatrixXd> inverse(static_cast<std::size_t>(segments));
    for (Eigen::Index s = 0; s < segments; ++s) {
      const double T = c.time_s[static_cast<std::size_t>(s) + 1];
      Eigen::MatrixXd A = Eigen::MatrixXd::Zero(10, 10), Q = Eigen::MatrixXd::Zero(10, 10);
      for (int d = 0; d < 5; ++d) {
        for (int k = d; k < 10; ++k) {
          double product = 1.0;
          for (int i = 0; i < d; ++i) product *= k - i;
          if (k == d) A(d, k) = product;
          A(5 + d, k) = product * std::pow(T, k - d);
        }
      }
      for (int i = 4; i < 10; ++i) {
        for (int k = 4; k < 10; ++k) {
          double product = 1.0;
          for (int d = 0; d < 4; ++d) product *= (i - d) * (k - d);
          Q(i, k) = product * std::pow(T, i + k - 7) / (i + k - 7);
        }
      }
      inverse[static_cast<std::size_t>(s)] = A.partialPivLu().inverse();
      const Eigen::MatrixXd& B = inverse[static_cast<std::size_t>(s)];
      const Eigen::MatrixXd H = B.transpose() * Q * B;
      for (Eigen::Index i = 0; i < 10; ++i) {
        for (Eigen::Index k = 0; k < 10; ++k)
          R(place[static_cast<std::size_t>(5 * s + i)], place[static_cast<std::size_t>(5 * s + k)]) += H(i, k);
      }
    }
    for (Eigen::Index k = 0; k <= segments; ++k)
      derivatives.row(place[static_cast<std::size_t>(5 * k)]) = c.knot_W[static_cast<std::size_t>(k)].transpose();
    derivatives.row(place[1]) = c.start.v_W.transpose();
    derivatives.row(place[2]) = c.start.a_W.transpose();
    derivatives.row(place[3]) = c.start.j_W.transpose();
    const Eigen::MatrixXd Rpp = R.bottomRightCorner(free_count, free_count);
    const Eigen::MatrixXd Rpf = R.bottomLeftCorner(free_count, fixed_count);
    derivatives.bottomRows(free_count) = -Rpp.partialPivLu().solve(Rpf * derivatives.topRows(fixed_count));
    coefficient.resize(static_cast<std::size_t>(segments));
    for (Eigen::Index s = 0; s < segments; ++s) {
      Eigen::MatrixXd ends(10, 3);
      for (Eigen::Index i = 0; i < 10; ++i) ends.row(i) = derivatives.row(place[static_cast<std::size_t>(5 * s + i)]);
      coefficient[static_cast<std::size_t>(s)] = inverse[static_cast<std::size_t>(s)] * ends;
    }
  }
  std::vector<Eigen::MatrixXd> coefficient;
};

/// Largest difference of position between both answers, metres.
double difference_m(const Case& c, const Trajectory& t, const DenseReference& dense) {
  double worst_m = 0.0;
  for (std::size_t k = 0; k < t.segment_count; ++k) {
    for (double share = 0.0; share <= 1.0; share += 0.125) {
      const double at_s = share * c.time_s[k + 1];
      Vector3 ours = Vector3::Zero(), theirs = Vector3::Zero();
      double power = 1.0;
      for (std::size_t i = 0; i < 10; ++i, power *= at_s) {
        ours += power * t.segment[k].coefficient[i];
        theirs += power * dense.coefficient[k].row(static_cast<Eigen::Index>(i)).transpose();
      }
      worst_m = std::max(worst_m, (ours - theirs).norm());
    }
  }
  return worst_m;
}

template <typename Function>
double time_us(Function&& run) {
  const double begin_us = cpu_us();
  for (int i = 0; i < kRepeats; ++i) run();
  return (cpu_us() - begin_us) / kRepeats;
}

double quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(std::ceil(q * static_cast<double>(values.size() - 1)))];
}

void print(const char* name, std::size_t segments, const std::vector<double>& us) {
  fmt::print("{:<44} {:>8} {:>10.2f} {:>10.2f}\n", name, segments, quantile(us, 0.5), quantile(us, 0.9));
}

}  // namespace

int main() {
  const MinimumSnap sut;
  Smoother smoother;
  DenseReference dense;
  test::BoxView open;
  open.free_W = {Vector3::Constant(-1e4), Vector3::Constant(1e4)};
  core::UnlimitedBudget unlimited;
  fmt::print("{:<44} {:>8} {:>10} {:>10}\n", "", "segments", "median us", "p90 us");
  std::array<double, 2> median_us{};
  double worst_m = 0.0;
  std::uint64_t allocations = 0;
  for (const std::size_t i : {0U, 1U}) {
    const std::size_t segments = i == 0 ? 10 : 20;
    std::vector<double> ours_us, dense_us, smooth_us;
    for (std::vector<double>* us : {&ours_us, &dense_us, &smooth_us}) us->reserve(kCases);
    std::size_t flown = 0;
    for (std::uint64_t n = 0; n < kCases; ++n) {
      const Case c = case_of(segments, n);
      static Trajectory t;
      static SmoothResult result;
      const test::NoAllocScope scope;
      ours_us.push_back(time_us([&] {
        if (!sut.solve(c.knot_W, c.time_s, c.start, t)) std::abort();
      }));
      SmoothRequest request;
      request.path_W = {c.knot_W.data(), segments / 3 + 1};
      request.start = c.start;
      request.radius_m = 0.9;
      std::size_t count = 0;
      const double us = time_us([&] {
        count = smoother.smooth(request, open, unlimited, result) == Status::kOk ? result.trajectory.segment_count : 0;
      });
      allocations += scope.count();
      if (count > 0) smooth_us.push_back(us);
      flown += count;
      dense_us.push_back(time_us([&] { dense.solve(c); }));
      worst_m = std::max(worst_m, difference_m(c, t, dense));
    }
    print("roborun, closed form", segments, ours_us);
    print("dense matrices, LU (Eigen, not vectorised)", segments, dense_us);
    print("roborun, whole smoother in open space", flown / std::max<std::size_t>(smooth_us.size(), 1), smooth_us);
    median_us[i] = quantile(ours_us, 0.5);
  }
  fmt::print("largest difference between both: {:.1e} m; {} allocations\n", worst_m, allocations);
  fmt::print(R"({{"us_10_segments":{:.2f},"us_20_segments":{:.2f}}})" "\n", median_us[0], median_us[1]);
  return worst_m < 1e-5 && allocations == 0 ? 0 : 1;
}
