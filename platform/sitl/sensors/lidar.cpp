#include "platform/sitl/sensors/lidar.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "core/random/counter_rng.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/text_file.hpp"

namespace roborun::sitl {
namespace {

constexpr std::uint64_t kStream = 0x100;  // the cameras' are 0 .. 7
constexpr std::size_t kMostRays = 65536;

Vector3 direction(const LidarRay& ray) noexcept {
  constexpr double kDegree = core::kPi / 180.0;
  const double level = core::cos(ray.elevation_deg * kDegree);
  return {level * core::cos(ray.azimuth_deg * kDegree), level * core::sin(ray.azimuth_deg * kDegree),
          core::sin(ray.elevation_deg * kDegree)};
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
      exposures_({spec.rate_Hz, spec.latency_s, noise.sweep_dropout_ratio, seed, 0x2000U + lidar},
                 camera_mount(spec.mount)) {
  for (const LidarRay& ray : pattern) ray_L_.push_back(direction(ray));
  for (int ring = 0; pattern.empty() && ring < spec.rings; ++ring) {
    const double share = spec.rings > 1 ? static_cast<double>(ring) / (spec.rings - 1) : 0.5;
    const double elevation_deg = spec.lowest_deg + share * (spec.highest_deg - spec.lowest_deg);
    for (int column = 0; column < spec.columns; ++column)
      ray_L_.push_back(direction({360.0 * column / spec.columns, elevation_deg}));
  }
  point_L_m_.resize(ray_L_.size());
}

Status SimulatedLidar::read(firmware_if::LidarSweep& sweep) noexcept {
  const Exposure* e = exposures_.take();
  if (e == nullptr) return Status::kNotReady;
  cast(*e);
  sweep = {e->stamp, e->sequence, static_cast<float>(spec_.range_min_m), static_cast<float>(spec_.range_m),
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

}  // namespace roborun::sitl
