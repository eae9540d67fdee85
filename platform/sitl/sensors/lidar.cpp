#include "platform/sitl/sensors/lidar.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "core/geometry/camera_pose.hpp"
#include "core/geometry/math.hpp"
#include "core/random/counter_rng.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/text_file.hpp"

namespace roborun::sitl {
namespace {

constexpr std::uint64_t kStream = 0x100;  // the cameras' are 0 .. 7
constexpr std::size_t kMostRays = 65536;

Vector3 direction(const LidarRay& ray) noexcept {
  const double level = core::cos(ray.elevation_deg * core::kDegree);
  return {level * core::cos(ray.azimuth_deg * core::kDegree),
          level * core::sin(ray.azimuth_deg * core::kDegree), core::sin(ray.elevation_deg * core::kDegree)};
}

}  // namespace

std::vector<LidarRay> load_lidar_pattern(const std::string& path) {
  std::istringstream text(input::read_text(path, "a readable file of lines 'azimuth_deg elevation_deg'"));
  std::vector<LidarRay> rays;
  std::string line;
  for (int number = 1; std::getline(text, line); ++number) {
    const auto refuse = [&](const char* why) {
      throw InputError(fmt::format("{}:{}: {}", path, number, why));
    };
    if (const auto comment = line.find('#'); comment != std::string::npos) line.resize(comment);
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    std::istringstream fields(line);
    LidarRay ray;
    std::string more;
    if (!(fields >> ray.azimuth_deg >> ray.elevation_deg) || fields >> more)
      refuse("must be two numbers: azimuth_deg elevation_deg");
    if (!(std::fabs(ray.azimuth_deg) <= 360.0 && std::fabs(ray.elevation_deg) <= 90.0))
      refuse("azimuth_deg must be from -360 to 360, elevation_deg from -90 to 90");
    if (rays.size() == kMostRays) refuse("must be at most 65,536 rays");
    rays.push_back(ray);
  }
  if (rays.size() < 16) throw InputError(fmt::format("{}: must be at least 16 rays", path));
  return rays;
}

LidarSpec spec_of(const std::vector<LidarRay>& pattern, const LidarSpec& rest) {
  LidarSpec spec = rest;
  spec.lowest_deg = 90.0;
  spec.highest_deg = -90.0;
  for (const LidarRay& ray : pattern) {
    spec.lowest_deg = std::min(spec.lowest_deg, ray.elevation_deg);
    spec.highest_deg = std::max(spec.highest_deg, ray.elevation_deg);
  }
  // As dense as rings and columns of the same number in both directions.
  const double band_deg = std::max(spec.highest_deg - spec.lowest_deg, 0.1);
  const double step_deg =
      std::sqrt(360.0 * band_deg / static_cast<double>(std::max<std::size_t>(pattern.size(), 1)));
  spec.columns = static_cast<std::uint16_t>(std::clamp(360.0 / step_deg, 16.0, 4096.0));
  spec.rings = static_cast<std::uint16_t>(std::clamp(1.0 + band_deg / step_deg, 1.0, 256.0));
  return spec;
}

SimulatedLidar::SimulatedLidar(const World& world, const LidarSpec& spec,
                               const std::vector<LidarRay>& pattern, const LidarNoise& noise,
                               std::uint64_t seed, std::uint32_t lidar)
    : world_(world),
      spec_(spec),
      noise_(noise),
      seed_(seed),
      lidar_(lidar),
      exposures_({spec.rate_Hz, spec.latency_s, noise.sweep_dropout_ratio, seed, 0x2000U + lidar,
                  spec.model == LidarModel::kClean ? TimingErrors{} : errors_of(spec.model).timing},
                 camera_mount(spec.mount)) {
  for (const LidarRay& ray : pattern) ray_L_.push_back(direction(ray));
  for (int ring = 0; pattern.empty() && ring < spec.rings; ++ring) {
    const double share = spec.rings > 1 ? static_cast<double>(ring) / (spec.rings - 1) : 0.5;
    const double elevation_deg = spec.lowest_deg + share * (spec.highest_deg - spec.lowest_deg);
    for (int column = 0; column < spec.columns; ++column)
      ray_L_.push_back(direction({360.0 * column / spec.columns, elevation_deg}));
  }
  point_L_m_.resize(ray_L_.size());
  if (spec.model == LidarModel::kClean) return;
  effects_.emplace(errors_of(spec.model), noise.rain_mmph, seed, lidar);
  columns_ = pattern.empty() ? spec.columns : ray_L_.size();
  ring_step_rad_ =
      spec.rings > 1 ? (spec.highest_deg - spec.lowest_deg) / (spec.rings - 1) * core::kPi / 180.0 : 0.0;
  motion_.resize(Exposures::kRing);
}

void SimulatedLidar::expose(MonotonicTime now, const Pose& X_WB) noexcept {
  if (effects_) remember(now, X_WB);
  const bool taken = exposures_.expose(now, X_WB);
  if (!taken || !effects_) return;
  SweepMotion& motion = motion_[exposures_.taken() % Exposures::kRing];
  motion = recent_;
  // A sweep ends with where the vehicle is now; the knots before it are those of whole parts of a turn.
  motion.X_WL.back() = X_WB;
  for (Pose& X : motion.X_WL) X = effects_->true_pose(core::camera_pose(X, mount()));
}

void SimulatedLidar::remember(MonotonicTime now, const Pose& X_WB) noexcept {
  if (now < next_knot_) return;
  auto& knots = recent_.X_WL;
  if (next_knot_ == MonotonicTime{}) {
    knots.fill(X_WB);
    next_knot_ = now;
  }
  next_knot_ += from_seconds(1.0 / (spec_.rate_Hz * (SweepMotion::kKnots - 1)));
  std::copy(knots.begin() + 1, knots.end(), knots.begin());
  knots.back() = X_WB;
}

Status SimulatedLidar::read(firmware_if::LidarSweep& sweep) noexcept {
  const Exposure* e = exposures_.take();
  if (e == nullptr) return Status::kNotReady;
  if (effects_)
    cast_product(*e, *effects_);
  else
    cast(*e);
  sweep = {e->said, e->sequence, static_cast<float>(spec_.range_min_m), static_cast<float>(spec_.range_m),
           std::span(point_L_m_).first(points_)};
  return Status::kOk;
}

void SimulatedLidar::cast(const Exposure& e) noexcept {
  constexpr double kBeyond = 1.01;  // of the range: nothing was met
  core::CounterRng rng(seed_, ((kStream + lidar_) << 40U) + e.sequence);
  points_ = 0;
  for (const Vector3& ray_L : ray_L_) {
    const double hit_m = world_.hit_distance_m(e.X_WS.p_RT, e.X_WS.R_RT * ray_L, spec_.range_m, e.stamp);
    // Two draws for each ray, whatever it meets.
    const bool lost = rng.uniform() < noise_.point_dropout_ratio;
    const std::uint64_t bits = rng.next();
    if (lost) continue;
    double range_m = kBeyond * spec_.range_m;
    if (hit_m < spec_.range_m) {
      range_m = hit_m + bounded_normal(bits) * noise_.noise_m;
      if (range_m <= spec_.range_min_m) continue;
    }
    const Vector3 p_L = range_m * ray_L;
    point_L_m_[points_++] = {static_cast<float>(p_L.x()), static_cast<float>(p_L.y()),
                             static_cast<float>(p_L.z())};
  }
}

void SimulatedLidar::cast_product(const Exposure& e, const LidarEffects& effects) noexcept {
  const LidarErrors& errors = effects.errors();
  const SweepMotion& motion = motion_[e.sequence % Exposures::kRing];
  const Pose X_WL = motion.at(1.0);
  core::CounterRng rng(seed_, ((kStream + lidar_) << 40U) + e.sequence);
  // Each sweep turned by the golden angle: never between the same rays again, evenly over time.
  const double turn_rad = errors.non_repeating ? 2.39996322972865332 * e.sequence : 0.0;
  const double sine = core::sin(turn_rad), cosine = core::cos(turn_rad);
  const double angle_rad = errors.angle_deg * core::kPi / 180.0;
  const double tilt_rad = errors.non_repeating ? ring_step_rad_ * (rng.uniform() - 0.5) : 0.0;
  points_ = 0;
  for (std::size_t i = 0; i < ray_L_.size(); ++i) {
    const double share = static_cast<double>(i % columns_ + 1) / static_cast<double>(columns_);
    const Vector3& r = ray_L_[i];
    const Vector3 level(cosine * r.x() - sine * r.y(), sine * r.x() + cosine * r.y(), 0.0);
    const std::uint64_t bits = rng.next();
    const double up_rad = angle_rad * bounded_normal(bits);
    const double aside_rad = angle_rad * bounded_normal(core::mix64(bits));
    const Vector3 said_L = Vector3(level.x(), level.y(), r.z() + tilt_rad).normalized();
    const Vector3 ray_L =
        (said_L + Vector3(-aside_rad * said_L.y(), aside_rad * said_L.x(), up_rad)).normalized();
    const Pose X_WR = motion.at(share);
    const Echo echo = effects.measure(world_, X_WR, ray_L, spec_.range_m, e.stamp, rng);
    if (!echo.there || !(echo.range_m > spec_.range_min_m)) continue;
    const Vector3 p_R = echo.range_m * said_L;
    const Vector3 p_L = p_R + errors.deskew_ratio * (X_WL.inverse_times(X_WR * p_R) - p_R);
    point_L_m_[points_++] = {static_cast<float>(p_L.x()), static_cast<float>(p_L.y()),
                             static_cast<float>(p_L.z())};
  }
}

}  // namespace roborun::sitl
