// See depth_steps.hpp.
// Compiled once per instruction set: foreach_target includes this file again.
#include "stages/perception/instruction_sets.hpp"
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stages/perception/depth_steps.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "stages/perception/depth_steps.hpp"
#include "stages/perception/vector_lanes.hpp"

HWY_BEFORE_NAMESPACE();
namespace roborun::stages::HWY_NAMESPACE {

/// to[i] = keep(from[2 i], from[2 i + 1]); one vector of them.
template <class Keep>
HWY_INLINE void keep_of_pairs(const std::int32_t* from, std::int32_t* to, const Keep& keep) {
  const Ints di;
#if HWY_TARGET == HWY_SCALAR
  const auto even = hn::LoadU(di, from), odd = hn::LoadU(di, from + 1);
#else
  const auto low = hn::LoadU(di, from), high = hn::LoadU(di, from + hn::Lanes(di));
  const auto even = hn::ConcatEven(di, high, low), odd = hn::ConcatOdd(di, high, low);
#endif
  hn::StoreU(keep(even, odd), di, to);
}

/// The least and the most depth of each column of a strip, then of each tile, as the bits of a float: those of
/// floats > 0 have the order of the floats.
struct ColumnBounds {
  /// Beyond the last column stands what changes nothing when neighbours are joined.
  static constexpr std::size_t kBeyond = 24;
  alignas(32) std::int32_t least[kMaxImageSide + 8 + kBeyond];
  alignas(32) std::int32_t most[kMaxImageSide + 8 + kBeyond];
};

/// What stands for the least depth of a column without information: beyond every range.
HWY_INLINE auto no_depth() { return hn::Set(Floats(), 2.0F * kMaxRange_m); }

/// Step 1: the least and the most of one vector of columns, the first of which is `u`. `depth`: the first row of
/// them; rows are `stride` apart.
HWY_INLINE void bound_columns(const DepthStrip& strip, const float* depth, std::size_t stride, std::size_t u,
                              ColumnBounds& bounds, StripSeen& seen) {
  const Floats d;
  const Ints di;
  const auto least_nan =
      hn::Add(hn::BitCast(di, hn::Set(d, std::numeric_limits<float>::infinity())), hn::Set(di, 1));
  auto low = hn::BitCast(di, hn::LoadU(d, depth)), high = low;
  for (std::size_t v = 1; v < strip.rows; ++v) {
    const auto raw = hn::BitCast(di, hn::LoadU(d, depth + v * stride));
    low = hn::Min(low, raw);
    high = hn::Max(high, raw);
  }
  // As integers, what is not > range_min >= 0 lies below it, and so do NaNs with a sign; the others lie above
  // infinity.
  const auto nearest = hn::Set(d, strip.range_min_m);
  if (!hn::AllTrue(di, hn::And(hn::Gt(low, hn::BitCast(di, nearest)), hn::Lt(high, least_nan)))) {
    seen.incomplete[u / 512] |= std::uint64_t{1} << (u / 8 % 64);
    low = hn::BitCast(di, no_depth());
    high = hn::Zero(di);
    for (std::size_t v = 0; v < strip.rows; ++v) {
      const auto raw = hn::LoadU(d, depth + v * stride);
      const auto known = hn::Gt(raw, nearest);
      low = hn::Min(low, hn::BitCast(di, hn::IfThenElse(known, raw, no_depth())));
      high = hn::Max(high, hn::BitCast(di, hn::IfThenElseZero(known, raw)));
    }
  }
  hn::StoreU(low, di, bounds.least + u);
  hn::StoreU(high, di, bounds.most + u);
}

/// Step 2: neighbours in pairs, `shift` times, until a column is a tile.
HWY_INLINE void join_columns(std::size_t width, std::size_t tiles, unsigned shift, ColumnBounds& bounds) {
  const Ints di;
  const std::size_t lanes = hn::Lanes(di);
  const auto min = [](auto a, auto b) { return hn::Min(a, b); };
  const auto max = [](auto a, auto b) { return hn::Max(a, b); };
  const std::size_t stored = (width + lanes - 1) / lanes * lanes;
  for (std::size_t i = stored; i < stored + ColumnBounds::kBeyond; i += lanes) {
    hn::Store(hn::BitCast(di, no_depth()), di, bounds.least + i);
    hn::Store(hn::Zero(di), di, bounds.most + i);
  }
  for (unsigned k = 1; k <= shift; ++k) {
    const std::size_t count = tiles << (shift - k);
    for (std::size_t x = 0; x < count; x += lanes) {
      keep_of_pairs(bounds.least + 2 * x, bounds.least + x, min);
      keep_of_pairs(bounds.most + 2 * x, bounds.most + x, max);
    }
  }
}

/// Step 3: from depths to entries, in place. A depth z ends in step floor(z steps_per_m); "within the range" is
/// asked first, because what is empty up to the range satisfies every need within it:
///   least_steps    = floor(least steps_per_m), or kMaxSteps beyond the range
///   not_most_steps = kMaxSteps - (floor(most steps_per_m) + 1), or 0 beyond the range
/// and a tile of which nothing is known sees everything: it takes no part in the minimum.
HWY_INLINE bool to_entries(const DepthStrip& strip, std::size_t tiles, ColumnBounds& bounds) {
  const Floats d;
  const Ints di;
  const auto range = hn::Set(d, strip.range_m), scale = hn::Set(d, strip.steps_per_m);
  const auto all = hn::Set(di, DepthEntry::kMaxSteps), one = hn::Set(di, 1);
  const auto steps = [&](auto z) { return hn::ConvertTo(di, hn::Mul(hn::Min(z, range), scale)); };
  bool surface = false;
  for (std::size_t x = 0; x < tiles; x += hn::Lanes(d)) {
    const auto near = hn::BitCast(d, hn::LoadU(di, bounds.least + x));
    const auto far = hn::BitCast(d, hn::LoadU(di, bounds.most + x));
    const auto ends = hn::Lt(near, range), all_end = hn::Lt(far, range);
    surface = surface || !hn::AllFalse(d, ends);
    const auto least_steps = hn::IfThenElse(hn::RebindMask(di, ends), steps(near), all);
    const auto not_most =
        hn::IfThenElseZero(hn::RebindMask(di, all_end), hn::Sub(hn::Sub(all, steps(far)), one));
    const auto nothing = hn::RebindMask(di, hn::Eq(far, hn::Zero(d)));
    hn::StoreU(hn::Or(least_steps, hn::ShiftLeft<16>(hn::IfThenElse(nothing, all, not_most))), di,
               bounds.least + x);
  }
  return surface;
}

StripSeen tile_steps_lanes(const DepthStrip& strip, int shift, DepthEntry* entry) {
  const std::size_t lanes = hn::Lanes(Floats());
  ColumnBounds bounds;
  StripSeen seen;
  std::size_t u = 0;
  for (; u + lanes <= strip.width; u += lanes)
    bound_columns(strip, strip.depth_m + u, strip.width, u, bounds, seen);
  if (u < strip.width) {
    // Whole vectors for the last columns, too: the last one is repeated.
    float tail[8 * kMaxTile] = {};
    for (std::size_t v = 0; v < strip.rows; ++v)
      for (std::size_t i = 0; i < 8; ++i)
        tail[8 * v + i] = strip.depth_m[v * strip.width + std::min(u + i, strip.width - 1)];
    bound_columns(strip, tail, 8, u, bounds, seen);
  }
  const auto halvings = static_cast<unsigned>(shift);
  const std::size_t tiles = (strip.width + (std::size_t{1} << halvings) - 1) >> halvings;
  join_columns(strip.width, tiles, halvings, bounds);
  seen.surface = to_entries(strip, tiles, bounds);
  std::memcpy(entry, bounds.least, tiles * sizeof(DepthEntry));
  return seen;
}

void least_of_four_lanes(const DepthEntry* above, const DepthEntry* below, std::size_t stride,
                         std::size_t count, DepthEntry* to) {
  const auto least = [](DepthEntry a, DepthEntry b) {
    return DepthEntry{std::min(a.least_steps, b.least_steps), std::min(a.not_most_steps, b.not_most_steps)};
  };
  std::size_t x = 0;
#if HWY_TARGET != HWY_SCALAR
  const hn::CappedTag<std::int16_t, 16> d;
  const std::size_t entries = hn::Lanes(d) / 2;
  const auto at = [&](const DepthEntry* entry) { return hn::LoadU(d, &entry->least_steps); };
  if (stride == 1) {
    for (; x + entries <= count; x += entries)
      hn::StoreU(
          hn::Min(hn::Min(at(above + x), at(above + x + 1)), hn::Min(at(below + x), at(below + x + 1))), d,
          &to[x].least_steps);
  }
#endif
  for (; x < count; ++x) {
    const std::size_t i = stride * x;
    to[x] = least(least(above[i], above[i + stride]), least(below[i], below[i + stride]));
  }
}

}  // namespace roborun::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace roborun::stages {

HWY_EXPORT(tile_steps_lanes);
HWY_EXPORT(least_of_four_lanes);

StripSeen tile_steps(const DepthStrip& strip, int shift, DepthEntry* entry) noexcept {
  return HWY_DYNAMIC_DISPATCH(tile_steps_lanes)(strip, shift, entry);
}

void least_of_four(const DepthEntry* above, const DepthEntry* below, std::size_t stride, std::size_t count,
                   DepthEntry* to) noexcept {
  HWY_DYNAMIC_DISPATCH(least_of_four_lanes)(above, below, stride, count, to);
}

}  // namespace roborun::stages
#endif  // HWY_ONCE
