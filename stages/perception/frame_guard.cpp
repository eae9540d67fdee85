#include "stages/perception/frame_guard.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/random/counter_rng.hpp"
#include "stages/perception/depth_steps.hpp"

namespace roborun::stages {
namespace {

constexpr std::size_t kSamples = 64;
constexpr std::size_t kLeastSurfaces = 8;

/// Of the samples of an image; 0 if too few of them show a surface.
std::uint64_t print_of(const firmware_if::DepthFrame& frame) noexcept {
  std::uint64_t hash = 1;
  std::size_t surfaces = 0;
  for (std::size_t i = 0; i < kSamples; ++i) {
    const float depth_m = frame.depth_m[(2 * i + 1) * frame.depth_m.size() / (2 * kSamples)];
    surfaces += depth_m > frame.range_min_m && depth_m < frame.range_m ? 1U : 0U;
    hash = core::mix64(hash ^ std::bit_cast<std::uint32_t>(depth_m));
  }
  return surfaces < kLeastSurfaces ? 0 : hash;
}

/// In double, so that no stamp whatever overflows.
double seconds_between(MonotonicTime from, MonotonicTime to) noexcept {
  return seconds(to.time_since_epoch()) - seconds(from.time_since_epoch());
}

bool is_informed(const PosedDepthFrame& posed, std::size_t informed_count) noexcept {
  const auto pixels = static_cast<double>(posed.frame.depth_m.size());
  return static_cast<double>(informed_count) >= (posed.is_cloud ? 0.0 : kLeastInformedRatio * pixels);
}

}  // namespace

Status check_shape(const PosedDepthFrame& posed) noexcept {
  const firmware_if::DepthFrame& f = posed.frame;
  const bool size_ok = f.width >= 8 && f.height >= 8 && f.width <= kMaxImageSide &&
                       f.height <= kMaxImageSide &&
                       f.depth_m.size() == std::size_t{f.width} * std::size_t{f.height};
  const bool range_ok =
      f.range_m > 0.0F && f.range_m <= kMaxRange_m && f.range_min_m >= 0.0F && f.range_min_m < f.range_m;
  const bool optics_ok = f.tan_half_width > 0.0F && f.tan_half_width <= kMaxTanHalfFov &&
                         f.tan_half_height > 0.0F && f.tan_half_height <= kMaxTanHalfFov;
  const bool pose_ok = is_finite(posed.X_WC.p_RT) && posed.X_WC.R_RT.allFinite();
  return size_ok && range_ok && optics_ok && pose_ok ? Status::kOk : Status::kInvalidArgument;
}

Status check_frame(const PosedDepthFrame& posed) noexcept {
  if (check_shape(posed) != Status::kOk) return Status::kInvalidArgument;
  return is_informed(posed, informed_pixels(posed.frame.depth_m, posed.frame.range_min_m))
             ? Status::kOk
             : Status::kInvalidArgument;
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

bool FrameGuard::frozen(const firmware_if::DepthFrame& frame) noexcept {
  const std::uint64_t hash = print_of(frame);
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

Status FrameGuard::check(const PosedDepthFrame& posed) noexcept {
  if (check_shape(posed) != Status::kOk) return Status::kInvalidArgument;
  return check(posed, informed_pixels(posed.frame.depth_m, posed.frame.range_min_m));
}

Status FrameGuard::check(const PosedDepthFrame& posed, std::size_t informed_count) noexcept {
  const double late_s = seconds_between(scan_, posed.frame.stamp);
  const bool in_time = !scan_too_old_ && std::fabs(late_s) <= seconds(kStampSpread);
  if (!in_time || !is_informed(posed, informed_count) || frozen(posed.frame)) return Status::kInvalidArgument;
  return Status::kOk;
}

}  // namespace roborun::stages
