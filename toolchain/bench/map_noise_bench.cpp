// The own map from images with errors, against the true world. Ends with one line of JSON: by sensor model the cells that are
// wrong after 1, 5, 10 and 20 scans.
#include <time.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "core/geometry/camera_pose.hpp"
#include "core/precision.hpp"
#include "core/random/counter_rng.hpp"
#include "platform/sitl/sensors/depth_camera.hpp"
#include "stages/perception/brick_map.hpp"
#include "toolchain/bench/map_scans.hpp"

namespace roborun::bench {
namespace {

constexpr int kScans = 20;
constexpr int kCounted = 3;  // scans of --count
constexpr std::uint16_t kPixels = 128;
constexpr double kCell_m = kPublishedCell_m;

struct Sensor {
  std::string name;
  CameraModel model;
  double range_m;
  double invalid_ratio;
  bool harsh;  ///< See harsh_image(); poses are wrong by 5 cm and 1 degree, one sigma each axis.
  [[nodiscard]] bool is_perfect() const { return name.rfind("perfect", 0) == 0; }
};

double cpu_s() {
  timespec t{};
  (void)clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double normal(core::CounterRng& rng, double sigma) { return sigma * rng.normal(); }

/// The pillars of the map benchmark, and poles of 5 cm, 5 m beside the way.
sitl::World world_with_poles() {
  sitl::WorldDescription d;
  d.bounds_W = pillar_world().bounds_W();
  d.start_W = pillar_world().start_W();
  d.goal_W = pillar_world().goal_W();
  d.pillars = pillar_world().pillars();
  for (int i = 0; i < 6; ++i)
    for (const double y_m : {-4.8, 5.2}) d.pillars.push_back({2.5 + 3.0 * i, y_m, 0.025, 0.0, 12.0});
  return sitl::World(std::move(d));
}
constexpr std::size_t kPoles = 12;

/// Of a vehicle that flies 1 m/s along x, turning slowly.
Pose X_WB_at(double time_s) {
  const double yaw_rad = 0.15 + 0.06 * time_s;
  return {(Eigen::AngleAxisd(yaw_rad, Vector3::UnitZ()) * Eigen::AngleAxisd(0.08, Vector3::UnitY()) *
           Eigen::AngleAxisd(-0.05, Vector3::UnitX()))
              .toRotationMatrix(),
          Vector3(time_s, 0.2, 5.0)};
}

Pose shaken(const Pose& X, core::CounterRng& rng) {
  const Vector3 axis(normal(rng, 1.0), normal(rng, 1.0), normal(rng, 1.0));
  const double degree = core::kPi / 180.0;
  const Vector3 p(normal(rng, 0.05), normal(rng, 0.05), normal(rng, 0.05));
  return {X.R_RT * Eigen::AngleAxisd(degree * axis.norm(), axis.normalized()).toRotationMatrix(), X.p_RT + p};
}

/// Sigma 0.01 + 0.0015 d^2; 3 of 10 pixels at a step of more than 1 m between both sides; 5 % invalid, one by one.
void harsh_image(std::vector<float>& depth_m, core::CounterRng& rng) {
  const std::vector<float> true_m = depth_m;
  for (std::size_t i = 0; i < depth_m.size(); ++i) {
    const double lost = rng.uniform(), flying = rng.uniform(), share = rng.uniform(), noise = rng.normal();
    double z_m = static_cast<double>(true_m[i]);
    for (const std::size_t beside : {i + 1, i + kPixels}) {
      if (beside >= true_m.size() || flying > 0.3) continue;
      const double other_m = std::fmin(static_cast<double>(true_m[beside]), 40.0);
      if (std::fabs(other_m - std::fmin(z_m, 40.0)) > 1.0) z_m = std::fmin(z_m, 40.0) + share * (other_m - std::fmin(z_m, 40.0));
    }
    z_m += noise * (0.01 + 0.0015 * z_m * z_m);
    depth_m[i] = lost < 0.05 ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(z_m);
  }
}

class Run {
 public:
  Run(const sitl::World& world, const Sensor& sensor) : world_(world), sensor_(sensor), rng_(7) {
    config_.bounds_W = {Vector3(-40, -40, -9.6), Vector3(60, 40, 45)};
    config_.max_image_width = config_.max_image_height = kPixels;
    block_.resize(stages::BrickMap::arena_bytes(config_));
    arena_ = std::make_unique<core::Arena>(block_);
    map_ = std::make_unique<stages::BrickMap>(config_, *arena_);
    if (arena_->exhausted()) std::abort();
    const SensorRig rig = six_cameras(kPixels, sensor.range_m);
    for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
      CameraSpec spec = rig.cameras[i];
      spec.rate_Hz = 1.0;
      spec.latency_s = 0.0;
      const sitl::DepthNoise none{0.0, 0.0, 0.0, 0.0};
      truth_.push_back(std::make_unique<sitl::SimulatedDepthCamera>(world, spec, camera_mount(spec.mount), none, 1,
                                                                    static_cast<std::uint32_t>(i)));
      spec.model = sensor.model;
      spec.invalid_ratio = sensor.invalid_ratio;
      camera_.push_back(std::make_unique<sitl::SimulatedDepthCamera>(
          world, spec, camera_mount(spec.mount), sensor.harsh || sensor.is_perfect() ? none : clean_noise(), 1,
          static_cast<std::uint32_t>(i)));
    }
  }
  static sitl::DepthNoise clean_noise() {
    sitl::DepthNoise noise;
    noise.frame_dropout_ratio = 0.0;
    return noise;
  }

  void scan(int n) {
    const MonotonicTime now = MonotonicTime{} + n * Nanos{1'000'000'000};
    const Pose X_WB = X_WB_at(n);
    // What the vehicle believes of where it is.
    const Pose error = sensor_.harsh ? shaken({}, rng_) : Pose{};
    std::array<std::vector<float>, 6> image;
    std::vector<stages::PosedDepthFrame> frames;
    for (std::size_t c = 0; c < camera_.size(); ++c) {
      firmware_if::DepthFrame frame;
      truth_[c]->expose(now, X_WB);
      if (truth_[c]->read(frame) == Status::kOk) remember(frame, core::camera_pose(X_WB, truth_[c]->mount()));
      camera_[c]->expose(now, X_WB);
      camera_[c]->expose(now + Nanos{500'000'000}, X_WB);
      if (camera_[c]->read(frame) != Status::kOk) continue;
      image[c].assign(frame.depth_m.begin(), frame.depth_m.end());
      if (sensor_.harsh) harsh_image(image[c], rng_);
      frame.depth_m = image[c];
      Pose X_then = X_WB_at(seconds(frame.stamp.time_since_epoch()));
      X_then = {X_then.R_RT * error.R_RT, X_then.p_RT + error.p_RT};
      stages::PosedDepthFrame posed;
      posed.frame = frame;
      posed.error = sensor_.harsh ? DepthError{0.01, 0.0015, 0.05, core::kPi / 180.0, true} : sensor_.name == "perfect" ? DepthError{0.0, 0.0} : depth_error(sensor_.model);
      posed.X_WC = core::camera_pose(X_then, camera_[c]->mount());
      frames.push_back(posed);
    }
    const std::array<Vector3, 1> here{X_WB.p_RT};
    core::UnlimitedBudget unlimited;
    stages::IntegrationResult result;
    const double begin_s = cpu_s();
    (void)map_->integrate({frames, 0, std::numeric_limits<double>::infinity(), here}, unlimited, result);
    ms_.push_back(1e3 * (cpu_s() - begin_s));
    core::Work work;
    (void)map_->export_view({0, std::numeric_limits<double>::infinity(), Vector3::Zero()}, unlimited, work);
    refused_ += result.frames_refused;
  }

  struct Verdict {
    std::size_t free{}, false_free{}, deep{}, occupied{}, false_occupied{}, seen{}, missed{}, surface_free{}, pole_cells{}, pole_kept{};
  };
  [[nodiscard]] Verdict judge() const {
    Verdict v;
    std::uint64_t lookups = 0;
    const stages::MapView& view = map_->view();
    const auto state = [&](const Vector3& p_W) { return view.at(p_W, lookups); };
    const double reach_m = sensor_.range_m;
    for (double z = -0.45; z < 5.0 + reach_m; z += kCell_m)
      for (double y = -reach_m + 0.15; y < reach_m; y += kCell_m)
        for (double x = -reach_m + 0.15; x < kScans + reach_m; x += kCell_m) {
          const Vector3 p_W(x, y, z);
          const stages::CellState s = state(p_W);
          if (s == stages::CellState::kFree) {
            ++v.free;
            if (!is_solid(world_, p_W)) continue;
            ++v.false_free;
            bool deep = true;
            for (int axis = 0; axis < 3 && deep; ++axis)
              for (const double step_m : {-kCell_m, kCell_m})
                deep = deep && is_solid(world_, p_W + step_m * Vector3::Unit(axis));
            v.deep += deep ? 1U : 0U;
          } else if (s == stages::CellState::kOccupied) {
            ++v.occupied;
            v.false_occupied += z > 0.6 && world_.clearance_m(p_W, 0.7) > 0.6 ? 1U : 0U;
          }
        }
    const auto occupied_at = [&](const Vector3& p_W) {
      if (state(p_W) == stages::CellState::kOccupied) return true;
      for (int axis = 0; axis < 3; ++axis)
        for (const double step_m : {-kCell_m, kCell_m})
          if (state(p_W + step_m * Vector3::Unit(axis)) == stages::CellState::kOccupied) return true;
      return false;
    };
    v.seen = surface_.size();
    for (const auto& [x, y, z] : surface_) {
      const Vector3 p_W = kCell_m * (Vector3(x, y, z) + Vector3::Constant(0.5));
      v.missed += occupied_at(p_W) ? 0U : 1U;
      v.surface_free += state(p_W) == stages::CellState::kFree && !occupied_at(p_W) ? 1U : 0U;
    }
    const auto& pillars = world_.pillars();
    for (std::size_t i = pillars.size() - kPoles; i < pillars.size(); ++i)
      for (double z = 3.15; z < 7.0; z += kCell_m) {
        ++v.pole_cells;
        v.pole_kept += state(Vector3(pillars[i].x_m, pillars[i].y_m, z)) == stages::CellState::kOccupied ? 1U : 0U;
      }
    return v;
  }
  /// Processor time of a scan, median.
  [[nodiscard]] double ms() const {
    std::vector<double> ms = ms_;
    std::nth_element(ms.begin(), ms.begin() + static_cast<std::ptrdiff_t>(ms.size() / 2), ms.end());
    return ms[ms.size() / 2];
  }
  [[nodiscard]] std::uint32_t refused() const noexcept { return refused_; }

 private:
  /// Cells with a surface that a perfect image of this place shows.
  void remember(const firmware_if::DepthFrame& frame, const Pose& X_WC) {
    for (int v = 0; v < frame.height; ++v)
      for (int u = 0; u < frame.width; ++u) {
        const double z_m = static_cast<double>(frame.depth_m[static_cast<std::size_t>(v * frame.width + u)]);
        if (!(z_m < 0.95 * sensor_.range_m)) continue;
        const Vector3 p_W = X_WC * (z_m * Vector3(1.0, 1.0 - (u + 0.5) * 2.0 / frame.width, 1.0 - (v + 0.5) * 2.0 / frame.height));
        surface_.emplace(static_cast<int>(std::floor(p_W.x() / kCell_m)), static_cast<int>(std::floor(p_W.y() / kCell_m)),
                         static_cast<int>(std::floor(p_W.z() / kCell_m)));
      }
  }

  const sitl::World& world_;
  const Sensor& sensor_;
  core::CounterRng rng_;
  stages::BrickMap::Config config_;
  std::vector<std::byte> block_;
  std::unique_ptr<core::Arena> arena_;
  std::unique_ptr<stages::BrickMap> map_;
  std::vector<std::unique_ptr<sitl::SimulatedDepthCamera>> truth_, camera_;
  std::set<std::tuple<int, int, int>> surface_;
  std::uint32_t refused_{0};
  std::vector<double> ms_;
};

}  // namespace
}  // namespace roborun::bench

int main(int argc, char** argv) {
  using namespace roborun;
  using namespace roborun::bench;
  const sitl::World world = world_with_poles();
  const std::vector<Sensor> sensors{{"perfect", CameraModel::kClean, 20.0, 0.0, false},
                                    {"perfect-10", CameraModel::kClean, 10.0, 0.0, false},
                                    {"clean", CameraModel::kClean, 20.0, 0.0, false},
                                    {"clean-10", CameraModel::kClean, 10.0, 0.0, false},
                                    {"harsh", CameraModel::kClean, 20.0, 0.0, true},
                                    {"d435", CameraModel::kD435, 10.0, 0.1, false},
                                    {"d455", CameraModel::kD455, 10.0, 0.1, false},
                                    {"d455-30", CameraModel::kD455, 10.0, 0.3, false},
                                    {"oak-d", CameraModel::kOakD, 10.0, 0.1, false},
                                    {"tof", CameraModel::kTof, 5.0, 0.1, false}};
  if (argc == 3 && std::string(argv[1]) == "--count") {
    for (const Sensor& sensor : sensors) {
      if (sensor.name != argv[2]) continue;
      Run run(world, sensor);
      for (int n = 0; n < kCounted; ++n) run.scan(n);
      return 0;
    }
  }
  if (argc != 1) {
    std::fprintf(stderr, "bench_map_noise: must be called without arguments, or with --count and a sensor of its table\n");
    return 2;
  }
  std::printf("%-10s %5s %9s %10s %5s %9s %14s %9s %9s %8s %14s %8s %8s\n", "sensor", "scans", "free", "false free", "deep", "occupied",
              "false occupied", "surface", "missed", "as free", "poles kept", "refused", "ms");
  std::string json;
  for (const Sensor& sensor : sensors) {
    Run run(world, sensor);
    json += (json.empty() ? "{\"" : ",\"") + sensor.name + "\":[";
    for (int n = 0; n < kScans; ++n) {
      run.scan(n);
      if (n != 0 && n != 4 && n != 9 && n != kScans - 1) continue;
      const Run::Verdict v = run.judge();
      std::printf("%-10s %5d %9zu %10zu %5zu %9zu %14zu %9zu %9zu %8zu %7zu of %zu %8u %8.2f\n", sensor.name.c_str(), n + 1, v.free,
                  v.false_free, v.deep, v.occupied, v.false_occupied, v.seen, v.missed, v.surface_free, v.pole_kept, v.pole_cells,
                  run.refused(), run.ms());
      std::fflush(stdout);
      char text[320];
      std::snprintf(text, sizeof text,
                    "%s{\"scans\":%d,\"free\":%zu,\"false_free\":%zu,\"false_free_deep\":%zu,\"occupied\":%zu,"
                    "\"false_occupied\":%zu,\"surface\":%zu,\"missed\":%zu,\"missed_as_free\":%zu,\"poles_kept_ratio\":%.3f,\"ms\":%.3f}",
                    n == 0 ? "" : ",", n + 1, v.free, v.false_free, v.deep, v.occupied, v.false_occupied, v.seen, v.missed, v.surface_free,
                    static_cast<double>(v.pole_kept) / static_cast<double>(v.pole_cells), run.ms());
      json += text;
    }
    json += "]";
  }
  std::printf("%s}\n", json.c_str());
  return 0;
}
