#include <gtest/gtest.h>

#include <vector>

#include "stages/perception/brick_map.hpp"
#include "stages/perception/cloud_images.hpp"
#include "stages/perception/octomap_backend/octomap_backend.hpp"
#include "stages/perception/point_cloud.hpp"
#include "stages/perception/space_profiler.hpp"
#include "tests/support/box_view.hpp"
#include "tests/support/config_death.hpp"
#include "tests/support/limits.hpp"

namespace roborun::stages {
namespace {

using test::kNan;

/// Makes a stage in an arena that is large enough for a valid one.
template <typename Stage>
void make_in(std::size_t bytes, const typename Stage::Config& config) {
  std::vector<std::byte> block(bytes);
  core::Arena arena(block);
  const auto sut = std::make_unique<Stage>(config, arena);
}

TEST(PointCloudConfigDeathTest, OnlyValidOnesAreMade) {
  using Config = PointCloud::Config;
  test::expect_only_valid_configs<Config>(
      {}, [](const Config& config) { make_in<PointCloud>(PointCloud::arena_bytes({}), config); },
      {{"no power of two", [](Config& c) { c.max_points = 65535; }},
       {"too few", [](Config& c) { c.max_points = 128; }}});
}

TEST(CloudImagesConfigDeathTest, OnlyValidOnesAreMade) {
  using Config = CloudImages::Config;
  test::expect_only_valid_configs<Config>(
      {}, [](const Config& config) { make_in<CloudImages>(CloudImages::arena_bytes({}), config); },
      {{"too few pixels", [](Config& c) { c.pixels = 7; }}, {"too many", [](Config& c) { c.pixels = 513; }}});
}

TEST(BrickMapConfigDeathTest, OnlyValidOnesAreMade) {
  using Config = BrickMap::Config;
  Config small;
  small.bounds_W = {Vector3(-10, -10, 0), Vector3(10, 10, 10)};
  small.max_bricks = 64;
  small.max_image_width = small.max_image_height = 64;
  const std::size_t bytes = BrickMap::arena_bytes(small);
  test::expect_only_valid_configs<Config>(
      small, [bytes](const Config& config) { make_in<BrickMap>(bytes, config); },
      {{"no volume", [](Config& c) { c.bounds_W.max_W.z() = 0.0; }},
       {"no number", [](Config& c) { c.bounds_W.min_W.x() = kNan; }},
       {"bricks", [](Config& c) { c.max_bricks = 63; }},
       {"no camera", [](Config& c) { c.max_frames = 0; }},
       {"cameras", [](Config& c) { c.max_frames = kMaxCameras + 1; }},
       {"columns", [](Config& c) { c.max_image_width = 1281; }},
       {"rows", [](Config& c) { c.max_image_height = 7; }},
       {"more all around than there are", [](Config& c) { c.all_around_frames = c.max_frames + 1; }},
       {"radius", [](Config& c) { c.vehicle_radius_m = -0.1; }},
       {"thinnest", [](Config& c) { c.thinnest_m = kNan; }}});
}

TEST(SpaceProfilerConfigDeathTest, OnlyValidOnesAreUsed) {
  using Config = SpaceProfilerConfig;
  test::expect_only_valid_configs<Config>(
      {},
      [](const Config& config) {
        const test::BoxView view;
        core::UnlimitedBudget budget;
        core::Work work;
        SpaceProfile profile;
        (void)profile_space(config, {}, view, Trajectory::hold(Vector3::Zero(), {}), {}, Vector3::Zero(),
                            Vector3::Zero(), Vector3(10, 0, 0), Aabb{}, 0.6, profile, budget, work);
      },
      {{"width", [](Config& c) { c.vehicle_width_m = 0.0; }},
       {"gap", [](Config& c) { c.widest_gap_m = c.vehicle_width_m; }},
       {"reach", [](Config& c) { c.gap_reach_m = kNan; }},
       {"band", [](Config& c) { c.height_band_m = 0.0; }},
       {"step", [](Config& c) { c.outlook_step_s = 0.0; }},
       {"range", [](Config& c) { c.max_visible_m = -1.0; }}});
}

TEST(OctomapConfigDeathTest, OnlyValidOnesAreMade) {
  test::expect_only_valid_configs<OctomapConfig>(
      {.bounds_W = {Vector3(-10, -10, 0), Vector3(10, 10, 10)}},
      [](const OctomapConfig& config) { (void)make_octomap_backend(config); },
      {{"no volume", [](OctomapConfig& c) { c.bounds_W = {}; }},
       {"no window", [](OctomapConfig& c) { c.view_reach_m = 0.0; }}});
}

}  // namespace
}  // namespace roborun::stages
