// Eight lanes are all there is to do: wider registers were slower than AVX2. GCC 12 crashes on Arm's SVE.
#define HWY_DISABLED_TARGETS (HWY_AVX3 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE \
  "stages/perception/block_sight.cpp"  // this file is compiled once an instruction set
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/precision.hpp"
#include "stages/perception/block_sight.hpp"

HWY_BEFORE_NAMESPACE();
namespace roborun::stages::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::CappedTag<float, 8>;
using Ints = hn::RebindToSigned<Floats>;

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
};

template <class Bits>
struct Decision {
  Bits free, mixed;
};

/// Seen as free by one camera and as hidden by another that sees all of it: they disagree, and always will.
template <class Bits>
HWY_INLINE Decision<Bits> decide(const Marks<Bits>& marks, bool complete) {
  const Bits covered = complete ? ~Bits{0} : marks.covered;
  return {marks.free & ~marks.mixed & ~marks.blocked & covered,
          (marks.mixed | (marks.free & ~covered)) & ~marks.blocked};
}

/// A camera's look at eight blocks: where in its pyramid, and which depths decide.
struct Look {
  const DepthPyramid::Entry* entry;
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
HWY_INLINE V least_entries(const DepthPyramid::Entry* entry, const std::int32_t* above,
                           const std::int32_t* below, V more) {
  const Ints di;
#if HWY_TARGET == HWY_SCALAR
  DepthPyramid::Entry least{DepthPyramid::kMaxSteps, DepthPyramid::kMaxSteps};
  for (std::int32_t i = 0; i <= hn::GetLane(more); ++i) {
    for (const DepthPyramid::Entry& e : {entry[*above + i], entry[*below + i]}) {
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

template <class Mask>
HWY_INLINE unsigned bits_of(Mask mask) {
  std::uint8_t bytes[8] = {};
  (void)hn::StoreMaskBits(Floats(), mask, bytes);
  return bytes[0];
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
  const V side = hn::Mul(x, hn::Set(d, c.tan_half));
  const V across = hn::Min(hn::Add(hn::Sub(side, y), support(0)), hn::Add(hn::Add(side, y), support(1)));
  const V along = hn::Min(hn::Add(hn::Sub(side, z), support(2)), hn::Add(hn::Add(side, z), support(3)));
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

/// Where one camera has to look for eight cubes. kInside: it sees all of them, as their parent has shown.
template <bool kInside>
HWY_INLINE void aim(const SightCamera& c, float half_m, const Lanes& at, Look& look) {
  const Floats d;
  const Ints di;
  alignas(32) std::int32_t u0[8];
  alignas(32) std::int32_t u1[8];
  alignas(32) std::int32_t v0[8];
  alignas(32) std::int32_t v1[8];
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
    const auto columns = store_pixels(u, half_width(c, 1, u, half_over_near), c.tan_half, c.columns_per_tan,
                                      c.last_column, u0 + i, u1 + i);
    const auto rows = store_pixels(v, half_width(c, 2, v, half_over_near), c.tan_half, c.rows_per_tan,
                                   c.last_row, v0 + i, v1 + i);
    longest = hn::Max(longest, hn::Max(columns, rows));
    // What the camera calls empty up to its range is believed up to the range itself: no margin there.
    const auto margin = hn::Add(set(c.margin_m), hn::Mul(set(c.margin_per_m2), hn::Mul(far, far)));
    const auto needed = hn::Min(hn::Add(far, margin), hn::Max(far, set(c.range_m)));
    const auto steps = set(c.pyramid->steps_per_m());
    hn::Store(hn::Mul(needed, steps), d, look.needed + i);
    hn::Store(hn::Mul(near, steps), d, look.nearest + i);
  }
  look.outside = outside;
  look.straddling = straddling & ~outside;
  look.inside = inside & ~(outside | straddling);

  // One level for all eight blocks, so that the result does not depend on how many are done at once.
  const std::int32_t side = hn::GetLane(hn::MaxOfLanes(di, longest)) + 1;
  const DepthPyramid::Level& level =
      c.pyramid->level(std::max(DepthPyramid::level_for(side), c.pyramid->first_level()));
  look.entry = level.entry;
  for (std::size_t i = 0; i < 8; i += hn::Lanes(d)) {
    const auto first = [&](const std::int32_t* from) {
      return hn::ShiftRightSame(hn::Load(di, from + i), level.shift);
    };
    const auto last = [&](const std::int32_t* to) {
      const auto past = hn::Add(hn::Load(di, to + i), hn::Set(di, 1 << level.shift));
      return hn::Sub(hn::ShiftRightSame(past, level.shift), hn::Set(di, level.back));
    };
    const auto column = first(u0), row = first(v0);
    const auto width = hn::Set(di, level.width);
    hn::Store(hn::Add(hn::Mul(row, width), column), di, look.above + i);
    hn::Store(hn::Add(hn::Mul(hn::Max(last(v1), row), width), column), di, look.below + i);
    hn::Store(hn::Max(hn::Sub(last(u1), column), hn::Zero(di)), di, look.more + i);
  }
}

HWY_INLINE void look_through(const Look& look, Marks<unsigned>& marks) {
  const Floats d;
  const Ints di;
  unsigned sees_past = 0, hidden = 0;
  for (std::size_t i = 0; i < 8; i += hn::Lanes(d)) {
    const auto entry = least_entries(look.entry, look.above + i, look.below + i, hn::Load(di, look.more + i));
    const auto least = hn::And(entry, hn::Set(di, 0xFFFF));
    const auto most = hn::Sub(hn::Set(di, DepthPyramid::kMaxSteps), hn::ShiftRight<16>(entry));
    sees_past |= bits_of(hn::Gt(hn::ConvertTo(d, least), hn::Load(d, look.needed + i))) << i;
    hidden |= bits_of(hn::Ge(hn::Load(d, look.nearest + i), hn::ConvertTo(d, most))) << i;
  }
  const unsigned looked = ~(look.outside | look.straddling) & 0xFFU;
  sees_past &= looked;
  hidden &= looked & ~sees_past;
  marks.free |= sees_past;
  marks.covered |= sees_past & look.inside;
  marks.blocked |= hidden & look.inside;
  marks.mixed |= look.straddling | (looked & ~sees_past & ~hidden);
}

HWY_INLINE float half_edge_m(int level) {
  return static_cast<float>((level == 0 ? kCore : 1.0) * 0.5 * cell_size_m(level));
}

/// Part of a brick.
struct Node {
  std::uint16_t morton;
  std::uint8_t level;
  std::uint8_t cameras;  ///< That can see some of it, and of these those that
  std::uint8_t inside;   ///< see all of it.
  std::array<std::array<float, 3>, kMaxCameras> p_C;
};

HWY_INLINE std::array<float, 3> in_camera(const SightCamera& c, const Vector3& p_W) {
  const Vector3 offset_W = p_W - c.p_WC;
  std::array<float, 3> p_C{};
  for (std::size_t row = 0; row < 3; ++row) {
    p_C[row] = c.R_CW[3 * row] * static_cast<float>(offset_W.x()) +
               c.R_CW[3 * row + 1] * static_cast<float>(offset_W.y()) +
               c.R_CW[3 * row + 2] * static_cast<float>(offset_W.z());
  }
  return p_C;
}

/// A camera's look at the children of a node.
struct Sight {
  Lanes at;  ///< In the frame of the camera.
  Look look;
  unsigned camera;
};

HWY_INLINE void place_children(const SightCamera& c, const std::array<float, 3>& p_C, int level, Lanes& at) {
  const Floats d;
  const auto quarter = hn::Set(d, static_cast<float>(0.25 * cell_size_m(level)));
  for (std::size_t i = 0; i < 8; i += hn::Lanes(d)) {
    const auto place = [&](std::size_t row) {
      return hn::Add(hn::Set(d, p_C[row]), hn::Mul(quarter, hn::Load(d, c.child[row].data() + i)));
    };
    hn::Store(place(0), d, at.x + i);
    hn::Store(place(1), d, at.y + i);
    hn::Store(place(2), d, at.z + i);
  }
}

/// From the cameras of a node to its children, in `sight`. Returns how many.
HWY_INLINE std::size_t aim_at_children(const SightCameras& cameras, const Node& node, Sight* sight) {
  const float half_m = half_edge_m(node.level - 1);
  std::size_t count = 0;
  for (unsigned set = node.cameras; set != 0; set &= set - 1) {
    const auto k = static_cast<std::size_t>(__builtin_ctz(set));
    const SightCamera& c = cameras.camera[k];
    Sight& s = sight[count++];
    s.camera = static_cast<unsigned>(k);
    place_children(c, node.p_C[k], node.level, s.at);
    if (((unsigned{node.inside} >> k) & 1U) != 0) {
      aim<true>(c, half_m, s.at, s.look);
    } else {
      aim<false>(c, half_m, s.at, s.look);
    }
  }
  return count;
}

HWY_INLINE Node node_of(const SightCameras& cameras, const SightBlock& block) {
  Node node{};
  node.level = static_cast<std::uint8_t>(block.level);
  node.cameras = block.cameras;
  for (std::size_t k = 0; k < cameras.count; ++k) node.p_C[k] = in_camera(cameras.camera[k], block.center_W);
  return node;
}

/// Eight blocks in the frame of a camera: center_W by axis.
HWY_INLINE void place_blocks(const SightCamera& c, const std::array<const double*, 3>& center_W, Lanes& at) {
  const Floats d;
  float* const lane[3] = {at.x, at.y, at.z};
  alignas(32) float offset[3][8];
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t i = 0; i < 8; ++i)
      offset[axis][i] = static_cast<float>(center_W[axis][i] - c.p_WC[static_cast<Eigen::Index>(axis)]);
  for (std::size_t row = 0; row < 3; ++row) {
    const auto turned = [&](std::size_t axis, std::size_t i) {
      return hn::Mul(hn::Set(d, c.R_CW[3 * row + axis]), hn::Load(d, offset[axis] + i));
    };
    for (std::size_t i = 0; i < 8; i += hn::Lanes(d))
      hn::Store(hn::Add(hn::Add(turned(0, i), turned(1, i)), turned(2, i)), d, lane[row] + i);
  }
}

void see_blocks_lanes(const SightCameras& cameras, int level, std::span<const Vector3> center_W,
                      BlocksSeen& seen) {
  const Floats d;
  const float half_m = half_edge_m(level);
  const std::size_t count = std::min(center_W.size(), BlocksSeen::kMost);
  alignas(32) double axis_W[3][BlocksSeen::kMost];
  for (std::size_t i = 0; i < (count + 7) / 8 * 8; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis)
      axis_W[axis][i] = center_W[std::min(i, count - 1)][static_cast<Eigen::Index>(axis)];
  seen.cameras.fill(0);
  Marks<std::uint64_t> marks;
  for (std::size_t k = 0; k < cameras.count; ++k) {
    const SightCamera& c = cameras.camera[k];
    Lanes at[BlocksSeen::kMost / 8];
    std::array<std::uint8_t, BlocksSeen::kMost + 8> in_view;
    std::size_t in_view_count = 0;
    for (std::size_t first = 0; first < count; first += 8) {
      Lanes& eight = at[first / 8];
      place_blocks(c, {axis_W[0] + first, axis_W[1] + first, axis_W[2] + first}, eight);
      unsigned outside = 0;
      for (std::size_t i = 0; i < 8; i += hn::Lanes(d))
        outside |= bits_of(out_of_view(c, half_m, hn::Load(d, eight.x + i), hn::Load(d, eight.y + i),
                                       hn::Load(d, eight.z + i)))
                   << i;
      for (unsigned bits = ~outside & 0xFFU; bits != 0; bits &= bits - 1)
        in_view[in_view_count++] =
            static_cast<std::uint8_t>(first + static_cast<std::size_t>(__builtin_ctz(bits)));
    }
    if (in_view_count == 0) continue;
    for (std::size_t i = 0; i < 8; ++i) in_view[in_view_count + i] = in_view[in_view_count - 1];
    for (std::size_t first = 0; first < in_view_count; first += 8) {
      Lanes eight;
      for (std::size_t i = 0; i < 8; ++i) {
        const std::size_t block = in_view[first + i];
        eight.x[i] = at[block / 8].x[block % 8];
        eight.y[i] = at[block / 8].y[block % 8];
        eight.z[i] = at[block / 8].z[block % 8];
        seen.cameras[block] = static_cast<std::uint8_t>(seen.cameras[block] | 1U << k);
      }
      Look look;
      aim<false>(c, half_m, eight, look);
      Marks<unsigned> here;
      look_through(look, here);
      const auto spread = [&](unsigned bits, std::uint64_t& to) {
        for (; bits != 0; bits &= bits - 1)
          to |= std::uint64_t{1} << in_view[first + static_cast<std::size_t>(__builtin_ctz(bits))];
      };
      spread(here.free, marks.free);
      spread(here.mixed, marks.mixed);
      spread(here.blocked, marks.blocked);
      spread(here.covered, marks.covered);
    }
  }
  const Decision<std::uint64_t> decision = decide(marks, cameras.complete);
  seen.free = decision.free;
  seen.mixed = decision.mixed;
}

EightSeen see_children_lanes(const SightCameras& cameras, const SightBlock& parent) {
  const Node node = node_of(cameras, parent);
  std::array<Sight, kMaxCameras> sight;
  const std::size_t count = aim_at_children(cameras, node, sight.data());
  Marks<unsigned> marks;
  EightSeen seen{};
  for (std::size_t j = 0; j < count; ++j) {
    look_through(sight[j].look, marks);
    for (unsigned i = 0; i < 8; ++i)
      seen.cameras[i] = static_cast<std::uint8_t>(seen.cameras[i] | (~(sight[j].look.outside >> i) & 1U)
                                                                        << sight[j].camera);
  }
  const Decision<unsigned> decision = decide(marks, cameras.complete);
  seen.free = static_cast<std::uint8_t>(decision.free);
  seen.mixed = static_cast<std::uint8_t>(decision.mixed);
  return seen;
}

void see_brick_lanes(const SightCameras& cameras, const SightBlock& brick, int finest, BrickSeen& seen) {
  // Depth first, but up to eight nodes of a level together, step by step: what one waits for the next can
  // use.
  constexpr std::size_t kTogether = 8;
  // Nodes of level 3, all looked at together, have 64 children of level 2; eight of these have 64 of level 1.
  std::array<Node, 64 - kTogether + 64> stack;
  std::array<Sight, kTogether * kMaxCameras> sight;
  stack[0] = node_of(cameras, brick);
  std::size_t depth = 1;
  seen.count = 0;
  seen.visited = 0;
  seen.free_cells = 0;
  while (depth > 0) {
    const int level = stack[depth - 1].level - 1;
    std::array<unsigned, kTogether> morton;
    std::array<std::size_t, kTogether + 1> first{};  // of a node's sights
    std::size_t nodes = 0;
    while (depth > 0 && nodes < kTogether && stack[depth - 1].level == level + 1) {
      const Node& node = stack[--depth];
      morton[nodes] = node.morton;
      first[nodes + 1] = first[nodes] + aim_at_children(cameras, node, &sight[first[nodes]]);
      ++nodes;
    }
    seen.visited += static_cast<std::uint32_t>(nodes);
    for (std::size_t n = 0; n < nodes; ++n) {
      Marks<unsigned> marks;
      for (std::size_t j = first[n]; j < first[n + 1]; ++j) look_through(sight[j].look, marks);
      const Decision<unsigned> decision = decide(marks, cameras.complete);
      seen.group[seen.count] = {static_cast<std::uint16_t>(morton[n]), static_cast<std::uint8_t>(level),
                                static_cast<std::uint8_t>(decision.free)};
      seen.count += decision.free != 0 ? 1U : 0U;
      seen.free_cells += static_cast<std::uint32_t>(__builtin_popcount(decision.free))
                         << (3U * static_cast<unsigned>(level));
      if (level <= finest) continue;
      for (unsigned mixed = decision.mixed; mixed != 0; mixed &= mixed - 1) {
        const auto i = static_cast<unsigned>(__builtin_ctz(mixed));
        Node& child = stack[depth++];
        child.morton = static_cast<std::uint16_t>(8U * morton[n] + i);
        child.level = static_cast<std::uint8_t>(level);
        unsigned can_see = 0, inside = 0;
        for (std::size_t j = first[n]; j < first[n + 1]; ++j) {
          const Sight& s = sight[j];
          can_see |= (~(s.look.outside >> i) & 1U) << s.camera;
          inside |= ((s.look.inside >> i) & 1U) << s.camera;
          std::array<float, 3>& p_C = child.p_C[s.camera];
          p_C[0] = s.at.x[i];
          p_C[1] = s.at.y[i];
          p_C[2] = s.at.z[i];
        }
        child.cameras = static_cast<std::uint8_t>(can_see);
        child.inside = static_cast<std::uint8_t>(inside);
      }
    }
  }
}

void end_cells_lanes(const PixelLine& line, std::span<const float> depth_m, float range_m, SurfaceRow& row) {
  const Floats d;
  const Ints di;
  constexpr float kBias = 4096.0F;  // makes truncation round down
  constexpr std::int32_t kNone = -1;
  const std::size_t count = depth_m.size();
  constexpr std::size_t kPad = SurfaceRow::kPad;
  alignas(32) std::int32_t cell[3][kPad + DepthPyramid::kMaxPixels + kPad];
  const auto some = [&](const float* depth, std::size_t u) {
    const auto z = hn::LoadU(d, depth);
    auto inside = hn::RebindMask(di, hn::And(hn::Gt(z, hn::Zero(d)), hn::Lt(z, hn::Set(d, range_m))));
    const auto far = hn::IfThenElseZero(hn::RebindMask(d, inside), z);
    const auto column = hn::ConvertTo(d, hn::Iota(di, static_cast<std::int32_t>(u)));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto direction =
          hn::Add(hn::Set(d, line.first[axis]), hn::Mul(column, hn::Set(d, line.step[axis])));
      const auto cells = hn::Add(hn::Mul(far, direction), hn::Set(d, line.rest[axis] + kBias));
      const auto c = hn::Add(hn::ConvertTo(di, cells),
                             hn::Set(di, line.origin[axis] - static_cast<std::int32_t>(kBias)));
      inside = hn::And(inside, hn::And(hn::Gt(c, hn::Set(di, line.low[axis] - 1)),
                                       hn::Lt(c, hn::Set(di, line.high[axis] + 1))));
      hn::Store(c, di, cell[axis] + kPad + u);
    }
    hn::Store(hn::IfThenElse(inside, hn::Load(di, cell[0] + kPad + u), hn::Set(di, kNone)), di,
              cell[0] + kPad + u);
  };
  const std::size_t lanes = hn::Lanes(d);
  std::size_t u = 0;
  for (; u + lanes <= count; u += lanes) some(depth_m.data() + u, u);
  if (u < count) {
    float tail[8] = {};
    for (std::size_t i = 0; u + i < count; ++i) tail[i] = depth_m[u + i];
    some(tail, u);
  }
  // Keep those that differ from their left neighbour.
  for (auto& axis : cell) axis[kPad - 1] = kNone;
  row.count = 0;
  for (u = 0; u < count; u += lanes) {
    const auto differs = [&](std::size_t axis) {
      return hn::Ne(hn::Load(di, cell[axis] + kPad + u), hn::LoadU(di, cell[axis] + kPad + u - 1));
    };
    const auto is_new = hn::Or(differs(0), hn::Or(differs(1), differs(2)));
    const auto keep = hn::And(is_new, hn::Gt(hn::Load(di, cell[0] + kPad + u), hn::Set(di, kNone)));
    // Not CompressStore(): Highway 1.0 copies its table of 1 KiB to the stack at each call.
    for (unsigned bits = bits_of(hn::RebindMask(d, keep)); bits != 0; bits &= bits - 1, ++row.count) {
      const std::size_t at = kPad + u + static_cast<std::size_t>(__builtin_ctz(bits));
      for (std::size_t axis = 0; axis < 3; ++axis) row.cell[axis][row.count] = cell[axis][at];
    }
  }
}

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

StripSeen tile_steps_lanes(const DepthStrip& strip, int shift, DepthPyramid::Entry* entry) {
  const Floats d;
  const Ints di;
  const std::size_t lanes = hn::Lanes(d);
  const auto range = hn::Set(d, strip.range_m), scale = hn::Set(d, strip.steps_per_m);
  const auto none = hn::Set(d, 2.0F * kMaxRange_m);
  const auto least_nan =
      hn::Add(hn::BitCast(di, hn::Set(d, std::numeric_limits<float>::infinity())), hn::Set(di, 1));
  const auto min = [](auto a, auto b) { return hn::Min(a, b); };
  const auto max = [](auto a, auto b) { return hn::Max(a, b); };
  // The bits of floats > 0 have the order of the floats.
  constexpr std::size_t kBeyond = 24;
  alignas(32) std::int32_t least[DepthPyramid::kMaxPixels + 8 + kBeyond];
  alignas(32) std::int32_t most[DepthPyramid::kMaxPixels + 8 + kBeyond];
  StripSeen seen;
  const auto some = [&](const float* depth, std::size_t stride, std::size_t u) {
    auto low = hn::BitCast(di, hn::LoadU(d, depth)), high = low;
    for (std::size_t v = 1; v < strip.rows; ++v) {
      const auto raw = hn::BitCast(di, hn::LoadU(d, depth + v * stride));
      low = hn::Min(low, raw);
      high = hn::Max(high, raw);
    }
    // As integers, what is not > 0 lies below it, and so do NaNs with a sign; the others lie above infinity.
    if (!hn::AllTrue(di, hn::And(hn::Gt(low, hn::Zero(di)), hn::Lt(high, least_nan)))) {
      seen.incomplete |= std::uint64_t{1} << (u / 8);
      low = hn::BitCast(di, none);
      high = hn::Zero(di);
      for (std::size_t v = 0; v < strip.rows; ++v) {
        const auto raw = hn::LoadU(d, depth + v * stride);
        const auto known = hn::Gt(raw, hn::Zero(d));
        low = hn::Min(low, hn::BitCast(di, hn::IfThenElse(known, raw, none)));
        high = hn::Max(high, hn::BitCast(di, hn::IfThenElseZero(known, raw)));
      }
    }
    hn::StoreU(low, di, least + u);
    hn::StoreU(high, di, most + u);
  };
  std::size_t u = 0;
  for (; u + lanes <= strip.width; u += lanes) some(strip.depth_m + u, strip.width, u);
  if (u < strip.width) {
    float tail[8 * kMaxTile] = {};
    for (std::size_t v = 0; v < strip.rows; ++v)
      for (std::size_t i = 0; i < 8; ++i)
        tail[8 * v + i] = strip.depth_m[v * strip.width + std::min(u + i, strip.width - 1)];
    some(tail, 8, u);
  }
  // Neighbours in pairs, until a column is a tile. Beyond the last one stands what changes nothing.
  const std::size_t tiles =
      (strip.width + (std::size_t{1} << static_cast<unsigned>(shift)) - 1) >> static_cast<unsigned>(shift);
  const std::size_t stored = (strip.width + lanes - 1) / lanes * lanes;
  for (std::size_t i = stored; i < stored + kBeyond; i += lanes) {
    hn::Store(hn::BitCast(di, none), di, least + i);
    hn::Store(hn::Zero(di), di, most + i);
  }
  for (unsigned k = 1; k <= static_cast<unsigned>(shift); ++k) {
    const std::size_t count = tiles << (static_cast<unsigned>(shift) - k);
    for (std::size_t x = 0; x < count; x += lanes) {
      keep_of_pairs(least + 2 * x, least + x, min);
      keep_of_pairs(most + 2 * x, most + x, max);
    }
  }
  const auto all = hn::Set(di, DepthPyramid::kMaxSteps), one = hn::Set(di, 1);
  const auto steps = [&](auto z) { return hn::ConvertTo(di, hn::Mul(hn::Min(z, range), scale)); };
  for (std::size_t x = 0; x < tiles; x += lanes) {
    const auto near = hn::BitCast(d, hn::LoadU(di, least + x)), far = hn::BitCast(d, hn::LoadU(di, most + x));
    const auto ends = hn::Lt(near, range), all_end = hn::Lt(far, range);
    seen.surface = seen.surface || !hn::AllFalse(d, ends);
    const auto least_steps = hn::IfThenElse(hn::RebindMask(di, ends), steps(near), all);
    const auto not_most =
        hn::IfThenElseZero(hn::RebindMask(di, all_end), hn::Sub(hn::Sub(all, steps(far)), one));
    const auto nothing = hn::RebindMask(di, hn::Eq(far, hn::Zero(d)));
    hn::StoreU(hn::Or(least_steps, hn::ShiftLeft<16>(hn::IfThenElse(nothing, all, not_most))), di, least + x);
  }
  std::memcpy(entry, least, tiles * sizeof(DepthPyramid::Entry));
  return seen;
}

std::size_t informed_pixels_lanes(std::span<const float> depth_m) {
  const Floats d;
  const Ints di;
  const std::size_t lanes = hn::Lanes(d);
  auto informed = hn::Zero(di);
  std::size_t i = 0;
  for (; i + lanes <= depth_m.size(); i += lanes) {
    const auto known = hn::Gt(hn::LoadU(d, depth_m.data() + i), hn::Zero(d));
    informed = hn::Sub(informed, hn::VecFromMask(di, hn::RebindMask(di, known)));
  }
  auto count = static_cast<std::size_t>(hn::GetLane(hn::SumOfLanes(di, informed)));
  for (; i < depth_m.size(); ++i) count += depth_m[i] > 0.0F ? 1U : 0U;
  return count;
}

void tile_boxes_lanes(const TileLine& line, const TileEntries& tiles, TileRow& row) {
  const Floats d;
  const Ints di;
  constexpr float kBias = 4096.0F;    // makes truncation round down
  constexpr float kRounding = 4e-3F;  // of a cell
  const auto m_per_step = hn::Set(d, 1.0F / line.steps_per_m);
  for (std::size_t x = 0; x < tiles.count; x += hn::Lanes(d)) {
    alignas(32) std::int32_t raw[8] = {};
    for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
      const DepthPyramid::Entry& e = tiles.entry[tiles.stride * std::min(x + i, tiles.count - 1)];
      raw[i] = e.least_steps | (static_cast<std::int32_t>(e.not_most_steps) << 16U);
      row.surface[x + i] = e.least_steps < DepthPyramid::kMaxSteps;
    }
    const auto steps = hn::Load(di, raw);
    const auto near = hn::Mul(hn::ConvertTo(d, hn::And(steps, hn::Set(di, 0xFFFF))), m_per_step);
    const auto most = hn::Sub(hn::Set(di, DepthPyramid::kMaxSteps), hn::ShiftRight<16>(steps));
    const auto far = hn::Mul(hn::ConvertTo(d, most), m_per_step);
    const auto column = hn::ConvertTo(d, hn::Iota(di, static_cast<std::int32_t>(x)));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto center = hn::Add(hn::Set(d, line.first[axis]), hn::Mul(column, hn::Set(d, line.step[axis])));
      const auto half = hn::Set(d, line.half[axis]);
      const auto low = hn::Sub(center, half), high = hn::Add(center, half);
      const auto cell = [&](auto offset, float margin) {
        return hn::Add(hn::ConvertTo(di, hn::Add(offset, hn::Set(d, line.rest[axis] + kBias + margin))),
                       hn::Set(di, line.origin[axis] - static_cast<std::int32_t>(kBias)));
      };
      hn::Store(cell(hn::Min(hn::Mul(low, near), hn::Mul(low, far)), -kRounding), di,
                row.low[axis].data() + x);
      hn::Store(cell(hn::Max(hn::Mul(high, near), hn::Mul(high, far)), kRounding), di,
                row.high[axis].data() + x);
      hn::Store(cell(hn::Mul(center, near), 0.0F), di, row.nearest[axis].data() + x);
    }
  }
}

void least_of_four_lanes(const DepthPyramid::Entry* above, const DepthPyramid::Entry* below,
                         std::size_t stride, std::size_t count, DepthPyramid::Entry* to) {
  const auto least = [](DepthPyramid::Entry a, DepthPyramid::Entry b) {
    return DepthPyramid::Entry{std::min(a.least_steps, b.least_steps),
                               std::min(a.not_most_steps, b.not_most_steps)};
  };
  std::size_t x = 0;
#if HWY_TARGET != HWY_SCALAR
  const hn::CappedTag<std::int16_t, 16> d;
  const std::size_t entries = hn::Lanes(d) / 2;
  const auto at = [&](const DepthPyramid::Entry* entry) { return hn::LoadU(d, &entry->least_steps); };
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

std::size_t brick_flags_lanes(const std::uint64_t* word, std::uint8_t* mip) {
  // Of eight cells, half bytes: bit 0 alone is free, bit 3 is occupied, 0 is unknown.
  constexpr std::uint32_t kOnes = 0x11111111U;
  std::size_t unknown = 0;
  std::size_t i = 0;
#if HWY_TARGET != HWY_SCALAR
  const hn::CappedTag<std::uint32_t, 8> d;
  const hn::Repartition<std::uint64_t, decltype(d)> d64;
  const hn::Rebind<std::uint8_t, decltype(d)> d8;
  const auto ones = hn::Set(d, kOnes), zero = hn::Zero(d);
  const auto flag = [&](auto cells, std::uint8_t value) {
    return hn::IfThenElse(hn::Eq(cells, zero), zero, hn::Set(d, value));
  };
  auto sum = zero;
  for (; i < kCellsPerBrick / 8; i += hn::Lanes(d)) {
    const auto cells = hn::BitCast(d, hn::LoadU(d64, word + i / 2));
    const auto occupied = hn::And(hn::ShiftRight<3>(cells), ones);
    const auto free = hn::AndNot(occupied, hn::And(cells, ones));
    const auto unknown_here = hn::AndNot(hn::Or(occupied, free), ones);
    sum = hn::Add(sum, hn::ShiftRight<28>(hn::Mul(unknown_here, ones)));
    const auto flags = hn::Or(flag(unknown_here, content::kUnknown),
                              hn::Or(flag(occupied, content::kOccupied), flag(free, content::kFree)));
    hn::StoreU(hn::TruncateTo(d8, flags), d8, mip + i);
  }
  unknown = hn::GetLane(hn::SumOfLanes(d, sum));
#endif
  for (; i < kCellsPerBrick / 8; ++i) {
    const auto cells = static_cast<std::uint32_t>(word[i / 2] >> (32U * (i % 2)));
    const std::uint32_t occupied = (cells >> 3U) & kOnes, free = cells & kOnes & ~occupied;
    const std::uint32_t unknown_here = kOnes & ~(occupied | free);
    unknown += (unknown_here * kOnes) >> 28U;
    mip[i] = static_cast<std::uint8_t>((unknown_here != 0 ? content::kUnknown : 0U) |
                                       (occupied != 0 ? content::kOccupied : 0U) |
                                       (free != 0 ? content::kFree : 0U));
  }
  return kCellsPerBrick - unknown;
}

}  // namespace roborun::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace roborun::stages {

HWY_EXPORT(see_blocks_lanes);
HWY_EXPORT(see_children_lanes);
HWY_EXPORT(see_brick_lanes);
HWY_EXPORT(end_cells_lanes);
HWY_EXPORT(tile_steps_lanes);
HWY_EXPORT(informed_pixels_lanes);
HWY_EXPORT(tile_boxes_lanes);
HWY_EXPORT(least_of_four_lanes);
HWY_EXPORT(brick_flags_lanes);

void SightCamera::prepare(const PosedDepthFrame& posed, const DepthPyramid& image,
                          const Margin& depth_margin) noexcept {
  const Matrix3 R = posed.X_WC.R_RT.transpose();
  const auto t = static_cast<double>(posed.frame.tan_half_fov_ratio);
  p_WC = posed.X_WC.p_RT;
  const auto sum_abs = [&R, t](double of_x, int row, double of_row) {
    double sum = 0.0;
    for (int i = 0; i < 3; ++i) sum += std::fabs(of_x * t * R(0, i) + of_row * R(row, i));
    return static_cast<float>(sum);
  };
  for (int i = 0; i < 9; ++i) R_CW[static_cast<std::size_t>(i)] = static_cast<float>(R(i / 3, i % 3));
  for (std::size_t i = 0; i < 8; ++i) {
    const Vector3 offset_W((i & 1U) != 0 ? 1.0 : -1.0, (i & 2U) != 0 ? 1.0 : -1.0,
                           (i & 4U) != 0 ? 1.0 : -1.0);
    const Vector3 offset_C = R * offset_W;
    for (std::size_t row = 0; row < 3; ++row)
      child[row][i] = static_cast<float>(offset_C[static_cast<Eigen::Index>(row)]);
  }
  extent = sum_abs(0.0, 0, 1.0);
  support = {sum_abs(1.0, 1, -1.0), sum_abs(1.0, 1, 1.0), sum_abs(1.0, 2, -1.0), sum_abs(1.0, 2, 1.0)};
  tan_half = posed.frame.tan_half_fov_ratio;
  range_m = posed.frame.range_m;
  columns_per_tan = static_cast<float>(0.5 * posed.frame.width / t);
  rows_per_tan = static_cast<float>(0.5 * posed.frame.height / t);
  last_column = static_cast<float>(posed.frame.width - 1);
  last_row = static_cast<float>(posed.frame.height - 1);
  margin_m = static_cast<float>(depth_margin.constant_m);
  margin_per_m2 = static_cast<float>(depth_margin.per_m2);
  pyramid = &image;
}

BlocksSeen see_blocks(const SightCameras& cameras, int level, std::span<const Vector3> center_W) noexcept {
  BlocksSeen seen;
  HWY_DYNAMIC_DISPATCH(see_blocks_lanes)(cameras, level, center_W, seen);
  return seen;
}

EightSeen see_children(const SightCameras& cameras, const SightBlock& parent) noexcept {
  return HWY_DYNAMIC_DISPATCH(see_children_lanes)(cameras, parent);
}

void see_brick(const SightCameras& cameras, const SightBlock& brick, int finest, BrickSeen& seen) noexcept {
  HWY_DYNAMIC_DISPATCH(see_brick_lanes)(cameras, brick, finest, seen);
}

void end_cells(const PixelLine& line, std::span<const float> depth_m, float range_m,
               SurfaceRow& row) noexcept {
  HWY_DYNAMIC_DISPATCH(end_cells_lanes)(line, depth_m, range_m, row);
}

StripSeen tile_steps(const DepthStrip& strip, int shift, DepthPyramid::Entry* entry) noexcept {
  return HWY_DYNAMIC_DISPATCH(tile_steps_lanes)(strip, shift, entry);
}

std::size_t informed_pixels(std::span<const float> depth_m) noexcept {
  return HWY_DYNAMIC_DISPATCH(informed_pixels_lanes)(depth_m);
}

void tile_boxes(const TileLine& line, const TileEntries& tiles, TileRow& row) noexcept {
  HWY_DYNAMIC_DISPATCH(tile_boxes_lanes)(line, tiles, row);
}

void least_of_four(const DepthPyramid::Entry* above, const DepthPyramid::Entry* below, std::size_t stride,
                   std::size_t count, DepthPyramid::Entry* to) noexcept {
  HWY_DYNAMIC_DISPATCH(least_of_four_lanes)(above, below, stride, count, to);
}

std::size_t brick_flags(const std::array<std::uint64_t, Brick::kWords>& word, std::uint8_t* mip) noexcept {
  return HWY_DYNAMIC_DISPATCH(brick_flags_lanes)(word.data(), mip);
}

std::int64_t sight_instruction_sets() noexcept { return hwy::SupportedTargets(); }

void use_sight_instruction_sets(std::int64_t sets) noexcept {
  hwy::SetSupportedTargetsForTest(sets == ~std::int64_t{0} ? 0 : sets);
  hwy::GetChosenTarget().DeInit();
}

}  // namespace roborun::stages
#endif  // HWY_ONCE
