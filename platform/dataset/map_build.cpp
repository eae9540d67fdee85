#include "platform/dataset/map_build.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/memory/arena.hpp"
#include "platform/board/thread_time.hpp"
#include "platform/dataset/map_leaves.hpp"
#include "platform/input/input_error.hpp"
#include "stages/perception/brick_map.hpp"

namespace roborun::dataset {
namespace {

constexpr std::size_t kMostBricks = 200'000;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

stages::BrickMap::Config config_for(Recording& recording, double precision_m) {
  const auto first = recording.load(0);  // now the size of the images is known
  stages::BrickMap::Config config;
  config.bounds_W = recording.reach_W();
  config.lattice.finest_m = precision_m;
  const Vector3 size = config.bounds_W.size();
  const double brick_m = precision_m * stages::kBlockCells;
  const Vector3 bricks = (size / brick_m).array() + 4.0;
  config.max_bricks =
      static_cast<std::size_t>(std::clamp(bricks.prod(), 64.0, static_cast<double>(kMostBricks)));
  config.max_frames = first.size();
  config.all_around_frames = 0;
  config.max_image_width = recording.has_clouds() ? 512 : first.front().frame.width;
  config.max_image_height = recording.has_clouds() ? 512 : first.front().frame.height;
  config.vehicle_radius_m = 0.0;
  if (config.validate() != Status::kOk)
    throw InputError(fmt::format(
        "the recording reaches over {:.0f} x {:.0f} x {:.0f} m: must be less (4 million bricks of {:.1f} m) "
        "for cells of {} m",
        size.x(), size.y(), size.z(), brick_m, precision_m));
  return config;
}

/// The smallest that at least this share is not above.
double quantile(std::vector<double>& values, double share) {
  const auto rank = static_cast<std::ptrdiff_t>(std::ceil(share * static_cast<double>(values.size()))) - 1;
  const auto at = values.begin() + std::max<std::ptrdiff_t>(rank, 0);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

MapBuild build_map(Recording& recording, double precision_m, bool want_leaves,
                   const std::function<bool(std::size_t)>& progress) {
  const stages::BrickMap::Config config = config_for(recording, precision_m);
  std::vector<std::byte> block(stages::BrickMap::arena_bytes(config));
  core::Arena arena(block);
  stages::BrickMap map(config, arena);
  MapBuild build;
  std::vector<double> ms;
  const std::size_t judge_every =
      std::max<std::size_t>((recording.size() + kMostJudges - 1) / kMostJudges, 1);
  for (std::size_t i = 0; i < recording.size(); ++i) {
    const auto frames = recording.load(i);
    const std::array<Vector3, 1> here_W{frames.front().X_WC.p_RT};
    core::UnlimitedBudget unlimited;
    if (i % judge_every == 0 && build.frames > 0) {
      core::Work work;
      (void)map.export_view({0, kInfinity, here_W[0]}, unlimited, work);
      judge(map.view(), frames, build.agreement);
    }
    stages::IntegrationResult result;
    const double begin_s = board::thread_time_s();
    const Status status = map.integrate({frames, 0, kInfinity, here_W}, unlimited, result);
    const double took_ms = 1e3 * (board::thread_time_s() - begin_s);
    if (status == Status::kOk) {
      ++build.frames;
      ms.push_back(took_ms);
    } else {
      ++build.frames_refused;
    }
    if (!progress(i + 1)) break;
  }
  if (ms.empty())
    throw InputError(fmt::format(
        "none of {} frames was believed: must have depths in a quarter of the pixels that look down, and "
        "not repeat each other bit by bit",
        recording.size()));
  build.ms_median = quantile(ms, 0.5);
  build.ms_p99 = quantile(ms, 0.99);
  build.bytes = map.used_bytes();
  build.bricks_given_up = map.counters().bricks_given_up + map.counters().bricks_refused;
  if (want_leaves) build.leaves = leaves_of(map.view(), config.bounds_W);
  return build;
}

}  // namespace roborun::dataset
