// How long the smoother's trajectories last beside what no trajectory along the path can beat, and what they cost. The last
// line of output is JSON.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

#include "stages/planning/rrt_star.hpp"
#include "stages/planning/smoother.hpp"
#include "tests/support/no_alloc_scope.hpp"
#include "toolchain/bench/planner_problems.hpp"

namespace {

using namespace roborun;
using namespace roborun::stages;

constexpr std::uint64_t kProblems = 100;
constexpr int kRepeats = 10;
constexpr double kCornerRoom_m = 0.25;  // as the pipeline plans
constexpr MotionLimits kLimits{};

double cpu_us() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(std::ceil(q * static_cast<double>(values.size() - 1)))];
}

/// In free space, apart from all that is not, told without the map's own questions.
bool is_ball_apart(const test::BoxView& view, const Vector3& p_W, double radius_m) {
  const Aabb box_W = Aabb::around(p_W, radius_m);
  return view.free_W.contains(box_W.min_W) && view.free_W.contains(box_W.max_W) &&
         std::none_of(view.occupied.begin(), view.occupied.end(), [&](const Aabb& o) {
           return (p_W - p_W.cwiseMax(o.min_W).cwiseMin(o.max_W)).norm() < radius_m;
         });
}

struct Scene {
  std::string name;
  int count{}, none{}, parts{}, corners{};
  std::vector<double> ratio, us;
  std::uint64_t allocations{}, beyond{}, collisions{};
};

class Own {
 public:
  Own() : block_(RrtStar::arena_bytes(config())), arena_(block_), planner_(config(), arena_) {}
  [[nodiscard]] bool plan(bench::Problem p, PlanResult& result) {
    for (const double room_m : {kCornerRoom_m, 0.0}) {
      core::UnlimitedBudget unlimited;
      PlanRequest request = p.request;
      request.radius_m += room_m;
      if (planner_.plan(request, p.view, unlimited, result) == Status::kOk && result.reaches_goal)
        return true;
    }
    return false;
  }

 private:
  static RrtStar::Config config() { return {}; }
  std::vector<std::byte> block_;
  core::Arena arena_;
  RrtStar planner_;
};

void check(const Trajectory& t, Scene& scene) {
  for (double s = 0.0; s < t.duration_s(); s += 0.001) {
    const TrajectoryPoint p = t.at_s(s);
    const bool ok = p.v_W.norm() <= kLimits.speed_mps * 1.0001 &&
                    p.a_W.norm() <= kLimits.acceleration_mps2 * 1.0001 &&
                    p.j_W.norm() <= kLimits.jerk_mps3 * 1.001;
    scene.beyond += ok ? 0U : 1U;
  }
}

void fly(const bench::Problem& p, const PlanResult& planned, Smoother& sut, Scene& scene) {
  SmoothRequest request;
  request.path_W = {planned.path_W.begin(), planned.path_W.size()};
  request.start.p_W = planned.path_W[0];
  request.limits = kLimits;
  request.radius_m = p.request.radius_m;
  core::UnlimitedBudget unlimited;
  static SmoothResult result;
  Status status{};
  double us = 0.0;
  {
    const test::NoAllocScope scope;
    const double begin_us = cpu_us();
    for (int i = 0; i < kRepeats; ++i) status = sut.smooth(request, p.view, unlimited, result);
    us = (cpu_us() - begin_us) / kRepeats;
    scene.allocations += scope.count();
  }
  scene.us.push_back(us);
  ++scene.count;
  const Trajectory& t = result.trajectory;
  if (status != Status::kOk) {
    ++scene.none;
    return;
  }
  // A path of many corners is flown in parts: the length up to the corner where this part ends.
  double length_m = 0.0;
  std::size_t i = 0;
  for (; i + 1 < planned.path_W.size() && (t.end_W() - planned.path_W[i]).norm() > 1e-6; ++i)
    length_m += (planned.path_W[i + 1] - planned.path_W[i]).norm();
  scene.parts += i + 1 < planned.path_W.size() ? 1 : 0;
  scene.corners += static_cast<int>(i);
  scene.ratio.push_back(t.duration_s() /
                        (length_m / kLimits.speed_mps + kLimits.speed_mps / kLimits.acceleration_mps2));
  check(t, scene);
  for (double s = 0.0; s < t.duration_s(); s += 0.01)
    scene.collisions +=
        is_ball_apart(p.view, t.at_s(s).p_W, request.radius_m - 0.02) ? 0U : 1U;
}

}  // namespace

int main() {
  Smoother sut;
  Own planner;
  std::uint64_t allocations = 0, beyond = 0;
  std::string json;
  fmt::print("{:<12} {:>6} {:>6} {:>6} {:>6} {:>8} {:>6} {:>6} {:>8} {:>6} {:>6} {:>7}\n", "", "paths",
             "none", "parts", "legs", "median", "p90", "max", "us", "p90", "max", "beyond");
  for (const char* name : {"pillars60", "pillars150", "forest", "windows"}) {
    Scene scene{.name = name, .ratio = {}, .us = {}};
    for (std::uint64_t n = 0; n < kProblems; ++n) {
      const bench::Problem p = bench::problem_of(name, n);
      PlanResult planned;
      if (!planner.plan(p, planned)) continue;
      fly(p, planned, sut, scene);
    }
    const auto r = [&](double q) { return quantile(scene.ratio, q); };
    const auto us = [&](double q) { return quantile(scene.us, q); };
    fmt::print("{:<12} {:>6} {:>6} {:>6} {:>6} {:>8.3f} {:>6.2f} {:>6.2f} {:>8.1f} {:>6.1f} {:>6.1f} {:>7}\n",
               name, scene.count, scene.none, scene.parts, scene.corners, r(0.5), r(0.9), r(1.0), us(0.5),
               us(0.9), us(1.0), scene.beyond);
    if (scene.collisions > 0) fmt::print("{} instants not free\n", scene.collisions);
    json += fmt::format(R"("{}_ratio":{:.3f},"{}_us":{:.1f},)", name, r(0.5), name, us(0.5));
    allocations += scene.allocations;
    beyond += scene.beyond + scene.collisions;
  }
  fmt::print("{{{}\"beyond_limits\":{},\"allocations\":{}}}\n", json, beyond, allocations);
  return allocations == 0 && beyond == 0 ? 0 : 1;
}
