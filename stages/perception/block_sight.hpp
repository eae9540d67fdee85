/// Which blocks of space do the cameras of one scan see through? Eight blocks at a time, with the widest
/// vector instructions of the machine; the same bits on all of them.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "stages/perception/sight_camera.hpp"

namespace roborun::stages {

/// Eight blocks of one size. At the finest level only the inner half of a cell's edge counts: a surface in
/// its rim ends in it, and is written after free space; without this a cell that touches a shadow or the
/// ground is never free. `free`: seen past, all over, and no camera disagrees. `mixed`: smaller blocks may be
/// free. Bit i is block i.
struct EightSeen {
  std::uint8_t free{}, mixed{};
  std::array<std::uint8_t, 8> cameras{};  ///< For each block, the set of cameras that can see some of it.
};

/// The same of many blocks.
struct BlocksSeen {
  static constexpr std::size_t kMost = 64;
  std::uint64_t free{}, mixed{};
  std::array<std::uint8_t, kMost> cameras{};
};

/// A block and the cameras that can see some of it.
struct SightBlock {
  Vector3 center_W = Vector3::Zero();
  int level{};
  std::uint8_t cameras{};
};

/// Free blocks of a brick: bit i of `free` is the block of `level` with Morton index 8 * parent + i.
struct FreeGroup {
  std::uint16_t parent;
  std::uint8_t level;
  std::uint8_t free;
  std::uint8_t in_part;  ///< Of these, blocks of which many pixels were in a hole.
};
/// Room for a group of each block of level 4 .. 1; there are those of divided ones with a free child, in any
/// order.
struct BrickSeen {
  static constexpr std::size_t kMaxGroups = 1 + 8 + 64 + 512;
  std::array<FreeGroup, kMaxGroups> group;
  std::size_t count{0};
  std::uint32_t visited{0};     ///< Blocks divided.
  std::uint32_t free_cells{0};  ///< Of level 0, in all groups.
};

/// At most kMost blocks of any position; each camera looks only at those in its view. RT-safe: O(cameras).
[[nodiscard]] BlocksSeen see_blocks(const SightCameras& cameras, int level,
                                    std::span<const Vector3> center_W) noexcept;
/// The eight children of a block, in Morton order. RT-safe: O(cameras).
[[nodiscard]] EightSeen see_children(const SightCameras& cameras, const SightBlock& parent) noexcept;
/// Divides a brick (level 4) down to blocks of level `finest` (0 .. 3). RT-safe: at most kMaxGroups times
/// see_children().
void see_brick(const SightCameras& cameras, const SightBlock& brick, int finest, BrickSeen& seen) noexcept;

}  // namespace roborun::stages
