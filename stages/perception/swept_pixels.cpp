// See swept_pixels.hpp.
// Compiled once per instruction set: foreach_target includes this file again.
#include "stages/perception/instruction_sets.hpp"
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stages/perception/swept_pixels.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#include <algorithm>
#include <bit>

#include "stages/perception/swept_pixels.hpp"
#include "stages/perception/vector_lanes.hpp"

HWY_BEFORE_NAMESPACE();
namespace roborun::stages::HWY_NAMESPACE {

/// A piece of the way: from `from` by `by`.
struct Piece {
  float from[3], by[3], per_square;
};

HWY_INLINE void cut(const SweptWay& way, Piece* piece) {
  for (std::size_t i = 0; i + 1 < way.points; ++i) {
    float square = 0.0F;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      piece[i].from[axis] = way.point_C[i][axis];
      piece[i].by[axis] = way.point_C[i + 1][axis] - way.point_C[i][axis];
      square += piece[i].by[axis] * piece[i].by[axis];
    }
    piece[i].per_square = square > 0.0F ? 1.0F / square : 0.0F;
  }
}

std::size_t count_swept_lanes(const firmware_if::DepthFrame& frame, std::size_t v0, std::size_t v1,
                              const SweptWay& way) {
  const Floats d;
  const std::size_t lanes = hn::Lanes(d);
  constexpr float kAhead = 0.96F;  // of the squared distance to the beginning: sin^2 of 78 degrees
  Piece piece[SweptWay::kMost] = {};
  cut(way, piece);
  float farthest_m = 0.0F;
  for (std::size_t i = 0; i < way.points; ++i) farthest_m = std::max(farthest_m, way.point_C[i][0]);
  const auto least = hn::Set(d, frame.range_min_m);
  const auto most = hn::Set(d, std::min(farthest_m + way.radius_m, frame.range_m));
  const float across = 2.0F * frame.tan_half_width / static_cast<float>(frame.width);
  const float along = 2.0F * frame.tan_half_height / static_cast<float>(frame.height);
  const auto step = hn::Set(d, -across);
  std::size_t count = 0;
  for (std::size_t v = v0; v < v1; ++v) {
    const float* const row = frame.depth_m.data() + v * frame.width;
    const auto up = hn::Set(d, frame.tan_half_height - along * (static_cast<float>(v) + 0.5F));
    for (std::size_t u = 0; u < frame.width; u += lanes) {
      alignas(32) float rest[8] = {};  // 0 is no information
      const float* from = row + u;
      if (u + lanes > frame.width) {
        std::copy(from, row + frame.width, rest);
        from = rest;
      }
      const auto z = hn::LoadU(d, from);
      const auto is_near = hn::And(hn::Gt(z, least), hn::Lt(z, most));
      if (hn::AllFalse(d, is_near)) continue;
      const auto left = hn::Add(hn::Set(d, frame.tan_half_width - across * (static_cast<float>(u) + 0.5F)),
                                hn::Mul(step, hn::Iota(d, 0.0F)));
      const auto y = hn::Mul(z, left), height = hn::Mul(z, up);
      const auto square = [](auto a, auto b, auto c) {
        return hn::Add(hn::Add(hn::Mul(a, a), hn::Mul(b, b)), hn::Mul(c, c));
      };
      auto nearest2 = hn::Set(d, 1e30F), begin2 = nearest2;
      for (std::size_t i = 0; i + 1 < way.points; ++i) {
        const Piece& p = piece[i];
        const auto dx = hn::Sub(z, hn::Set(d, p.from[0])), dy = hn::Sub(y, hn::Set(d, p.from[1])),
                   dz = hn::Sub(height, hn::Set(d, p.from[2]));
        if (i == 0) begin2 = square(dx, dy, dz);
        const auto bx = hn::Set(d, p.by[0]), by = hn::Set(d, p.by[1]), bz = hn::Set(d, p.by[2]);
        const auto dot = hn::Add(hn::Add(hn::Mul(dx, bx), hn::Mul(dy, by)), hn::Mul(dz, bz));
        const auto t =
            hn::Min(hn::Max(hn::Mul(dot, hn::Set(d, p.per_square)), hn::Zero(d)), hn::Set(d, 1.0F));
        nearest2 = hn::Min(nearest2, square(hn::Sub(dx, hn::Mul(t, bx)), hn::Sub(dy, hn::Mul(t, by)),
                                            hn::Sub(dz, hn::Mul(t, bz))));
      }
      const auto less =
          hn::Add(hn::Set(d, way.constant_m), hn::Mul(hn::Set(d, way.quadratic_per_m), hn::Mul(z, z)));
      const auto room = hn::Max(hn::Sub(hn::Set(d, way.radius_m), less), hn::Zero(d));
      const auto is_met = hn::And(hn::Lt(nearest2, hn::Mul(room, room)),
                                  hn::Lt(nearest2, hn::Mul(hn::Set(d, kAhead), begin2)));
      count += static_cast<std::size_t>(std::popcount(bits_of(hn::And(is_near, is_met))));
    }
  }
  return count;
}

}  // namespace roborun::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace roborun::stages {

HWY_EXPORT(count_swept_lanes);

std::size_t count_swept(const firmware_if::DepthFrame& frame, std::size_t v0, std::size_t v1,
                        const SweptWay& way) noexcept {
  return HWY_DYNAMIC_DISPATCH(count_swept_lanes)(frame, v0, v1, way);
}

}  // namespace roborun::stages
#endif  // HWY_ONCE
