#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "platform/input/input_error.hpp"
#include "platform/sitl/world/octomap_file.hpp"

namespace roborun::sitl {
namespace {

constexpr float kOccupiedLogOdds = 3.5F;
constexpr float kFreeLogOdds = -2.0F;
constexpr std::uint64_t kSpace = std::uint64_t{1} << (3 * kOctomapDepth);

/// A subtree on its way to the file: the leaves [begin, end) of a node.
struct Subtree {
  std::size_t begin, end;
  std::uint64_t morton;
  int depth;
};

std::uint64_t cells_at(int depth) { return kSpace >> (3 * depth); }

/// Sixteen bits to every third place, and back: halves move apart, then quarters, and so on.
std::uint64_t spread(std::uint64_t bits) {
  bits = (bits | bits << 16U) & 0xFF0000FFU;
  bits = (bits | bits << 8U) & 0xF00F00F00FU;
  bits = (bits | bits << 4U) & 0xC30C30C30C3U;
  return (bits | bits << 2U) & 0x249249249249U;
}

std::uint64_t gather(std::uint64_t bits) {
  bits &= 0x249249249249U;
  bits = (bits | bits >> 2U) & 0xC30C30C30C3U;
  bits = (bits | bits >> 4U) & 0xF00F00F00FU;
  bits = (bits | bits >> 8U) & 0xFF0000FFU;
  return (bits | bits >> 16U) & 0xFFFFU;
}

void put_float(std::string& out, float value) {
  std::array<char, sizeof value> bytes{};
  std::memcpy(bytes.data(), &value, sizeof value);
  out.append(bytes.data(), bytes.size());
}

/// Writes all nodes in file order and returns how many there are.
std::size_t put_nodes(const std::vector<OctomapLeaf>& leaves, bool full, std::string& out) {
  // For the value of an inner node: how many occupied leaves come before the i-th.
  std::vector<std::size_t> occupied(leaves.size() + 1, 0);
  for (std::size_t i = 0; i < leaves.size(); ++i)
    occupied[i + 1] = occupied[i] + (leaves[i].occupied ? 1U : 0U);
  std::size_t nodes = 0;
  std::vector<Subtree> stack{{0, leaves.size(), 0, 0}};
  while (!stack.empty()) {
    const Subtree node = stack.back();
    stack.pop_back();
    ++nodes;
    const bool is_leaf = node.end - node.begin == 1 &&
                         leaves[node.begin].end() - leaves[node.begin].morton == cells_at(node.depth);
    unsigned present = 0;  // .ot: a bit a child
    unsigned codes = 0;    // .bt: two bits a child
    std::array<Subtree, 8> inner{};
    std::size_t inner_count = 0;
    std::size_t at = node.begin;
    for (unsigned child = 0; child < 8 && !is_leaf; ++child) {
      const std::uint64_t first = node.morton + child * cells_at(node.depth + 1);
      const std::uint64_t past = first + cells_at(node.depth + 1);
      const std::size_t begin = at;
      while (at < node.end && leaves[at].morton < past) ++at;
      if (at == begin) continue;
      present |= 1U << child;
      const bool whole = at - begin == 1 && leaves[begin].end() - leaves[begin].morton == past - first;
      codes |= (whole ? (leaves[begin].occupied ? 2U : 1U) : 3U) << (2U * child);
      if (whole && !full) {
        ++nodes;
      } else {
        inner[inner_count++] = {begin, at, first, node.depth + 1};
      }
    }
    if (full) {
      put_float(out, occupied[node.end] > occupied[node.begin] ? kOccupiedLogOdds : kFreeLogOdds);
      out.push_back(static_cast<char>(present));
    } else {
      out.push_back(static_cast<char>(codes & 0xFFU));
      out.push_back(static_cast<char>(codes >> 8U));
    }
    while (inner_count > 0) stack.push_back(inner[--inner_count]);
  }
  return nodes;
}

}  // namespace

std::array<std::int32_t, 3> octomap_cell(std::uint64_t morton) noexcept {
  std::array<std::int32_t, 3> cell{};
  for (unsigned axis = 0; axis < 3; ++axis) cell[axis] = static_cast<std::int32_t>(gather(morton >> axis));
  return cell;
}

std::uint64_t octomap_morton(const std::array<std::int32_t, 3>& cell) noexcept {
  std::uint64_t morton = 0;
  for (unsigned axis = 0; axis < 3; ++axis)
    morton |= spread(static_cast<std::uint64_t>(cell[axis]) & 0xFFFFU) << axis;
  return morton;
}

void OctomapLeaves::prune() {
  std::vector<OctomapLeaf> kept;
  for (const OctomapLeaf& leaf : leaves) {
    kept.push_back(leaf);
    // Eight equal siblings in a row, the first of them where a parent begins.
    for (int level = 0; level < kOctomapDepth && kept.size() >= 8; ++level) {
      const OctomapLeaf first = kept[kept.size() - 8];
      const std::uint64_t cells = first.end() - first.morton;
      bool siblings = first.morton % (8 * cells) == 0 && 8 * cells < kSpace;
      for (std::size_t i = 1; i < 8; ++i) {
        const OctomapLeaf& other = kept[kept.size() - 8 + i];
        siblings = siblings && other.size == first.size && other.occupied == first.occupied &&
                   other.morton == first.morton + i * cells;
      }
      if (!siblings) break;
      kept.resize(kept.size() - 7);
      kept.back() = {first.morton, 2 * first.size, first.occupied};
    }
  }
  leaves = std::move(kept);
}

Aabb OctomapLeaves::bounds_W() const noexcept {
  if (leaves.empty()) return {};
  constexpr double kOrigin = 1 << (kOctomapDepth - 1);
  Aabb box{Vector3::Constant(std::numeric_limits<double>::infinity()),
           Vector3::Constant(-std::numeric_limits<double>::infinity())};
  for (const OctomapLeaf& leaf : leaves) {
    const std::array<std::int32_t, 3> cell = octomap_cell(leaf.morton);
    for (int axis = 0; axis < 3; ++axis) {
      const double low_m = resolution_m * (cell[static_cast<std::size_t>(axis)] - kOrigin);
      box.min_W[axis] = std::min(box.min_W[axis], low_m);
      box.max_W[axis] = std::max(box.max_W[axis], low_m + resolution_m * leaf.size);
    }
  }
  return box;
}

bool is_full_octomap(const std::string& path) {
  if (path.ends_with(".ot")) return true;
  if (path.ends_with(".bt")) return false;
  throw InputError(fmt::format("{}: must end in .bt or .ot", path));
}

std::string write_octomap(const OctomapLeaves& map, bool full) {
  std::string data;
  const std::size_t nodes = put_nodes(map.leaves, full, data);
  return fmt::format(
             "# Octomap OcTree {}file\n# (feel free to add / change comments, but leave the first line as it "
             "is!)\n#\n"
             "id OcTree\nsize {}\nres {}\ndata\n",
             full ? "" : "binary ", nodes, map.resolution_m) +
         data;
}

OctomapDifference diff(const OctomapLeaves& first, const OctomapLeaves& second) noexcept {
  // Both are sorted intervals of one line: one sweep.
  OctomapDifference result;
  std::size_t i = 0;
  std::size_t k = 0;
  std::uint64_t at = 0;
  while (i < first.leaves.size() || k < second.leaves.size()) {
    const OctomapLeaf* a = i < first.leaves.size() ? &first.leaves[i] : nullptr;
    const OctomapLeaf* b = k < second.leaves.size() ? &second.leaves[k] : nullptr;
    const bool in_a = a != nullptr && a->morton <= at;
    const bool in_b = b != nullptr && b->morton <= at;
    std::uint64_t next = kSpace;
    if (a != nullptr) next = std::min(next, in_a ? a->end() : a->morton);
    if (b != nullptr) next = std::min(next, in_b ? b->end() : b->morton);
    const std::uint64_t cells = next - at;
    if (in_a && in_b) {
      (a->occupied == b->occupied ? result.same
                                  : (b->occupied ? result.free_to_occupied : result.occupied_to_free)) +=
          cells;
    } else if (in_a) {
      result.only_first += cells;
    } else if (in_b) {
      result.only_second += cells;
    }
    at = next;
    if (a != nullptr && a->end() <= at) ++i;
    if (b != nullptr && b->end() <= at) ++k;
  }
  return result;
}

}  // namespace roborun::sitl
