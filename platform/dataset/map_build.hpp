/// A map of a recording: what each frame cost, what the map needs, and how far it agrees with later images.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

#include "platform/dataset/map_judge.hpp"
#include "platform/dataset/recording.hpp"
#include "platform/sitl/world/octomap_file.hpp"

namespace roborun::dataset {

struct MapBuild {
  std::size_t frames{};          ///< In the map.
  std::size_t frames_refused{};  ///< That the map did not believe (FrameGuard), all of their images.
  double ms_median{},
      ms_p99{};         ///< Processor time of this thread for a frame, reading the file not included.
  std::size_t bytes{};  ///< What the known space needs at the end.
  std::uint64_t bricks_given_up{};  ///< Of 16^3 cells, forgotten because the map was full.
  Agreement
      agreement{};  ///< Of `kMostJudges` images at most, evenly spread, each with the map of those before it.
  sitl::OctomapLeaves leaves{};  ///< The map; empty if `want_leaves` is not set.
};
inline constexpr std::size_t kMostJudges = 200;

/// `progress` gets the frames done so far after each; false ends the work (then what was done is returned). Throws InputError with one
/// line: a bad frame, none that the map believed, a recording larger than a map may be.
[[nodiscard]] MapBuild build_map(Recording& recording, double precision_m, bool want_leaves,
                                 const std::function<bool(std::size_t)>& progress);

}  // namespace roborun::dataset
