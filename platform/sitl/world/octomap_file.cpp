#include "platform/sitl/world/octomap_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "platform/input/input_error.hpp"
#include "platform/sitl/world/world_file.hpp"

namespace roborun::sitl {
namespace {

constexpr int kDepth = kOctomapDepth;
constexpr const char* kEmpty = "the OctoMap tree is empty: no leaf is known";
constexpr double kMaxVoxels = 4e9;  // bits of the dense grid: 512 MB

struct Leaf {
  std::uint64_t morton;
  std::int64_t size;
};

struct Header {
  std::size_t data{};
  double resolution_m{};
};

/// Why a file is refused; empty: it is not.
using Refusal = std::string;

void check(const Refusal& refusal, const std::string& name) {
  if (!refusal.empty()) throw InputError(fmt::format("{}: {}", name, refusal));
}

Refusal parse_header(std::span<const unsigned char> bytes, bool full, Header& header) {
  constexpr std::size_t kLongestLine = 512;
  const std::string_view magic = full ? "# Octomap OcTree file" : "# Octomap OcTree binary file";
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  std::size_t at = 0;
  std::string_view line;
  const auto next_line = [&] {
    const std::string_view rest = text.substr(at, kLongestLine + 1);
    const std::size_t end = rest.find('\n');
    line = rest.substr(0, end);
    at += end + 1;
    return end != std::string_view::npos;
  };
  bool id_ok = false;
  for (int i = 0; i < 65; ++i) {
    if (!next_line()) return "truncated OctoMap header: must hold id, size, res and data lines";
    if (i == 0 && !line.starts_with(magic))
      return fmt::format("not an OctoMap file: line 1 must be '{}'", magic);
    if (line == "data") {
      header.data = at;
      if (!id_ok) return "OctoMap header without 'id OcTree'";
      if (!(header.resolution_m >= 0.001 && header.resolution_m <= 100.0))
        return "OctoMap header: res must be 0.001 .. 100 m";
      return {};
    }
    if (line.starts_with("id ")) {
      if (line != "id OcTree")
        return fmt::format("OctoMap tree of type '{}': only OcTree is read", line.substr(3));
      id_ok = true;
    } else if (line.starts_with("res ")) {
      (void)std::from_chars(line.data() + 4, line.data() + line.size(), header.resolution_m);
    }
  }
  return "OctoMap header too long: no 'data' line";
}

/// Walks the tree in file order with an explicit stack and calls on_leaf(leaf, occupied).
template <bool kFull, typename LeafFunction>
Refusal walk_as(std::span<const unsigned char> data, LeafFunction&& on_leaf) {
  constexpr int kChildBits = kFull ? 1 : 2;  // .bt: 1 free, 2 occupied, 3 inner; .ot: whether there is one
  constexpr unsigned kInner = 3;
  constexpr const char* kTooDeep = "OctoMap data deeper than 16 levels";
  struct Node {
    std::uint64_t morton;
    unsigned rest;  // children still to come
    int level;      // of the children: cubes of 2^level cells a side
  };
  std::size_t at = 0;
  float value = 0.0F;
  const auto read_children = [&](unsigned& children) {
    constexpr std::size_t kBytes = kFull ? 5 : 2;
    if (data.size() - at < kBytes) return false;
    const unsigned char* const from = data.data() + at;
    at += kBytes;
    if constexpr (kFull) {
      std::memcpy(&value, from, sizeof value);
      children = from[4];
    } else {
      children = from[0] | static_cast<unsigned>(from[1]) << 8U;
    }
    return true;
  };
  const auto truncated = [&] { return fmt::format("truncated OctoMap data at byte {}", at); };
  if (data.empty()) return {};
  std::array<Node, kDepth> waiting;  // parents with children to come: each is one level above the next
  std::size_t waiting_count = 0;
  Node node{0, 0, kDepth - 1};
  if (!read_children(node.rest)) return truncated();
  if (kFull && node.rest == 0) on_leaf(Leaf{0, std::int64_t{1} << kDepth}, value > 0.0F);
  for (;;) {
    while (node.rest != 0) {
      const int child = std::countr_zero(node.rest) / kChildBits;  // its digit of the Morton index
      const unsigned code = kFull ? kInner : node.rest >> (2 * child) & 3U;
      node.rest &= ~(((1U << kChildBits) - 1U) << (kChildBits * child));
      const std::uint64_t morton = node.morton + (static_cast<std::uint64_t>(child) << (3 * node.level));
      const Leaf leaf{morton, std::int64_t{1} << node.level};
      if (code != kInner) {
        on_leaf(leaf, code == 2U);
        continue;
      }
      unsigned children = 0;
      if (!kFull && node.level == 0) return kTooDeep;
      if (!read_children(children)) return truncated();
      if (kFull && children == 0) {
        on_leaf(leaf, value > 0.0F);
        continue;
      }
      if (node.level == 0) return kTooDeep;
      if (node.rest != 0) waiting[waiting_count++] = node;
      node = {morton, children, node.level - 1};
    }
    if (waiting_count == 0) break;
    node = waiting[--waiting_count];
  }
  if (at == data.size()) return {};
  return fmt::format("{} bytes after the end of the OctoMap tree", data.size() - at);
}

template <typename LeafFunction>
Refusal walk(std::span<const unsigned char> data, bool full, LeafFunction&& on_leaf) {
  return full ? walk_as<true>(data, on_leaf) : walk_as<false>(data, on_leaf);
}

}  // namespace

std::string try_read_octomap(std::span<const unsigned char> bytes, bool full, OctomapLeaves& map) {
  Header header;
  if (Refusal refusal = parse_header(bytes, full, header); !refusal.empty()) return refusal;
  map.resolution_m = header.resolution_m;
  map.leaves.clear();
  map.leaves.reserve(bytes.size() / 8);  // about as many as a sparse tree has
  // File order is Morton order, because children come by number: x, then y, then z.
  const auto add = [&](const Leaf& leaf, bool occupied) {
    map.leaves.push_back({leaf.morton, static_cast<std::int32_t>(leaf.size), occupied});
  };
  Refusal refusal = walk(bytes.subspan(header.data), full, add);
  return refusal.empty() && map.leaves.empty() ? kEmpty : refusal;
}

OctomapLeaves read_octomap(std::span<const unsigned char> bytes, bool full, const std::string& name) {
  OctomapLeaves map;
  check(try_read_octomap(bytes, full, map), name);
  return map;
}

VoxelGrid parse_octomap(std::span<const unsigned char> bytes, bool full, const std::string& name) {
  Header header;
  check(parse_header(bytes, full, header), name);
  const auto data = bytes.subspan(header.data);
  // Two walks: first the extent, then the voxels. Nothing is stored in between.
  constexpr std::int64_t kCentre = std::int64_t{1} << (kDepth - 1);
  std::array<std::int64_t, 3> low{1 << kDepth, 1 << kDepth, 1 << kDepth};
  std::array<std::int64_t, 3> high{0, 0, 0};
  std::size_t leaves = 0;
  const auto extend = [&](const Leaf& leaf, bool) {
    ++leaves;
    const std::array<std::int32_t, 3> first = octomap_cell(leaf.morton);
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min<std::int64_t>(low[i], first[i]);
      high[i] = std::max(high[i], first[i] + leaf.size);
    }
  };
  check(walk(data, full, extend), name);
  if (leaves == 0) check(kEmpty, name);
  std::array<std::int64_t, 3> count{};
  double voxels = 1.0;
  for (std::size_t i = 0; i < 3; ++i) {
    count[i] = high[i] - low[i];
    voxels *= static_cast<double>(count[i]);
  }
  if (voxels > kMaxVoxels)
    check(fmt::format("the box around all leaves has {:.3g} voxels: at most {:.0e}", voxels, kMaxVoxels),
          name);
  const Vector3 min_W = header.resolution_m * Vector3(static_cast<double>(low[0] - kCentre),
                                                      static_cast<double>(low[1] - kCentre),
                                                      static_cast<double>(low[2] - kCentre));
  VoxelGrid grid(min_W, header.resolution_m, count);
  const auto fill = [&](const Leaf& leaf, bool occupied) {
    if (!occupied) return;
    const std::array<std::int32_t, 3> first = octomap_cell(leaf.morton);
    grid.fill({first[0] - low[0], first[1] - low[1], first[2] - low[2]}, leaf.size);
  };
  check(walk(data, full, fill), name);
  return grid;
}

}  // namespace roborun::sitl
