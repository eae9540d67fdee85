/// OctoMap files as a list of leaves: read, written and compared without OctoMap's library.
/// Source: Hornung et al., OctoMap (2013), and the files that octomap 1.9 writes.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/geometry/vector.hpp"

namespace roborun::sitl {

inline constexpr int kOctomapDepth =
    16;  ///< Levels below the root; 2^16 cells of the resolution on each axis.

/// A cube of one state. Positions count cells of the resolution from the lowest corner; the origin of the
/// world is at 2^15.
struct OctomapLeaf {
  std::uint64_t morton{};  ///< Of the first cell, x lowest: the leaf is [morton, morton + size^3).
  std::int32_t size{1};    ///< Cells on an edge, a power of two.
  bool occupied{};

  [[nodiscard]] std::uint64_t end() const noexcept {
    return morton + static_cast<std::uint64_t>(size) * static_cast<std::uint64_t>(size) *
                        static_cast<std::uint64_t>(size);
  }
};

/// The cell with this Morton index, and the other way round.
[[nodiscard]] std::array<std::int32_t, 3> octomap_cell(std::uint64_t morton) noexcept;
[[nodiscard]] std::uint64_t octomap_morton(const std::array<std::int32_t, 3>& cell) noexcept;

/// What is known: leaves in Morton order that do not overlap.
struct OctomapLeaves {
  double resolution_m{};
  std::vector<OctomapLeaf> leaves;

  /// Replaces eight equal siblings by their parent, as often as that is possible. O(leaves).
  void prune();
  /// Box around all leaves, metres; empty (min = max = 0) without leaves.
  [[nodiscard]] Aabb bounds_W() const noexcept;
};

/// Format by extension: true for .ot, false for .bt; InputError for anything else.
[[nodiscard]] bool is_full_octomap(const std::string& path);
/// A file in memory (.ot if `full`, otherwise .bt). Iterative, at most 16 levels deep; memory is bounded by
/// the number of bytes. Throws InputError for what is truncated, too long, too deep, empty or not OctoMap.
[[nodiscard]] OctomapLeaves read_octomap(std::span<const unsigned char> bytes, bool full,
                                         const std::string& name);
/// The same without an exception, which costs more than to read most files: why it is refused; empty: it is
/// not, and `map` holds it.
[[nodiscard]] std::string try_read_octomap(std::span<const unsigned char> bytes, bool full,
                                           OctomapLeaves& map);
/// At most 64 MiB from disk. Throws InputError.
[[nodiscard]] OctomapLeaves load_octomap(const std::string& path);
/// The bytes of a file. .ot holds the log-odds of OctoMap's clamping limits (0.97 and 0.12). Precondition:
/// sorted, not overlapping, not empty, no leaf as large as the root.
[[nodiscard]] std::string write_octomap(const OctomapLeaves& map, bool full);

/// Cells of two maps of one resolution.
struct OctomapDifference {
  std::uint64_t same{}, only_first{}, only_second{}, free_to_occupied{}, occupied_to_free{};
  [[nodiscard]] bool equal() const noexcept {
    return only_first + only_second + free_to_occupied + occupied_to_free == 0;
  }
};
/// O(leaves), whatever their sizes.
[[nodiscard]] OctomapDifference diff(const OctomapLeaves& first, const OctomapLeaves& second) noexcept;

}  // namespace roborun::sitl
