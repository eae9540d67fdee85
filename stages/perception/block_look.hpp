// How one camera looks at eight blocks of space at once. Included once per instruction set, after highway.h:
// the guard is Highway's, not #pragma once.
#if defined(ROBORUN_BLOCK_LOOK) == defined(HWY_TARGET_TOGGLE)
#ifdef ROBORUN_BLOCK_LOOK
#undef ROBORUN_BLOCK_LOOK
#else
#define ROBORUN_BLOCK_LOOK
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstdint>

#include "core/precision.hpp"
#include "stages/perception/sight_camera.hpp"
#include "stages/perception/vector_lanes.hpp"

HWY_BEFORE_NAMESPACE();
namespace roborun::stages::HWY_NAMESPACE {

constexpr float kNear_m = 1e-3F;  // a block that reaches behind the camera is projected from here on

constexpr double kCore = 0.5;  // of a finest cell, the part that has to be seen past

/// Eight positions.
struct Lanes {
  alignas(32) float x[8];
  alignas(32) float y[8];
  alignas(32) float z[8];
};

/// One bit a block.
template <class Bits>
struct Marks {
  Bits free{0}, mixed{0}, blocked{0}, covered{0};
  Bits in_part{0};  ///< Free, but many of the pixels are in a hole.
  Bits whole{0};    ///< Covered by a camera that has not marked it so.
  Bits sparse{0};   ///< Too many of a camera's pixels are; a part of the block may be free.
  Bits unseen{0};   ///< The same, or all of them are.
  Bits shaded{0};   ///< A part of it lies in the camera's view and is hidden.
};

template <class Bits>
struct Decision {
  Bits free, mixed, in_part;  ///< in_part: of the free ones.
};

/// Seen as free by one camera and as hidden by another that sees all of it: they disagree, and always will. What lies across
/// the border of two images is seen past by both of them together only if neither hides its part.
template <class Bits>
HWY_INLINE Decision<Bits> decide(const Marks<Bits>& marks, bool complete) {
  const Bits covered = marks.covered | (complete ? ~(marks.unseen | marks.shaded) : Bits{0});
  const Bits free = marks.free & ~marks.mixed & ~marks.blocked & covered;
  return {free, (marks.mixed | ((marks.free | marks.sparse) & ~covered)) & ~marks.blocked,
          free & marks.in_part & ~marks.whole};
}

/// The pixels [u0, u1] x [v0, v1] in which eight cubes are seen.
struct PixelBoxes {
  alignas(32) std::int32_t u0[8];
  alignas(32) std::int32_t u1[8];
  alignas(32) std::int32_t v0[8];
  alignas(32) std::int32_t v1[8];
};

/// A camera's look at eight blocks: where in its pyramid, and which depths decide.
struct Look {
  PixelBoxes pixels;
  const DepthPyramid* pyramid;
  const DepthEntry* entry;
  alignas(32) std::int32_t above[8];  ///< First entry of the upper row of a block's rectangle,
  alignas(32) std::int32_t below[8];  ///< and of the lower one.
  alignas(32) std::int32_t more[8];   ///< Entries of a row after the first; at most 2.
  alignas(32) float needed[8];        ///< In steps: what has to be seen past, and
  alignas(32) float nearest[8];       ///< what has to be seen for any of it to be free.
  unsigned outside, straddling, inside;
};

/// Of a vector of rectangles, the least of the entries [first, first + more] of both rows; more is at most 2.
/// Whole loads of four entries: gather instructions are slow where they are patched against leaks.
template <class V>
HWY_INLINE V least_entries(const DepthEntry* entry, const std::int32_t* above, const std::int32_t* below,
                           V more) {
  const Ints di;
#if HWY_TARGET == HWY_SCALAR
  DepthEntry least{DepthEntry::kMaxSteps, DepthEntry::kMaxSteps};
  for (std::int32_t i = 0; i <= hn::GetLane(more); ++i) {
    for (const DepthEntry& e : {entry[*above + i], entry[*below + i]}) {
      least.least_steps = std::min(least.least_steps, e.least_steps);
      least.not_most_steps = std::min(least.not_most_steps, e.not_most_steps);
    }
  }
  return hn::Set(di, least.least_steps | (static_cast<std::int32_t>(least.not_most_steps) << 16U));
#else
  const hn::Repartition<std::int16_t, Ints> d16;
  const hn::Repartition<std::int64_t, Ints> d64;
  const auto four = [&](std::size_t i) {
    const hn::CappedTag<std::int16_t, 8> eight;
    return hn::Min(hn::LoadU(eight, &entry[above[i]].least_steps),
                   hn::LoadU(eight, &entry[below[i]].least_steps));
  };
  // The entries of rectangle i, and of i + 4 in the upper half of a wider vector.
  const auto row = [&](std::size_t i) {
    if constexpr (hn::MaxLanes(Ints()) == 8) {
      return hn::BitCast(di, hn::Combine(d16, four(i + 4), four(i)));
    } else {
      return hn::BitCast(di, four(i));
    }
  };
  const auto a = row(0), b = row(1), c = row(2), e = row(3);
  const auto low = [&](auto left, auto right) {
    return hn::BitCast(d64, hn::InterleaveLower(di, left, right));
  };
  const auto high = [&](auto left, auto right) {
    return hn::BitCast(d64, hn::InterleaveUpper(di, left, right));
  };
  const auto first = hn::BitCast(di, hn::InterleaveLower(d64, low(a, b), low(c, e)));
  const auto second = hn::BitCast(di, hn::InterleaveUpper(d64, low(a, b), low(c, e)));
  const auto third = hn::BitCast(di, hn::InterleaveLower(d64, high(a, b), high(c, e)));
  const auto none = hn::Set(di, 0x7FFF7FFF);
  const auto least = [&](V x, V y) {
    return hn::BitCast(di, hn::Min(hn::BitCast(d16, x), hn::BitCast(d16, y)));
  };
  return least(first, least(hn::IfThenElse(hn::Gt(more, hn::Zero(di)), second, none),
                            hn::IfThenElse(hn::Gt(more, hn::Set(di, 1)), third, none)));
#endif
}

/// Half the width of a block's image around its centre's tangent: |d/dx y/x| summed over the cube's axes, an
/// upper bound because the denominator is the nearest depth.
template <class V>
HWY_INLINE V half_width(const SightCamera& c, std::size_t row, V tangent, V half_over_near) {
  const Floats d;
  const auto of = [&](std::size_t axis) {
    return hn::Abs(hn::Sub(hn::Set(d, c.R_CW[3 * row + axis]), hn::Mul(tangent, hn::Set(d, c.R_CW[axis]))));
  };
  return hn::Mul(hn::Add(hn::Add(of(0), of(1)), of(2)), half_over_near);
}

/// How deep the best corner of a cube is within the sides of the field of view; with -half_m the worst one.
template <class V>
HWY_INLINE V inside_view(const SightCamera& c, float half_m, V x, V y, V z) {
  const Floats d;
  const auto support = [&](std::size_t side) { return hn::Set(d, half_m * c.support[side]); };
  const V side = hn::Mul(x, hn::Set(d, c.tan_half_width));
  const V top = hn::Mul(x, hn::Set(d, c.tan_half_height));
  const V across = hn::Min(hn::Add(hn::Sub(side, y), support(0)), hn::Add(hn::Add(side, y), support(1)));
  const V along = hn::Min(hn::Add(hn::Sub(top, z), support(2)), hn::Add(hn::Add(top, z), support(3)));
  return hn::Min(across, along);
}

/// Cubes of which the camera sees nothing.
template <class V>
HWY_INLINE auto out_of_view(const SightCamera& c, float half_m, V x, V y, V z) {
  const Floats d;
  const V far = hn::Add(x, hn::Set(d, half_m * c.extent));
  return hn::Or(hn::Le(inside_view(c, half_m, x, y, z), hn::Zero(d)), hn::Le(far, hn::Set(d, kNear_m)));
}

/// The first and the last pixel of what is `half` wide to both sides of a tangent. Returns their difference.
template <class V>
HWY_INLINE auto store_pixels(V tangent, V half, float tan_half, float pixels_per_tan, float last_pixel,
                             std::int32_t* from, std::int32_t* to) {
  const Floats d;
  const Ints di;
  const V middle = hn::Sub(hn::Set(d, tan_half), tangent);
  const V scale = hn::Set(d, pixels_per_tan), last = hn::Set(d, last_pixel), zero = hn::Zero(d);
  const auto first = hn::ConvertTo(di, hn::Min(hn::Max(hn::Mul(hn::Sub(middle, half), scale), zero), last));
  const auto end = hn::ConvertTo(di, hn::Min(hn::Max(hn::Mul(hn::Add(middle, half), scale), zero), last));
  hn::Store(first, di, from);
  hn::Store(end, di, to);
  return hn::Sub(end, first);
}

/// Sets which entries of the pyramid hold the pixels of a look. `side`: of the largest box, in pixels. One level for
/// all eight blocks, so that the result does not depend on how many are done at once.
HWY_INLINE void choose_entries(const DepthPyramid& pyramid, std::int32_t side, Look& look) {
  const Ints di;
  const PixelBoxes& pixels = look.pixels;
  look.pyramid = &pyramid;
  const DepthPyramid::Level& level =
      pyramid.level(std::max(DepthPyramid::level_for(side), pyramid.first_level()));
  look.entry = level.entry;
  for (std::size_t i = 0; i < 8; i += hn::Lanes(di)) {
    // Entries stand 2^shift pixels apart: the first one that covers pixel p is p >> shift, and the last one
    // of four that must reach pixel p begins at ((p + 2^shift) >> shift) - back.
    const auto first = [&](const std::int32_t* from) {
      return hn::ShiftRightSame(hn::Load(di, from + i), level.shift);
    };
    const auto last = [&](const std::int32_t* to) {
      const auto past = hn::Add(hn::Load(di, to + i), hn::Set(di, 1 << level.shift));
      return hn::Sub(hn::ShiftRightSame(past, level.shift), hn::Set(di, level.back));
    };
    const auto column = first(pixels.u0), row = first(pixels.v0);
    const auto width = hn::Set(di, level.width);
    hn::Store(hn::Add(hn::Mul(row, width), column), di, look.above + i);
    hn::Store(hn::Add(hn::Mul(hn::Max(last(pixels.v1), row), width), column), di, look.below + i);
    hn::Store(hn::Max(hn::Sub(last(pixels.u1), column), hn::Zero(di)), di, look.more + i);
  }
}

/// Where one camera has to look for eight cubes. kInside: it sees all of them, as their parent has shown.
///
/// A cube of half-edge h around (x, y, z) in the camera's frame, x along the optical axis:
///   depth of its far and near side  x +- h extent
///   its image                       centre y / x, half width |d(y / x)| summed over the cube's axes
///   free if every pixel of it that is in no hole sees  far + margin + quadratic far^2  (or its whole range), and enough
///   of them are in none
///   hidden if no pixel of it sees   near
template <bool kInside>
HWY_INLINE void aim(const SightCamera& c, float half_m, const Lanes& at, Look& look) {
  const Floats d;
  const Ints di;
  PixelBoxes& pixels = look.pixels;
  const auto set = [&](float value) { return hn::Set(d, value); };
  unsigned outside = 0, straddling = 0, inside = kInside ? 0xFFU : 0U;
  auto longest = hn::Zero(di);
  for (std::size_t i = 0; i < 8; i += hn::Lanes(d)) {
    const auto x = hn::Load(d, at.x + i);
    const auto y = hn::Load(d, at.y + i);
    const auto z = hn::Load(d, at.z + i);
    const auto reach = set(half_m * c.extent);
    const auto far = hn::Add(x, reach);
    const auto near = hn::Sub(x, reach);
    auto depth = x, nearest = near, half = set(half_m);
    if constexpr (!kInside) {
      const auto is_outside = out_of_view(c, half_m, x, y, z);
      const auto is_straddling = hn::Le(near, set(kNear_m));
      outside |= bits_of(is_outside) << i;
      straddling |= bits_of(is_straddling) << i;
      inside |= bits_of(hn::Ge(inside_view(c, -half_m, x, y, z), hn::Zero(d))) << i;
      // These are not looked at: anything will do that leads to a pixel of the image.
      const auto skip = hn::Or(is_outside, is_straddling);
      depth = hn::IfThenElse(skip, set(1.0F), x);
      nearest = hn::IfThenElse(skip, set(1.0F), near);
      half = hn::IfThenZeroElse(skip, half);
    }
    const auto inverse = hn::Div(set(1.0F), depth);
    const auto half_over_near = hn::Div(half, nearest);
    const auto u = hn::Mul(y, inverse);
    const auto v = hn::Mul(z, inverse);
    auto half_u = half_width(c, 1, u, half_over_near), half_v = half_width(c, 2, v, half_over_near);
    if (c.widening > 0.0F || c.widening_m > 0.0F) {
      const auto wider = hn::Add(set(c.widening), hn::Mul(set(c.widening_m), inverse));
      half_u = hn::Add(half_u, wider);
      half_v = hn::Add(half_v, wider);
    }
    const auto columns = store_pixels(u, half_u, c.tan_half_width, c.columns_per_tan, c.last_column,
                                      pixels.u0 + i, pixels.u1 + i);
    const auto rows =
        store_pixels(v, half_v, c.tan_half_height, c.rows_per_tan, c.last_row, pixels.v0 + i, pixels.v1 + i);
    longest = hn::Max(longest, hn::Max(columns, rows));
    // What the camera calls empty up to its range is believed up to the range itself: no margin there.
    const auto margin = hn::Add(set(c.margin_m), hn::Mul(set(c.margin_quadratic_per_m), hn::Mul(far, far)));
    const auto needed = hn::Min(hn::Add(far, margin), hn::Max(far, set(c.range_m)));
    const auto steps = set(c.pyramid->steps_per_m());
    hn::Store(hn::Mul(needed, steps), d, look.needed + i);
    hn::Store(hn::Mul(near, steps), d, look.nearest + i);
  }
  look.outside = outside;
  look.straddling = straddling & ~outside;
  look.inside = inside & ~(outside | straddling);

  choose_entries(*c.pyramid, hn::GetLane(hn::MaxOfLanes(di, longest)) + 1, look);
}

/// Of some of eight blocks, those of which too many pixels are in holes.
struct InHoles {
  unsigned in_part{0}, sparse{0}, dark{0};
};
/// How much of a block's image may be in holes, in kHoleShares-ths of its pixels: at one look, and at each of two.
struct HoleShare {
  std::int32_t once{0}, twice{0};
};
constexpr std::int32_t kHoleShares = 1024;  // times the pixels of the largest image: 31 bits
static_assert(kHoleShares * std::int64_t{kMaxImageSide} * kMaxImageSide < (std::int64_t{1} << 31U));
/// So large may be what a block hides, whatever its size: an eighth of the face of a cell of 0.3 m at one look, half of it at each
/// of two; of a smaller block the same shares of its own face. A block that is divided further must be seen all over.
HWY_INLINE HoleShare hole_share(const PrecisionLattice& lattice, int level, int finest) {
  if (level > finest) return {};
  const double ratio = std::min(kPublishedCell_m / lattice.cell_size_m(level), 1.0);
  const auto share = [ratio](std::int32_t most) { return static_cast<std::int32_t>(most * (ratio * ratio)); };
  return {share(kHoleShares / 8), share(kHoleShares / 2)};
}

HWY_INLINE InHoles in_holes(const Look& look, HoleShare share, unsigned blocks) {
  InHoles result;
  if (blocks == 0) return result;
  const Ints di;
  const DepthPyramid::SeenSums sums = look.pyramid->seen_sums();
  const auto set = [&](std::int32_t value) { return hn::Set(di, value); };
  for (std::size_t i = 0; i < 8; i += hn::Lanes(di)) {
    const auto tile = [&](const std::int32_t* pixel) {
      return hn::ShiftRightSame(hn::Load(di, pixel + i), sums.shift);
    };
    const auto x0 = tile(look.pixels.u0), x1 = hn::Add(tile(look.pixels.u1), set(1));
    const auto y0 = tile(look.pixels.v0), y1 = hn::Add(tile(look.pixels.v1), set(1));
    const auto above = hn::Mul(y0, set(sums.row)), below = hn::Mul(y1, set(sums.row));
    alignas(32) std::int32_t corner[4][8], seen_pixels[8];
    hn::Store(hn::Add(below, x1), di, corner[0]);
    hn::Store(hn::Add(below, x0), di, corner[1]);
    hn::Store(hn::Add(above, x1), di, corner[2]);
    hn::Store(hn::Add(above, x0), di, corner[3]);
    for (std::size_t k = 0; k < hn::Lanes(di); ++k)
      seen_pixels[k] = static_cast<std::int32_t>(sums.seen[corner[0][k]] - sums.seen[corner[1][k]] -
                                                 sums.seen[corner[2][k]] + sums.seen[corner[3][k]]);
    const auto seen = hn::Load(di, seen_pixels);
    const auto side = [&](auto from, auto to, std::int32_t most) {
      return hn::Sub(hn::Min(hn::ShiftLeftSame(to, sums.shift), set(most)),
                     hn::ShiftLeftSame(from, sums.shift));
    };
    const auto pixels = hn::Mul(side(x0, x1, sums.width), side(y0, y1, sums.height));
    const auto lost = hn::Sub(pixels, seen);
    const auto bits = [](auto is) { return bits_of(hn::RebindMask(Floats(), is)); };
    const auto more_than = [&](std::int32_t of_all) {
      return bits(hn::Gt(hn::Mul(lost, set(kHoleShares)), hn::Mul(pixels, set(of_all))));
    };
    const unsigned few = more_than(share.once), too_few = more_than(share.twice);
    const unsigned none = bits(hn::Eq(seen, hn::Zero(di)));
    result.dark |= (few & none) << i;
    result.in_part |= (few & ~too_few & ~none) << i;
    result.sparse |= (few & too_few & ~none) << i;
  }
  result.dark &= blocks;
  result.in_part &= blocks;
  result.sparse &= blocks;
  return result;
}

/// Adds to `marks` what this camera says of the eight blocks: it sees past all of a block, or nothing of it, or
/// something in between; or too few of its pixels say anything.
HWY_INLINE void look_through(const Look& look, HoleShare share, Marks<unsigned>& marks) {
  const Floats d;
  const Ints di;
  unsigned sees_past = 0, hidden = 0;
  for (std::size_t i = 0; i < 8; i += hn::Lanes(d)) {
    const auto entry = least_entries(look.entry, look.above + i, look.below + i, hn::Load(di, look.more + i));
    const auto least = hn::And(entry, hn::Set(di, 0xFFFF));
    const auto most = hn::Sub(hn::Set(di, DepthEntry::kMaxSteps), hn::ShiftRight<16>(entry));
    sees_past |= bits_of(hn::Gt(hn::ConvertTo(d, least), hn::Load(d, look.needed + i))) << i;
    hidden |= bits_of(hn::Ge(hn::Load(d, look.nearest + i), hn::ConvertTo(d, most))) << i;
  }
  const unsigned looked = ~(look.outside | look.straddling) & 0xFFU;
  sees_past &= looked;
  hidden &= looked & ~sees_past;
  unsigned mixed = looked & ~sees_past & ~hidden;
  if (look.pyramid->has_holes()) {
    const InHoles holes = in_holes(look, share, sees_past | mixed);
    const unsigned unseen = (holes.sparse & sees_past) | holes.dark;
    sees_past &= ~unseen;
    mixed &= ~holes.dark;
    marks.in_part |= holes.in_part & sees_past;
    marks.whole |= sees_past & look.inside & ~holes.in_part;
    marks.sparse |= holes.sparse & unseen;
    marks.unseen |= unseen;
  } else {
    marks.whole |= sees_past & look.inside;
  }
  marks.free |= sees_past;
  marks.covered |= sees_past & look.inside;
  marks.blocked |= hidden & look.inside;
  marks.shaded |= hidden & ~look.inside;
  marks.mixed |= look.straddling | mixed;
}

HWY_INLINE float half_edge_m(const PrecisionLattice& lattice, int level) {
  return static_cast<float>((level == 0 ? kCore : 1.0) * 0.5 * lattice.cell_size_m(level));
}

}  // namespace roborun::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per instruction set
