#include "platform/sitl/world/octomap_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "platform/sitl/world/input_error.hpp"
#include "platform/sitl/world/world_file.hpp"

namespace roborun::sitl {
namespace {

constexpr int kDepth = kOctomapDepth;
constexpr double kMaxVoxels = 4e9;  // bits of the dense grid: 512 MB

struct Leaf {
  std::uint64_t morton;
  std::int64_t size;
};

struct Header {
  std::size_t data{};
  double resolution_m{};
};

[[noreturn]] void refuse(const std::string& name, const std::string& what) {
  throw InputError(fmt::format("{}: {}", name, what));
}

Header parse_header(std::span<const unsigned char> bytes, bool full, const std::string& name) {
  const std::string magic = full ? "# Octomap OcTree file" : "# Octomap OcTree binary file";
  const auto line_at = [&](std::size_t& at) {
    std::string line;
    while (at < bytes.size() && bytes[at] != '\n' && line.size() < 512)
      line.push_back(static_cast<char>(bytes[at++]));
    if (at >= bytes.size() || bytes[at] != '\n')
      refuse(name, "truncated OctoMap header: must hold id, size, res and data lines");
    ++at;
    return line;
  };
  std::size_t at = 0;
  if (line_at(at).rfind(magic, 0) != 0)
    refuse(name, fmt::format("not an OctoMap file: line 1 must be '{}'", magic));
  Header header;
  bool id_ok = false;
  for (int i = 0; i < 64; ++i) {
    const std::string line = line_at(at);
    if (line == "data") {
      header.data = at;
      if (!id_ok) refuse(name, "OctoMap header without 'id OcTree'");
      if (!(header.resolution_m >= 0.001 && header.resolution_m <= 100.0))
        refuse(name, "OctoMap header: res must be 0.001 .. 100 m");
      return header;
    }
    if (line.rfind("id ", 0) == 0) {
      if (line != "id OcTree")
        refuse(name, fmt::format("OctoMap tree of type '{}': only OcTree is read", line.substr(3)));
      id_ok = true;
    } else if (line.rfind("res ", 0) == 0) {
      header.resolution_m = std::strtod(line.c_str() + 4, nullptr);
    }
  }
  refuse(name, "OctoMap header too long: no 'data' line");
}

/// Walks the tree in file order with an explicit stack and calls on_leaf(leaf, occupied).
template <typename LeafFunction>
void walk(std::span<const unsigned char> data, bool full, const std::string& name, LeafFunction&& on_leaf) {
  struct Frame {
    std::uint64_t morton;
    int depth;
    unsigned rest;  // children still to come; .bt: two bits a child; .ot: one bit a child
  };
  std::size_t at = 0;
  const auto need = [&](std::size_t count) {
    if (data.size() - at < count) refuse(name, fmt::format("truncated OctoMap data at byte {}", at));
  };
  float value = 0.0F;
  const auto read_node = [&](unsigned& children) {
    if (full) {
      need(5);
      std::memcpy(&value, data.data() + at, 4);
      children = data[at + 4];
      at += 5;
    } else {
      need(2);
      children = static_cast<unsigned>(data[at]) | (static_cast<unsigned>(data[at + 1]) << 8U);
      at += 2;
    }
  };
  std::array<Frame, kDepth + 1> stack{};
  int top = 0;
  unsigned root = 0;
  if (data.empty()) return;
  read_node(root);
  stack[0] = {0, 0, root};
  if (full && root == 0) on_leaf(Leaf{0, std::int64_t{1} << kDepth}, value > 0.0F);
  while (top >= 0) {
    Frame& frame = stack[static_cast<std::size_t>(top)];
    if (frame.rest == 0) {
      --top;
      continue;
    }
    const auto child = static_cast<unsigned>(
                           std::countr_zero(full ? frame.rest : (frame.rest | frame.rest >> 1U) & 0x5555U)) /
                       (full ? 1U : 2U);
    const unsigned code = full ? 3U : (frame.rest >> (2U * child)) & 3U;  // .bt: 1 free, 2 occupied, 3 inner
    frame.rest &= ~(full ? 1U << child : 3U << (2U * child));
    const int depth = frame.depth + 1;
    const std::int64_t size = std::int64_t{1} << (kDepth - depth);
    // The number of a child is its digit of the Morton index.
    const std::uint64_t morton = frame.morton + (std::uint64_t{child} << (3 * (kDepth - depth)));
    if (code != 3U) {
      on_leaf(Leaf{morton, size}, code == 2U);
      continue;
    }
    if (!full && depth >= kDepth) refuse(name, "OctoMap data deeper than 16 levels");
    unsigned children = 0;
    read_node(children);
    if (full && children == 0) {
      on_leaf(Leaf{morton, size}, value > 0.0F);
      continue;
    }
    if (depth == kDepth) refuse(name, "OctoMap data deeper than 16 levels");
    stack[static_cast<std::size_t>(++top)] = {morton, depth, children};
  }
  if (at != data.size())
    refuse(name, fmt::format("{} bytes after the end of the OctoMap tree", data.size() - at));
}

}  // namespace

OctomapLeaves read_octomap(std::span<const unsigned char> bytes, bool full, const std::string& name) {
  const Header header = parse_header(bytes, full, name);
  OctomapLeaves map;
  map.resolution_m = header.resolution_m;
  // File order is Morton order, because children come by number: x, then y, then z.
  walk(bytes.subspan(header.data), full, name, [&](const Leaf& leaf, bool occupied) {
    map.leaves.push_back({leaf.morton, static_cast<std::int32_t>(leaf.size), occupied});
  });
  if (map.leaves.empty()) refuse(name, "the OctoMap tree is empty: no leaf is known");
  return map;
}

VoxelGrid parse_octomap(std::span<const unsigned char> bytes, bool full, const std::string& name) {
  const Header header = parse_header(bytes, full, name);
  const auto data = bytes.subspan(header.data);
  // Two walks: first the extent, then the voxels. Nothing is stored in between.
  constexpr std::int64_t kCentre = std::int64_t{1} << (kDepth - 1);
  std::array<std::int64_t, 3> low{1 << kDepth, 1 << kDepth, 1 << kDepth};
  std::array<std::int64_t, 3> high{0, 0, 0};
  std::size_t leaves = 0;
  walk(data, full, name, [&](const Leaf& leaf, bool) {
    ++leaves;
    const std::array<std::int32_t, 3> first = octomap_cell(leaf.morton);
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min<std::int64_t>(low[i], first[i]);
      high[i] = std::max(high[i], first[i] + leaf.size);
    }
  });
  if (leaves == 0) refuse(name, "the OctoMap tree is empty: no leaf is known");
  std::array<std::int64_t, 3> count{};
  double voxels = 1.0;
  for (std::size_t i = 0; i < 3; ++i) {
    count[i] = high[i] - low[i];
    voxels *= static_cast<double>(count[i]);
  }
  if (voxels > kMaxVoxels)
    refuse(name,
           fmt::format("the box around all leaves has {:.3g} voxels: at most {:.0e}", voxels, kMaxVoxels));
  const Vector3 min_W = header.resolution_m * Vector3(static_cast<double>(low[0] - kCentre),
                                                      static_cast<double>(low[1] - kCentre),
                                                      static_cast<double>(low[2] - kCentre));
  VoxelGrid grid(min_W, header.resolution_m, count);
  walk(data, full, name, [&](const Leaf& leaf, bool occupied) {
    if (!occupied) return;
    const std::array<std::int32_t, 3> first = octomap_cell(leaf.morton);
    grid.fill({first[0] - low[0], first[1] - low[1], first[2] - low[2]}, leaf.size);
  });
  return grid;
}

}  // namespace roborun::sitl
