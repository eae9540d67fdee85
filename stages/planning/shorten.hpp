/// Pulls a path tight.
#pragma once

#include <cstdint>

#include "core/random/counter_rng.hpp"
#include "stages/planning/planner.hpp"

namespace roborun::stages {

[[nodiscard]] double length_m(const Path& path_W) noexcept;

/// Shortens by `tries` straight ways between two random points of the path, each of them no longer than
/// `reach_m` along it, and then by dropping each
/// way-point that is not needed or moving it towards the straight line between its neighbours.
/// Every piece of the result passes is_segment_free() if every piece of the input does. Returns its length.
/// RT-safe: O(tries * reach_m / radius_m) lookups.
double shorten(const MapView& view, double radius_m, double reach_m, int tries, core::CounterRng& rng,
               Path& path_W, std::uint64_t& lookups) noexcept;

}  // namespace roborun::stages
