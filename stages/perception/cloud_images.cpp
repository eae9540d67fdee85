#include "stages/perception/cloud_images.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "firmware_if/assert.hpp"
#include "stages/perception/depth_steps.hpp"

namespace roborun::stages {
namespace {

/// The sensor's axes in which image i looks: along `axis`, with `sign`; its left and up complete a
/// right-handed frame.
struct View {
  int forward, left, up;
  float forward_sign, left_sign, up_sign;
};
constexpr std::array<View, CloudImages::kImages> kViews{{{0, 1, 2, 1, 1, 1},
                                                         {1, 0, 2, 1, -1, 1},
                                                         {0, 1, 2, -1, -1, 1},
                                                         {1, 0, 2, -1, 1, 1},
                                                         {2, 1, 0, 1, 1, -1},
                                                         {2, 1, 0, -1, 1, 1}}};

std::size_t view_of(const std::array<float, 3>& p) noexcept {
  const float x = std::fabs(p[0]), y = std::fabs(p[1]), z = std::fabs(p[2]);
  if (x >= y && x >= z) return p[0] > 0.0F ? 0 : 2;
  if (y >= z) return p[1] > 0.0F ? 1 : 3;
  return p[2] > 0.0F ? 4 : 5;
}

}  // namespace

CloudImages::CloudImages(const Config& config, core::Arena& arena) noexcept
    : config_(config),
      depth_m_(arena.take<float>(kImages * config.pixels * config.pixels, "cloud images")),
      pool_(arena.last_pool()) {
  ROBORUN_ASSERT(config.validate() == Status::kOk);
}

Status CloudImages::make(const PosedCloud& cloud) noexcept {
  count_ = 0;
  const bool usable = cloud.range_m > 0.0F && cloud.range_m <= kMaxRange_m && is_finite(cloud.X_WL.p_RT) &&
                      cloud.X_WL.R_RT.allFinite() && !depth_m_.empty();
  const std::size_t side = config_.pixels, pixels = side * side;
  bool met = false;
  if (usable) {
    pool_.use(depth_m_.size());
    std::fill(depth_m_.begin(), depth_m_.end(), std::numeric_limits<float>::quiet_NaN());
    for (const std::array<float, 3>& p : cloud.points_L) {
      if (!(std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]))) {
        ++counters_.points_refused;
        continue;
      }
      const float square_m2 = p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
      if (!(square_m2 > cloud.range_min_m * cloud.range_min_m)) continue;
      const std::size_t i = view_of(p);
      const View& view = kViews[i];
      const auto along = [&p](int axis, float sign) { return sign * p[static_cast<std::size_t>(axis)]; };
      const float depth_m = along(view.forward, view.forward_sign);
      if (!(depth_m > 0.0F)) continue;
      const auto pixel = [&](float aside) {
        const float at = 0.5F * (1.0F - aside / depth_m) * static_cast<float>(side);
        return std::clamp(static_cast<std::size_t>(std::fmax(at, 0.0F)), std::size_t{0}, side - 1);
      };
      float& nearest_m = depth_m_[i * pixels + pixel(along(view.up, view.up_sign)) * side +
                                  pixel(along(view.left, view.left_sign))];
      const float seen_m =
          square_m2 < cloud.range_m * cloud.range_m ? depth_m : std::numeric_limits<float>::infinity();
      if (!(nearest_m <= seen_m)) nearest_m = seen_m;
      met = true;
    }
  }
  for (std::size_t i = 0; met && i < kImages; ++i) {
    Matrix3 R_LC = Matrix3::Zero();
    R_LC(kViews[i].forward, 0) = static_cast<double>(kViews[i].forward_sign);
    R_LC(kViews[i].left, 1) = static_cast<double>(kViews[i].left_sign);
    R_LC(kViews[i].up, 2) = static_cast<double>(kViews[i].up_sign);
    PosedDepthFrame& posed = frame_[count_++];
    posed.frame = {cloud.stamp,    0,    config_.pixels,
                   config_.pixels, 1.0F, 1.0F,
                   cloud.range_m,  0.0F, depth_m_.subspan(i * pixels, pixels)};
    posed.X_WC = {cloud.X_WL.R_RT.lazyProduct(R_LC), cloud.X_WL.p_RT};
    posed.is_cloud = true;
    posed.p_BC_W = cloud.p_BL_W;
  }
  ++(count_ > 0 ? counters_.clouds : counters_.clouds_refused);
  return count_ > 0 ? Status::kOk : Status::kInvalidArgument;
}

}  // namespace roborun::stages
