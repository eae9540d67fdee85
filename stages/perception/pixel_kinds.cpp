// See pixel_kinds.hpp.
// Compiled once per instruction set: foreach_target includes this file again.
#include "stages/perception/instruction_sets.hpp"
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stages/perception/pixel_kinds.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#include <algorithm>
#include <limits>

#include "stages/perception/pixel_kinds.hpp"
#include "stages/perception/sight_camera.hpp"
#include "stages/perception/vector_lanes.hpp"

HWY_BEFORE_NAMESPACE();
namespace roborun::stages::HWY_NAMESPACE {

/// Depths of three rows, with one pixel more on both sides: NaN where there is no information or no pixel, and far away where
/// nothing is within the range.
struct ThreeRows {
  static constexpr std::size_t kBefore = 8;
  alignas(32) float row[3][kBefore + kMaxImageSide + 2 * PixelRow::kPad];
};

HWY_INLINE void load_rows(const firmware_if::DepthFrame& frame, std::size_t v, std::size_t u0, std::size_t u1,
                          ThreeRows& rows) {
  const Floats d;
  const std::size_t lanes = hn::Lanes(d), count = u1 - u0;
  const auto none = hn::Set(d, std::numeric_limits<float>::quiet_NaN());
  for (std::size_t k = 0; k < 3; ++k) {
    float* const to = rows.row[k] + ThreeRows::kBefore;
    const std::size_t y = v + k - 1;  // wraps below 0: no row either
    const bool is_there = y < frame.height;
    const float* const from = frame.depth_m.data() + (is_there ? y : 0) * frame.width + u0;
    const auto known = [&](auto raw) {
      const auto far =
          hn::IfThenElse(hn::Lt(raw, hn::Set(d, frame.range_m)), raw, hn::Set(d, 2.0F * kMaxRange_m));
      return hn::IfThenElse(hn::Gt(raw, hn::Set(d, frame.range_min_m)), far, none);
    };
    std::size_t u = 0;
    for (; is_there && u + lanes <= count; u += lanes) hn::StoreU(known(hn::LoadU(d, from + u)), d, to + u);
    const auto one = [&](std::size_t i) {
      const float raw = from[i];
      if (!(raw > frame.range_min_m)) return std::numeric_limits<float>::quiet_NaN();
      return raw < frame.range_m ? raw : 2.0F * kMaxRange_m;
    };
    for (; u < count; ++u) to[u] = is_there ? one(u) : std::numeric_limits<float>::quiet_NaN();
    to[-1] = is_there && u0 > 0 ? frame.depth_m[y * frame.width + u0 - 1] : 0.0F;
    to[count] = is_there && u1 < frame.width ? frame.depth_m[y * frame.width + u1] : 0.0F;
    for (float* const side : {to - 1, to + count}) {
      if (!(*side > frame.range_min_m)) *side = std::numeric_limits<float>::quiet_NaN();
      if (*side >= frame.range_m) *side = 2.0F * kMaxRange_m;
    }
    for (std::size_t i = 1; i <= PixelRow::kPad; ++i) to[count + i] = std::numeric_limits<float>::quiet_NaN();
  }
}

/// Whether something `is` true of any of the eight pixels around these.
template <class Is>
HWY_INLINE auto any_around(const float* here, const float* above, const float* below, const Is& is) {
  const Floats d;
  const auto at = [&](const float* p) { return is(hn::LoadU(d, p)); };
  return hn::Or(hn::Or(hn::Or(at(here - 1), at(here + 1)), hn::Or(at(above), at(below))),
                hn::Or(hn::Or(at(above - 1), at(above + 1)), hn::Or(at(below - 1), at(below + 1))));
}
/// Of how many.
template <class Is>
HWY_INLINE auto count_around(const float* here, const float* above, const float* below, const Is& is) {
  const Floats d;
  const auto one = hn::Set(d, 1.0F);
  const auto at = [&](const float* p) { return hn::IfThenElseZero(is(hn::LoadU(d, p)), one); };
  return hn::Add(hn::Add(hn::Add(at(here - 1), at(here + 1)), hn::Add(at(above), at(below))),
                 hn::Add(hn::Add(at(above - 1), at(above + 1)), hn::Add(at(below - 1), at(below + 1))));
}

void tell_pixels_lanes(const firmware_if::DepthFrame& frame, std::size_t v, std::size_t u0, std::size_t u1,
                       const PixelRules& rules, PixelRow& row) {
  const Floats d;
  const std::size_t lanes = hn::Lanes(d), count = u1 - u0;
  ThreeRows rows;
  load_rows(frame, v, u0, u1, rows);
  row.any_thin = false;
  row.thin.fill(0);
  row.surely_thin.fill(0);
  for (std::size_t u = 0; u < count; u += lanes) {
    const float* const here = rows.row[1] + ThreeRows::kBefore + u;
    const float* const above = rows.row[0] + ThreeRows::kBefore + u;
    const float* const below = rows.row[2] + ThreeRows::kBefore + u;
    const auto z = hn::LoadU(d, here);
    const auto is_surface = hn::Lt(z, hn::Set(d, frame.range_m));
    const auto t =
        hn::Add(hn::Set(d, rules.constant_m), hn::Mul(hn::Set(d, rules.quadratic_per_m), hn::Mul(z, z)));
    const auto low = hn::Sub(z, t), high = hn::Add(z, t);
    const auto depth = hn::IfThenElseZero(is_surface, z);
    const auto at = [&](const float* p) { return hn::LoadU(d, p); };
    const auto sloped =
        hn::Add(hn::Set(d, rules.same_m),
                hn::Mul(z, hn::Add(hn::Set(d, rules.slope), hn::Mul(hn::Set(d, rules.quadratic_per_m), z))));
    const auto same = rules.mixes ? hn::Min(sloped, t) : t;
    const auto same_low = hn::Sub(z, same), same_high = hn::Add(z, same);
    const auto shares = [&](auto n) { return hn::And(hn::Ge(n, same_low), hn::Le(n, same_high)); };
    const auto left = at(here - 1), right = at(here + 1), up = at(above), down = at(below);
    const auto beside = hn::Or(shares(left), shares(right)), along = hn::Or(shares(up), shares(down));
    if (hn::AllTrue(d, hn::Or(hn::And(beside, along), hn::Not(is_surface)))) {
      hn::StoreU(depth, d, row.depth_m.data() + u);
      continue;
    }
    const auto any = [&](const auto& is) { return any_around(here, above, below, is); };
    const auto nearer = [&](auto n) { return hn::Lt(n, low); };
    const auto farther = [&](auto n) { return hn::Gt(n, high); };
    const auto mixes = hn::Lt(hn::Zero(d), hn::Set(d, rules.mixes ? 1.0F : 0.0F));
    const auto stands_out = [&](auto a, auto b) {
      return hn::And(hn::Not(hn::Or(hn::Le(a, high), hn::Le(b, high))), hn::Or(farther(a), farther(b)));
    };
    const auto alone = hn::Not(any([&](auto n) { return hn::And(hn::Ge(n, low), hn::Le(n, high)); }));
    const auto doubtful = hn::And(mixes, hn::Or(alone, any(nearer)));
    // What is beyond the range may be so by noise alone: where a plane ends at it, every other pixel would stand out.
    const auto may_stand_out = hn::Lt(high, hn::Set(d, frame.range_m));
    const auto thin =
        hn::AndNot(doubtful, hn::And(may_stand_out, hn::Or(stands_out(left, right), stands_out(up, down))));
    const std::uint64_t bits = bits_of(thin);
    row.any_thin = row.any_thin || bits != 0;
    row.thin[u / 64] |= bits << (u % 64);
    const auto between = [&](auto a, auto b) { return hn::And(farther(a), farther(b)); };
    const std::uint64_t sure = bits_of(hn::And(thin, hn::Or(between(left, right), between(up, down))));
    row.surely_thin[u / 64] |= sure << (u % 64);
    hn::StoreU(depth, d, row.depth_m.data() + u);
    if (!rules.mixes) continue;
    // One neighbour that shares its surface may be another such pixel. What is nearer may be across a hole, the other eye's shadow.
    const auto few_share = hn::Lt(count_around(here, above, below, shares), hn::Set(d, 1.5F));
    const auto hole = hn::Not(hn::And(hn::Eq(left, left), hn::Eq(right, right)));
    const auto at_a_rim = hn::Or(hole, any([&](auto n) { return hn::Lt(n, same_low); }));
    const auto mixed = hn::And(few_share, at_a_rim);
    hn::StoreU(hn::IfThenZeroElse(hn::AndNot(thin, mixed), depth), d, row.depth_m.data() + u);
  }
}

}  // namespace roborun::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace roborun::stages {
namespace {

/// Surfaces differ by more than this at a step, besides the error of the depth.
constexpr double kStep_m = 0.25;
/// Of one surface neighbouring pixels differ by no more than this times their distance: it is seen under 10 degrees or more.
constexpr float kSteepest = 5.7F;

}  // namespace

HWY_EXPORT(tell_pixels_lanes);

PixelRules pixel_rules(const firmware_if::DepthFrame& frame, const DepthError& error) noexcept {
  const float pitch = 2.0F * std::max(frame.tan_half_width / static_cast<float>(frame.width),
                                      frame.tan_half_height / static_cast<float>(frame.height));
  return {static_cast<float>(kStep_m + SightCamera::kSigmas * error.constant_m),
          static_cast<float>(SightCamera::kSigmas * error.quadratic_per_m), error.mixes,
          static_cast<float>(SightCamera::kSigmas * error.constant_m), kSteepest * pitch};
}

void tell_pixels(const firmware_if::DepthFrame& frame, std::size_t v, std::size_t u0, std::size_t u1,
                 const PixelRules& rules, PixelRow& row) noexcept {
  HWY_DYNAMIC_DISPATCH(tell_pixels_lanes)(frame, v, u0, u1, rules, row);
}

}  // namespace roborun::stages
#endif  // HWY_ONCE
