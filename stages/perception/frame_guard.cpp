#include "stages/perception/frame_guard.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/random/counter_rng.hpp"
#include "stages/perception/depth_steps.hpp"
#include "stages/perception/empty_reach.hpp"

namespace roborun::stages {
namespace {

constexpr std::size_t kSamples = 64;
constexpr std::size_t kLeastSurfaces = 8;

/// Of the samples of an image; 0 if too few of them show a surface. Rays of a cloud that met nothing end at its range, all
/// in the same way.
std::uint64_t print_of(const PosedDepthFrame& posed) noexcept {
  const firmware_if::DepthFrame& frame = posed.frame;
  std::uint64_t hash = 1;
  std::size_t surfaces = 0;
  for (std::size_t i = 0; i < kSamples; ++i) {
    const std::size_t pixel = (2 * i + 1) * frame.depth_m.size() / (2 * kSamples);
    const float depth_m = frame.depth_m[pixel];
    const float reach_m = empty_reach_m(posed, pixel % frame.width, pixel / frame.width);
    surfaces += depth_m > frame.range_min_m && depth_m < reach_m ? 1U : 0U;
    hash = core::mix64(hash ^ std::bit_cast<std::uint32_t>(depth_m));
  }
  return surfaces < kLeastSurfaces ? 0 : hash;
}

/// In double, so that no stamp whatever overflows.
double seconds_between(MonotonicTime from, MonotonicTime to) noexcept {
  return seconds(to.time_since_epoch()) - seconds(from.time_since_epoch());
}

/// Of the pixels that look down; 1 if none does, and of a cloud. See kLeastInformedRatio.
double informed_ratio(const PosedDepthFrame& posed) noexcept {
  if (posed.is_cloud) return 1.0;
  constexpr std::size_t kSide = 16;
  const firmware_if::DepthFrame& f = posed.frame;
  std::size_t down = 0, informed = 0;
  for (std::size_t j = 0; j < kSide; ++j) {
    for (std::size_t i = 0; i < kSide; ++i) {
      const auto middle = [](std::size_t n, std::size_t pixels) {
        return (2 * n + 1) * pixels / (2 * kSide);
      };
      const std::size_t u = middle(i, f.width), v = middle(j, f.height);
      const Vector3 ray_C(
          1.0, (1.0 - (2.0 * static_cast<double>(u) + 1.0) / f.width) * static_cast<double>(f.tan_half_width),
          (1.0 - (2.0 * static_cast<double>(v) + 1.0) / f.height) * static_cast<double>(f.tan_half_height));
      if (posed.X_WC.R_RT.row(2).dot(ray_C) > -kDownwards * ray_C.norm()) continue;
      ++down;
      informed += f.depth_m[v * f.width + u] > f.range_min_m ? 1U : 0U;
    }
  }
  return down == 0 ? 1.0 : static_cast<double>(informed) / static_cast<double>(down);
}

}  // namespace

Status check_shape(const PosedDepthFrame& posed) noexcept {
  const firmware_if::DepthFrame& f = posed.frame;
  const bool size_ok = f.width >= 8 && f.height >= 8 && f.width <= kMaxImageSide &&
                       f.height <= kMaxImageSide &&
                       f.depth_m.size() == std::size_t{f.width} * std::size_t{f.height};
  const bool range_ok = f.range_m <= kMaxRange_m && f.range_min_m >= 0.0F && f.range_min_m < f.range_m;
  const bool optics_ok = f.tan_half_width > 0.0F && f.tan_half_width <= kMaxTanHalfFov &&
                         f.tan_half_height > 0.0F && f.tan_half_height <= kMaxTanHalfFov;
  const bool pose_ok = is_finite(posed.X_WC.p_RT) && posed.X_WC.R_RT.allFinite();
  return size_ok && range_ok && optics_ok && pose_ok ? Status::kOk : Status::kInvalidArgument;
}

Status check_frame(const PosedDepthFrame& posed) noexcept {
  if (check_shape(posed) != Status::kOk) return Status::kInvalidArgument;
  const auto& depth_m = posed.frame.depth_m;
  const bool any =
      std::any_of(depth_m.begin(), depth_m.end(), [&](float d) { return d > posed.frame.range_min_m; });
  return any && informed_ratio(posed) >= kLeastInformedRatio ? Status::kOk : Status::kInvalidArgument;
}

void FrameGuard::begin(std::span<const PosedDepthFrame> scan) noexcept {
  if (scan.empty()) return;
  std::array<MonotonicTime, 24> stamp{};
  const std::size_t count = std::min(scan.size(), stamp.size());
  for (std::size_t i = 0; i < count; ++i) stamp[i] = scan[i].frame.stamp;
  std::sort(stamp.begin(), stamp.begin() + static_cast<std::ptrdiff_t>(count));
  const MonotonicTime middle = stamp[count / 2];
  scan_too_old_ = any_scan_ && seconds_between(scan_, middle) < -seconds(kStampSpread);
  any_scan_ = true;
  scan_ = middle;
}

bool FrameGuard::frozen(const PosedDepthFrame& posed) noexcept {
  const firmware_if::DepthFrame& frame = posed.frame;
  const std::uint64_t hash = print_of(posed);
  if (hash == 0) return false;
  for (Print& print : print_) {
    if (print.hash != hash) continue;
    if (print.stamp == frame.stamp) return false;
    print_[next_] = {hash, frame.stamp};  // remembered for as long as it comes
    next_ = (next_ + 1) % print_.size();
    return true;
  }
  print_[next_] = {hash, frame.stamp};
  next_ = (next_ + 1) % print_.size();
  return false;
}

FrameFault FrameGuard::judge(const PosedDepthFrame& posed) noexcept {
  return check_shape(posed) == Status::kOk ? judge_content(posed) : FrameFault::kShape;
}

Status FrameGuard::check(const PosedDepthFrame& posed) noexcept {
  return judge(posed) == FrameFault::kNone ? Status::kOk : Status::kInvalidArgument;
}

Status FrameGuard::check_content(const PosedDepthFrame& posed) noexcept {
  return judge_content(posed) == FrameFault::kNone ? Status::kOk : Status::kInvalidArgument;
}

FrameFault FrameGuard::judge_content(const PosedDepthFrame& posed) noexcept {
  const double late_s = seconds_between(scan_, posed.frame.stamp);
  const bool in_time = !scan_too_old_ && std::fabs(late_s) <= seconds(kStampSpread);
  const bool has_noise = posed.error.constant_m > 0.0 || posed.error.quadratic_per_m > 0.0;
  if (!in_time) return FrameFault::kStamp;
  const double informed = informed_ratio(posed);
  if (informed < kLeastInformedRatio)
    return informed < kCoveredRatio ? FrameFault::kCovered : FrameFault::kFog;
  return has_noise && frozen(posed) ? FrameFault::kFrozen : FrameFault::kNone;
}

}  // namespace roborun::stages
