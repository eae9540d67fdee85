#include "stages/perception/hole_reach.hpp"

#include <algorithm>
#include <cmath>

namespace roborun::stages {
namespace {

/// Of the optical axis of a camera that looks no steeper than 60 degrees up or down.
constexpr double kLevel = 0.5;
/// Tangent of the elevation up to which a value may be ground: so wrong is the estimate's tilt.
constexpr float kHorizon = 0.05F;
/// Of the distance of a value, what is believed of a hole above it: values have noise, and walls lean.
constexpr float kBelieved = 0.9F;
/// Directions that are nearly straight up or down belong to no column.
constexpr float kAhead = 0.1F;
constexpr float kNoTop = -1e9F;

}  // namespace

void HoleReach::begin(const PosedDepthFrame& posed) noexcept {
  const firmware_if::DepthFrame& frame = posed.frame;
  const Matrix3& R_WC = posed.X_WC.R_RT;
  const double level = std::sqrt(R_WC(0, 0) * R_WC(0, 0) + R_WC(1, 0) * R_WC(1, 0));
  const double c = R_WC(0, 0) / level, s = R_WC(1, 0) / level;
  Matrix3 R_LW;
  R_LW << c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0;
  const Matrix3 R_LC = R_LW * R_WC;
  const double across = static_cast<double>(frame.tan_half_width),
               along = static_cast<double>(frame.tan_half_height);
  const double column_pitch = 2.0 * across / frame.width, row_pitch = 2.0 * along / frame.height;
  const Vector3 first = R_LC * Vector3(1.0, across - 0.5 * column_pitch, along - 0.5 * row_pitch);
  for (int axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<std::size_t>(axis);
    first_[k] = static_cast<float>(first[axis]);
    right_[k] = static_cast<float>(-column_pitch * R_LC(axis, 1));
    down_[k] = static_cast<float>(-row_pitch * R_LC(axis, 2));
  }
  columns_per_tan_ = static_cast<float>(1.0 / std::max(column_pitch, row_pitch));
  top_.fill({kNoTop, 0.0F});
}

std::array<float, 3> HoleReach::row_of(std::size_t v) const noexcept {
  const auto n = static_cast<float>(v);
  return {first_[0] + n * down_[0], first_[1] + n * down_[1], first_[2] + n * down_[2]};
}

bool HoleReach::place_of(const std::array<float, 3>& row, std::size_t u, Place& place) const noexcept {
  const auto n = static_cast<float>(u);
  place.ahead = row[0] + n * right_[0];
  if (!(place.ahead > kAhead)) return false;
  const float inverse = 1.0F / place.ahead;
  const float at = 0.5F * kColumns + (row[1] + n * right_[1]) * inverse * columns_per_tan_;
  if (!(at >= 1.0F && at < static_cast<float>(kColumns - 1))) return false;
  place.column = static_cast<std::size_t>(at);
  place.tangent = (row[2] + n * right_[2]) * inverse;
  return true;
}

void HoleReach::find_tops(const firmware_if::DepthFrame& frame) noexcept {
  const float* depth_m = frame.depth_m.data();
  Place place{};
  for (std::size_t v = 0; v < frame.height; ++v, depth_m += frame.width) {
    const std::array<float, 3> row = row_of(v);
    for (std::size_t u = 0; u < frame.width; ++u) {
      if (!(depth_m[u] > frame.range_min_m) || !place_of(row, u, place)) continue;
      Top& top = top_[place.column];
      if (place.tangent > top.tangent) top = {place.tangent, depth_m[u] * place.ahead};
    }
  }
}

HoleReach::Top HoleReach::limit_of(std::size_t column) const noexcept {
  const Top& own = top_[column];
  const Top &left = top_[column - 1], &right = top_[column + 1];
  // Where the image is turned a column may have no pixel with a value, though it is as wide as one.
  Top limit = own.tangent > kNoTop ? own : left.tangent > right.tangent ? left : right;
  if (!(limit.tangent > kNoTop && limit.tangent <= kHorizon)) return {0.0F, 0.0F};
  for (const Top& beside : {left, right})
    if (beside.tangent > kNoTop) limit.ahead_m = std::min(limit.ahead_m, beside.ahead_m);
  return limit;
}

bool HoleReach::fill_bounded(const firmware_if::DepthFrame& frame, std::span<float> filled) noexcept {
  const std::size_t width = frame.width;
  const auto columns = std::span(above_m_).first(width), columns_below = std::span(below_m_).first(width);
  std::fill(columns.begin(), columns.end(), 0.0F);
  std::fill(columns_below.begin(), columns_below.end(), 0.0F);
  bool any = false;
  const auto is_value = [&](std::size_t i) { return frame.depth_m[i] > frame.range_min_m; };
  // Downwards and to the right, then back: 0 where a side has no value.
  for (std::size_t v = 0, i = 0; v < frame.height; ++v) {
    float left_m = 0.0F;
    for (std::size_t u = 0; u < width; ++u, ++i) {
      if (is_value(i)) left_m = columns[u] = frame.depth_m[i];
      filled[i] = is_value(i) ? frame.depth_m[i] : std::min(left_m, columns[u]);
    }
  }
  for (std::size_t v = frame.height; v-- > 0;) {
    float right_m = 0.0F;
    for (std::size_t u = width; u-- > 0;) {
      const std::size_t i = v * width + u;
      if (is_value(i)) {
        right_m = columns_below[u] = frame.depth_m[i];
      } else {
        filled[i] = kBelieved * std::min(filled[i], std::min(right_m, columns_below[u]));
        any = any || filled[i] > 0.0F;
      }
    }
  }
  return any;
}

bool HoleReach::fill_sky(const PosedDepthFrame& posed, std::span<float> filled) noexcept {
  const firmware_if::DepthFrame& frame = posed.frame;
  const double up = posed.X_WC.R_RT(2, 0);
  if (1.0 - up * up < kLevel * kLevel) return false;
  begin(posed);
  find_tops(frame);
  bool any = false;
  const float* depth_m = frame.depth_m.data();
  float* to = filled.data();
  Place place{};
  for (std::size_t v = 0; v < frame.height; ++v, depth_m += frame.width, to += frame.width) {
    const std::array<float, 3> row = row_of(v);
    for (std::size_t u = 0; u < frame.width; ++u) {
      if (depth_m[u] > frame.range_min_m || !place_of(row, u, place)) continue;
      const Top limit = limit_of(place.column);
      if (!(limit.ahead_m > 0.0F && place.tangent > limit.tangent)) continue;
      to[u] = kBelieved * limit.ahead_m / place.ahead;
      any = true;
    }
  }
  return any;
}

bool HoleReach::fill(const PosedDepthFrame& posed, std::span<float> filled) noexcept {
  if (!posed.error.dark_sky) return false;
  const bool bounded = fill_bounded(posed.frame, filled);
  const bool sky = fill_sky(posed, filled);
  return bounded || sky;
}

}  // namespace roborun::stages
