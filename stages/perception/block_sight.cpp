// See block_sight.hpp.
// Compiled once per instruction set: foreach_target includes this file again.
#include "stages/perception/instruction_sets.hpp"
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stages/perception/block_sight.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#include <algorithm>

#include "stages/perception/block_look.hpp"
#include "stages/perception/block_sight.hpp"

HWY_BEFORE_NAMESPACE();
namespace roborun::stages::HWY_NAMESPACE {

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

HWY_INLINE void place_children(const SightCamera& c, const std::array<float, 3>& p_C, double edge_m,
                               Lanes& at) {
  const Floats d;
  const auto quarter = hn::Set(d, static_cast<float>(0.25 * edge_m));
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
  const float half_m = half_edge_m(cameras.lattice, node.level - 1);
  std::size_t count = 0;
  for (unsigned set = node.cameras; set != 0; set &= set - 1) {
    const auto k = static_cast<std::size_t>(__builtin_ctz(set));
    const SightCamera& c = cameras.camera[k];
    Sight& s = sight[count++];
    s.camera = static_cast<unsigned>(k);
    place_children(c, node.p_C[k], cameras.lattice.cell_size_m(node.level), s.at);
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
  const float half_m = half_edge_m(cameras.lattice, level);
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
      look_through(look, {}, here);
      const auto spread = [&](unsigned bits, std::uint64_t& to) {
        for (; bits != 0; bits &= bits - 1)
          to |= std::uint64_t{1} << in_view[first + static_cast<std::size_t>(__builtin_ctz(bits))];
      };
      spread(here.free, marks.free);
      spread(here.mixed, marks.mixed);
      spread(here.blocked, marks.blocked);
      spread(here.covered, marks.covered);
      spread(here.sparse, marks.sparse);
      spread(here.unseen, marks.unseen);
      spread(here.shaded, marks.shaded);
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
  const HoleShare share = hole_share(cameras.lattice, parent.level - 1, 0);
  for (std::size_t j = 0; j < count; ++j) {
    look_through(sight[j].look, share, marks);
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
    const HoleShare share = hole_share(cameras.lattice, level, finest);
    for (std::size_t n = 0; n < nodes; ++n) {
      Marks<unsigned> marks;
      for (std::size_t j = first[n]; j < first[n + 1]; ++j) look_through(sight[j].look, share, marks);
      const Decision<unsigned> decision = decide(marks, cameras.complete);
      seen.group[seen.count] = {static_cast<std::uint16_t>(morton[n]), static_cast<std::uint8_t>(level),
                                static_cast<std::uint8_t>(decision.free),
                                static_cast<std::uint8_t>(decision.in_part)};
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

}  // namespace roborun::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace roborun::stages {

HWY_EXPORT(see_blocks_lanes);
HWY_EXPORT(see_children_lanes);
HWY_EXPORT(see_brick_lanes);

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

}  // namespace roborun::stages
#endif  // HWY_ONCE
