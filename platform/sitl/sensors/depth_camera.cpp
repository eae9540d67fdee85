#include "platform/sitl/sensors/depth_camera.hpp"

#include <cmath>
#include <limits>

#include "core/random/counter_rng.hpp"

namespace roborun::sitl {
namespace {

/// Depth cameras deliver whole millimetres. NaN and infinity stay.
float delivered_m(double depth_m) noexcept {
  return static_cast<float>(std::round(1000.0 * depth_m)) * 0.001F;
}

}  // namespace

CameraSpec DepthCameraConfig::spec() const noexcept {
  CameraSpec spec;
  spec.width = spec.height = pixels;
  spec.tan_half_width = spec.tan_half_height = tan_half_fov_ratio;
  spec.range_m = range_m;
  spec.rate_Hz = rate_Hz;
  spec.latency_s = latency_s;
  spec.model = model;
  spec.invalid_ratio = invalid_ratio;
  return spec;
}

SimulatedDepthCamera::SimulatedDepthCamera(const World& world, const CameraSpec& spec,
                                           const firmware_if::CameraMount& mount, const DepthNoise& noise,
                                           std::uint64_t seed, std::uint32_t camera)
    : world_(world),
      spec_(spec),
      noise_(noise),
      seed_(seed),
      camera_(camera),
      exposures_({spec.rate_Hz, spec.latency_s, noise.frame_dropout_ratio, seed, 0x1000U + camera,
                  spec.model == CameraModel::kClean ? TimingErrors{} : DepthModel{}.timing},
                 mount) {
  if (spec.model != CameraModel::kClean) effects_.emplace(spec, seed, camera);
  const std::size_t width = spec.width, height = spec.height;
  image_.resize(width * height);
  ray_C_.reserve(width * height);
  for (std::size_t v = 0; v < height; ++v) {
    for (std::size_t u = 0; u < width; ++u) {
      const double y =
          -(2.0 * (static_cast<double>(u) + 0.5) / static_cast<double>(width) - 1.0) * spec.tan_half_width;
      const double z =
          -(2.0 * (static_cast<double>(v) + 0.5) / static_cast<double>(height) - 1.0) * spec.tan_half_height;
      ray_C_.emplace_back(1.0, y, z);
    }
  }
}

Status SimulatedDepthCamera::read(firmware_if::DepthFrame& frame) noexcept {
  const Exposure* e = exposures_.take();
  if (e == nullptr) return Status::kNotReady;
  if (effects_)
    render_product(*e, *effects_);
  else
    render(*e);
  frame = {e->said,
           e->sequence,
           spec_.width,
           spec_.height,
           static_cast<float>(spec_.tan_half_width),
           static_cast<float>(spec_.tan_half_height),
           static_cast<float>(spec_.range_m),
           static_cast<float>(spec_.range_min_m),
           image_};
  return Status::kOk;
}

void SimulatedDepthCamera::render(const Exposure& e) noexcept {
  core::CounterRng rng(seed_, (std::uint64_t{camera_} << 40U) + e.sequence);
  const Vector3 origin_W = e.X_WS.p_RT;
  for (std::size_t i = 0; i < ray_C_.size(); ++i) {
    const double length = ray_C_[i].norm();
    const Vector3 direction_W = (e.X_WS.R_RT * ray_C_[i]) / length;
    double depth_m = world_.hit_distance_m(origin_W, direction_W, spec_.range_m * length, e.stamp) / length;
    const std::uint64_t bits = rng.next();
    if (static_cast<double>(bits >> 40U) * 0x1.0p-24 < noise_.pixel_dropout_ratio) {
      depth_m = std::numeric_limits<double>::quiet_NaN();
    } else if (depth_m < std::numeric_limits<double>::infinity()) {
      depth_m = std::fmax(
          0.01, depth_m + bounded_normal(bits) * (noise_.noise_m + noise_.noise_per_m * depth_m * depth_m));
    }
    if (depth_m <= spec_.range_min_m) depth_m = std::numeric_limits<double>::quiet_NaN();
    image_[i] = delivered_m(depth_m);
  }
}

void SimulatedDepthCamera::render_product(const Exposure& e, DepthEffects& effects) noexcept {
  const Pose X_WC = effects.true_pose(e.X_WS);
  for (std::size_t i = 0; i < ray_C_.size(); ++i) {
    const double length = ray_C_[i].norm();
    const Vector3 direction_W = (X_WC.R_RT * ray_C_[i]) / length;
    image_[i] = static_cast<float>(
        world_.hit_distance_m(X_WC.p_RT, direction_W, effects.reach_m() * length, e.stamp) / length);
  }
  effects.apply(e, X_WC, ray_C_, image_);
  for (float& depth_m : image_)
    depth_m = static_cast<double>(depth_m) > spec_.range_min_m ? delivered_m(depth_m)
                                                               : std::numeric_limits<float>::quiet_NaN();
}

std::array<firmware_if::CameraMount, 6> six_camera_mounts() noexcept {
  // Columns of R_BC are the camera's x (optical axis), y (left), z (up) in the body frame.
  return {{{{1, 0, 0, 0, 1, 0, 0, 0, 1}, {}},
           {{0, -1, 0, 1, 0, 0, 0, 0, 1}, {}},
           {{-1, 0, 0, 0, -1, 0, 0, 0, 1}, {}},
           {{0, 1, 0, -1, 0, 0, 0, 0, 1}, {}},
           {{0, 0, -1, 0, 1, 0, 1, 0, 0}, {}},
           {{0, 0, 1, 0, 1, 0, -1, 0, 0}, {}}}};
}

}  // namespace roborun::sitl
