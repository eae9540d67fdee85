/// Worlds from files: TOML written by a person, or any OctoMap file.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "platform/sitl/world/world.hpp"
#include "platform/sitl/world/world_key.hpp"

namespace roborun::sitl {

/// Where the mission goes, if the file does not say so or somebody wants it otherwise.
struct Endpoints {
  std::optional<Vector3> start_W;
  std::optional<Vector3> goal_W;
};

/// By extension: .toml, .bt or .ot. Throws InputError (file, line, key, what would be right) for anything
/// that is not a valid world: unreadable, too large (64 MiB), unknown keys, wrong types, numbers not finite,
/// start or goal occupied or out of bounds.
///
/// TOML: the keys of world_keys(), metres, at most 100,000 pillars, 100,000 boxes and 1,000 bodies.
/// OctoMap: every leaf that its log-odds call occupied becomes solid; the bounds are the box around all
/// leaves, from
///   0.5 m above its floor; start and goal default to the free-most points near the two ends of the longer
///   side, at the middle height.
[[nodiscard]] World load_world(const std::string& path, const Endpoints& endpoints);

/// Every key of a TOML world: the only ones that load_world() takes.
[[nodiscard]] std::vector<WorldKey> world_keys();

/// The occupied space of an OctoMap file in memory (.ot if `full`, otherwise .bt). Iterative, at most 16
/// levels deep, and never allocates more than the bytes justify; refuses what is truncated, too long or not
/// OctoMap.
[[nodiscard]] VoxelGrid parse_octomap(std::span<const unsigned char> bytes, bool full,
                                      const std::string& name);

}  // namespace roborun::sitl
