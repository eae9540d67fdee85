#include "platform/sitl/sensors/depth_effects.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/geometry/math.hpp"
#include "platform/sitl/sensors/draws.hpp"

namespace roborun::sitl {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
/// Neighbours differ by more than this beyond what a plane would: a step.
constexpr double kStep_px = 1.0;
/// Less has no depth: one pixel of disparity is 42 m of a D455.
constexpr double kLeast_px = 1.0;
constexpr std::uint64_t kGolden = 0x9E3779B97F4A7C15ULL;

double unit(std::uint64_t bits) noexcept { return static_cast<double>(bits & 0xFFFFU) * 0x1.0p-16; }

}  // namespace

DepthEffects::DepthEffects(const CameraSpec& spec, std::uint64_t seed, std::uint32_t camera,
                           const DepthModel& model)
    : model_(model),
      // Without a baseline any will do: it only says where depth makes a step.
      optics_(stereo_of(spec.model) != nullptr ? *stereo_of(spec.model) : kD455),
      stereo_(stereo_of(spec.model) != nullptr),
      width_(spec.width),
      height_(spec.height),
      lattice_(seed),
      seed_(seed),
      stream_((std::uint64_t{0x300} + camera) << 40U) {
  const double focal_px = 0.5 * spec.width / spec.tan_half_width;
  const double focal_v_px = 0.5 * spec.height / spec.tan_half_height;
  native_px_ = optics_.focal_px / focal_px;
  const double half_px = 0.5 * model.window_px * model.fatten_ratio;
  radius_u_ = half_px / native_px_;
  radius_v_ = half_px * focal_v_px / optics_.focal_px;
  block_ = static_cast<std::size_t>(std::max(1.0, model.window_px / native_px_));
  reach_m_ = stereo_ ? optics_.focal_px * optics_.baseline_m / kLeast_px : 4.0 * model.tenth_range_m;
  // Both together leave what is asked for.
  const double kept_log = core::log(1.0 - spec.invalid_ratio);
  texture_ratio_ = 1.0 - core::exp(kept_log * 2.0 / 3.0);
  reflection_ratio_ = 1.0 - core::exp(kept_log / 3.0);

  core::CounterRng world(seed, 0x300000U);  // the same sun for all cameras
  const double azimuth_rad = 2.0 * core::kPi * world.uniform();
  const double level = core::cos(model.sun_elevation_deg * core::kDegree);
  sun_W_ = {level * core::cos(azimuth_rad), level * core::sin(azimuth_rad),
            core::sin(model.sun_elevation_deg * core::kDegree)};
  glare_cosine_ = core::cos(model.glare_deg * core::kDegree);

  core::CounterRng mount(seed, 0x310000U + camera);
  const Vector3 half_rad = 0.5 * model.mount_deg * core::kDegree * normal3(mount);
  R_CE_ = Quaternion(1.0, half_rad.x(), half_rad.y(), half_rad.z()).normalized().toRotationMatrix();
  p_CE_ = model.mount_m * normal3(mount);

  disparity_px_.resize(width_ * height_);
  occluded_.resize(width_ * height_);
  line_px_.resize(std::max(width_, height_));
  right_px_.resize(width_);
  steady_.resize(((width_ - 1) / block_ + 1) * ((height_ - 1) / block_ + 1));
}

void DepthEffects::apply(const Exposure& exposure, const Pose& X_WC, std::span<const Vector3> ray_C,
                         std::span<float> depth_m) noexcept {
  const auto fb = static_cast<float>(optics_.focal_px * optics_.baseline_m);
  for (std::size_t i = 0; i < depth_m.size(); ++i) disparity_px_[i] = fb / depth_m[i];
  core::CounterRng rng(seed_, stream_ + exposure.sequence);
  const std::uint64_t key = rng.next();
  if (stereo_) {
    for (std::size_t v = 0; v < height_; ++v) fatten(v * width_, 1, width_, radius_u_, key);
    for (std::size_t u = 0; u < width_; ++u) fatten(u, width_, height_, radius_v_, ~key);
    for (std::size_t v = 0; v < height_; ++v) mark_occluded(v);
  }
  draw_steady_noise(exposure.stamp);

  const Matrix3 R_TC = SurfaceLattice::turn() * X_WC.R_RT;
  const Vector3 p_TC = SurfaceLattice::turn() * X_WC.p_RT;
  const Vector3 sun_C = X_WC.R_RT.transpose() * sun_W_;
  const std::uint64_t view = lattice_.bits(p_TC, 1.0);
  for (std::size_t v = 0, i = 0; v < height_; ++v) {
    for (std::size_t u = 0; u < width_; ++u, ++i) {
      const std::uint64_t bits = rng.next();
      depth_m[i] = kNaN;
      const double disparity_px = static_cast<double>(disparity_px_[i]);
      if (disparity_px < kLeast_px || occluded_[i] != 0) continue;
      const double toward_sun = ray_C[i].dot(sun_C);
      if (toward_sun > 0.0 &&
          toward_sun * toward_sun > glare_cosine_ * glare_cosine_ * ray_C[i].squaredNorm())
        continue;
      const double true_m = static_cast<double>(fb) / disparity_px;
      const Vector3 p_T = R_TC * (true_m * ray_C[i]) + p_TC;
      if (is_hole(p_T, true_m, bits, view)) continue;
      if (stereo_) {
        depth_m[i] = stereo(u, v, bits);
      } else {
        // 5 to 80 %: asphalt and foliage to white walls.
        const double reflectivity = 0.05 + 0.75 * SurfaceLattice::uniform(lattice_.bits(p_T, 0.5));
        depth_m[i] = time_of_flight(u, v, reflectivity, bits);
      }
    }
  }
}

void DepthEffects::fatten(std::size_t first, std::size_t stride, std::size_t count, double radius,
                          std::uint64_t key) noexcept {
  const auto at = [&](std::size_t k) -> float& { return disparity_px_[first + k * stride]; };
  constexpr auto kStep = static_cast<float>(kStep_px);
  bool grown = false;
  for (std::size_t k = 0; k + 1 < count; ++k) {
    const float rise = at(k + 1) - at(k);
    if (std::fabs(rise) < kStep) continue;
    // On a plane the disparity rises evenly.
    const float before = k > 0 ? at(k) - at(k - 1) : 0.0F;
    const float after = k + 2 < count ? at(k + 2) - at(k + 1) : 0.0F;
    if (std::fabs(rise - before) < kStep || std::fabs(rise - after) < kStep) continue;
    if (!grown) {
      for (std::size_t j = 0; j < count; ++j) line_px_[j] = at(j);
      grown = true;
    }
    // Where within its pixel the edge is: anywhere, but for all rows the same, or a straight edge would not stay one.
    const auto cells = static_cast<std::size_t>(radius + unit(core::mix64(key + kGolden * k) >> 20U));
    for (std::size_t n = 0; n < cells; ++n) {
      if (rise < 0.0F) {
        if (k + 1 + n < count) line_px_[k + 1 + n] = std::max(line_px_[k + 1 + n], at(k));
      } else if (k >= n) {
        line_px_[k - n] = std::max(line_px_[k - n], at(k + 1));
      }
    }
  }
  for (std::size_t j = 0; grown && j < count; ++j) at(j) = line_px_[j];
}

void DepthEffects::mark_occluded(std::size_t row) noexcept {
  const float* disparity_px = &disparity_px_[row * width_];
  const auto shrink = static_cast<float>(1.0 / native_px_);
  const auto column = [&](std::size_t u) { return static_cast<float>(u) + 0.5F - disparity_px[u] * shrink; };
  std::fill(right_px_.begin(), right_px_.end(), 0.0F);
  for (std::size_t u = 0; u < width_; ++u) {
    const float x = column(u);
    if (x < 0.0F) continue;
    float& nearest_px = right_px_[static_cast<std::size_t>(x)];
    nearest_px = std::max(nearest_px, disparity_px[u]);
  }
  for (std::size_t u = 0; u < width_; ++u) {
    const float x = column(u);
    occluded_[row * width_ + u] = x < 0.0F || right_px_[static_cast<std::size_t>(x)] >
                                                  disparity_px[u] + static_cast<float>(2.0 * kStep_px)
                                      ? 1
                                      : 0;
  }
}

void DepthEffects::draw_steady_noise(MonotonicTime now) noexcept {
  // Between two fields, with weights that keep the variance.
  const std::int64_t steady_ns = from_seconds(model_.steady_s).count();
  const std::int64_t ns = now.time_since_epoch().count();
  const std::int64_t period = ns / steady_ns;
  const double share = static_cast<double>(ns - period * steady_ns) / static_cast<double>(steady_ns);
  const auto from = static_cast<float>(std::sqrt(1.0 - share)), to = static_cast<float>(std::sqrt(share));
  core::CounterRng first(seed_ ^ kGolden, stream_ + static_cast<std::uint64_t>(period));
  core::CounterRng second(seed_ ^ kGolden, stream_ + static_cast<std::uint64_t>(period) + 1);
  for (float& z : steady_)
    z = from * static_cast<float>(bounded_normal(first.next())) +
        to * static_cast<float>(bounded_normal(second.next()));
}

bool DepthEffects::is_hole(const Vector3& p_T, double depth_m, std::uint64_t bits,
                           std::uint64_t view) const noexcept {
  const double cell_m = SurfaceLattice::power_of_two(model_.patch_ratio * depth_m);
  // The borders of a patch are not the same in two images.
  const double ragged_m = 0.2 * cell_m;
  const std::uint64_t more = core::mix64(bits);
  const Vector3 q_T = p_T + ragged_m * Vector3(unit(more), unit(more >> 16U), unit(more >> 32U));
  const std::uint64_t cell = lattice_.bits(q_T, cell_m);
  return SurfaceLattice::uniform(cell) < texture_ratio_ ||
         SurfaceLattice::uniform(core::mix64(cell ^ view)) < reflection_ratio_;
}

DepthEffects::Step DepthEffects::step_at(std::size_t u, std::size_t v) const noexcept {
  const std::size_t i = v * width_ + u;
  const float here = disparity_px_[i];
  float low = here, high = here;
  const auto look = [&](float before, float after) {
    if (std::fabs(before - 2.0F * here + after) < static_cast<float>(kStep_px)) return;
    low = std::min({low, before, after});
    high = std::max({high, before, after});
  };
  if (u > 0 && u + 1 < width_) look(disparity_px_[i - 1], disparity_px_[i + 1]);
  if (v > 0 && v + 1 < height_) look(disparity_px_[i - width_], disparity_px_[i + width_]);
  return {static_cast<double>(low), static_cast<double>(high)};
}

float DepthEffects::stereo(std::size_t u, std::size_t v, std::uint64_t bits) const noexcept {
  double disparity_px = static_cast<double>(disparity_px_[v * width_ + u]);
  const std::uint64_t more = core::mix64(bits + kGolden);
  if (unit(more) < model_.flying_ratio) {
    const Step step = step_at(u, v);
    if (step.high_px > step.low_px)
      disparity_px = step.low_px + unit(more >> 16U) * (step.high_px - step.low_px);
  }
  const std::size_t blocks = (width_ - 1) / block_ + 1;
  const double steady = static_cast<double>(steady_[(v / block_) * blocks + u / block_]);
  const double noise =
      std::sqrt(model_.steady_ratio) * steady + std::sqrt(1.0 - model_.steady_ratio) * bounded_normal(bits);
  disparity_px =
      optics_.step_px * std::floor((disparity_px + optics_.subpixel_px * noise) / optics_.step_px + 0.5);
  if (disparity_px < kLeast_px || disparity_px > optics_.search_px) return kNaN;
  return static_cast<float>(optics_.focal_px * optics_.baseline_m / disparity_px);
}

float DepthEffects::time_of_flight(std::size_t u, std::size_t v, double reflectivity,
                                   std::uint64_t bits) const noexcept {
  const double fb = optics_.focal_px * optics_.baseline_m;
  double depth_m = fb / static_cast<double>(disparity_px_[v * width_ + u]);
  const std::uint64_t more = core::mix64(bits + kGolden);
  if (unit(more) < model_.flying_ratio) {
    const Step step = step_at(u, v);
    if (step.high_px > step.low_px && step.low_px > 0.0)
      depth_m = fb / step.high_px + unit(more >> 16U) * (fb / step.low_px - fb / step.high_px);
  }
  // Light falls with depth squared.
  const double tenth_m = model_.tenth_range_m;
  if (reflectivity * tenth_m * tenth_m < 0.1 * depth_m * depth_m) return kNaN;
  const std::size_t blocks = (width_ - 1) / block_ + 1;
  const double steady = static_cast<double>(steady_[(v / block_) * blocks + u / block_]);
  const double noise =
      std::sqrt(model_.steady_ratio) * steady + std::sqrt(1.0 - model_.steady_ratio) * bounded_normal(bits);
  return static_cast<float>(
      std::max(0.01, depth_m + noise * (model_.noise_m + model_.noise_per_m * depth_m * depth_m)));
}

}  // namespace roborun::sitl
