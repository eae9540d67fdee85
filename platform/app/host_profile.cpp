#include "platform/app/host_profile.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <vector>

#include "platform/app/backends.hpp"
#include "platform/report/trace_csv.hpp"
#include "platform/sitl/world/generator.hpp"
#include "platform/sitl/world/toml_reader.hpp"
#include "stages/perception/point_cloud.hpp"
#include "stages/planning/smoother.hpp"

namespace roborun::app {
namespace {

struct Measured {
  std::array<double, core::kStageCount> per_unit_s{};
  std::array<std::array<double, kPrecisionLevels>, 3> per_m3_s{};  ///< Map, export, planner.
};

double timed(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Six images from a hover in environment 14, through every stage at every precision.
Measured measure() {
  const sitl::World world = sitl::generate(sitl::environment("14").knobs, sitl::Mission::kPackageDelivery, 1);
  sitl::DepthCameraConfig camera;
  camera.latency_s = 0.0;
  camera.pixel_dropout_ratio = 0.0;  // one scan must do: holes near the vehicle would end every plan at once
  camera.frame_dropout_ratio = 0.0;
  const Aabb bounds_W{world.bounds_W().min_W - Vector3::Constant(3.0),
                      world.bounds_W().max_W + Vector3::Constant(3.0)};
  std::vector<std::byte> block(backend_bytes(bounds_W, camera) + stages::PointCloud::arena_bytes({}) + 4096);
  core::UnlimitedBudget unlimited;
  stages::Smoother smoother;
  struct Sum {
    double s{}, units{}, m3{};
  };
  std::array<Sum, core::kStageCount> stage{};
  std::array<std::array<Sum, kPrecisionLevels>, 3> level_sum{};
  const auto add = [&](core::StageId id, double s, const core::Work& work, int model) {
    Sum& total = stage[static_cast<std::size_t>(id)];
    total.s += s;
    total.units += static_cast<double>(work.units);
    if (model < 0) return;
    Sum& one = level_sum[static_cast<std::size_t>(model)][static_cast<std::size_t>(work.level)];
    one.s += s;
    one.m3 += work.volume_m3;
  };
  for (int pose = 0; pose < 4; ++pose) {
    const Pose X_WB{Matrix3::Identity(), world.start_W() + Vector3(1.5 * pose, 0.0, 0.0)};
    std::vector<sitl::SimulatedDepthCamera> cameras;
    const auto mounts = sitl::six_camera_mounts();
    cameras.reserve(mounts.size());
    std::vector<stages::PosedDepthFrame> frames;
    for (std::size_t i = 0; i < mounts.size(); ++i) {
      cameras.emplace_back(world, camera, mounts[i], static_cast<std::uint64_t>(pose),
                           static_cast<std::uint32_t>(i));
      for (int n = 0; n < 5; ++n) cameras[i].expose(MonotonicTime{std::chrono::milliseconds(60 * n)}, X_WB);
      stages::PosedDepthFrame posed;
      if (cameras[i].read(posed.frame) != Status::kOk) continue;
      for (int k = 0; k < 9; ++k) posed.X_WC.R_RT(k / 3, k % 3) = mounts[i].R_BC[static_cast<std::size_t>(k)];
      posed.X_WC.p_RT = X_WB.p_RT;
      frames.push_back(posed);
    }
    for (int level = 0; level < kPrecisionLevels; ++level) {
      core::Arena arena(block);
      stages::PointCloud cloud({}, arena);
      const MapAndPlanner backends = make_backends("own", "own", bounds_W, camera, arena);
      core::Work work;
      double s = timed([&] { (void)cloud.step(frames, level, unlimited, work); });
      add(core::StageId::kPointCloud, s, work, -1);
      const std::array<Vector3, 1> here{X_WB.p_RT};
      stages::IntegrationResult integrated;
      s = timed([&] { (void)backends.map->integrate({frames, level, 1e9, here}, unlimited, integrated); });
      add(core::StageId::kMap, s, integrated.work, 0);
      s = timed([&] { (void)backends.map->export_view({level, 1e9, X_WB.p_RT}, unlimited, work); });
      add(core::StageId::kExport, s, work, 1);
      stages::PlanResult planned;
      stages::PlanRequest request;
      request.start_W = X_WB.p_RT;
      request.goal_W = world.goal_W();
      request.bounds_W = world.bounds_W();
      request.radius_m = 0.9;
      request.volume_m3 = 1e9;
      request.horizon_m = 24.0;
      request.seed = static_cast<std::uint64_t>(pose);
      s = timed([&] { (void)backends.planner->plan(request, backends.map->view(), unlimited, planned); });
      planned.work.level = level;
      add(core::StageId::kPlanner, s, planned.work, 2);
      if (planned.path_W.size() < 2) continue;
      stages::SmoothRequest smooth;
      smooth.path_W = {planned.path_W.begin(), planned.path_W.size()};
      smooth.start.p_W = X_WB.p_RT;
      smooth.radius_m = 0.9;
      stages::SmoothResult smoothed;
      s = timed([&] { (void)smoother.smooth(smooth, backends.map->view(), unlimited, smoothed); });
      add(core::StageId::kSmoother, s, smoothed.work, -1);
    }
  }
  Measured m;
  for (std::size_t i = 0; i < core::kStageCount; ++i)
    m.per_unit_s[i] = stage[i].units > 0.0 ? stage[i].s / stage[i].units : 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t level = 0; level < kPrecisionLevels; ++level) {
      const Sum& one = level_sum[i][level];
      m.per_m3_s[i][level] = one.m3 > 0.0 ? one.s / one.m3 : m.per_m3_s[i][level == 0 ? 0 : level - 1];
    }
  }
  return m;
}

constexpr std::array<const char*, 3> kModelKey{"map_s_per_m3", "export_s_per_m3", "planner_s_per_m3"};

std::string to_toml(const Measured& m) {
  std::string text =
      "# What the stages of roborun cost on this machine; delete the file to measure again.\n[host]\n";
  text += fmt::format("per_unit_s = [{:.6e}]\n", fmt::join(m.per_unit_s, ", "));
  for (std::size_t i = 0; i < 3; ++i)
    text += fmt::format("{} = [{:.6e}]\n", kModelKey[i], fmt::join(m.per_m3_s[i], ", "));
  return text;
}

Measured from_toml(const std::string& path, const std::string& text) {
  const toml::table root = sitl::parse_toml(path, text);
  const sitl::TomlReader reader(path);
  reader.allow_keys(root, "the file", {"host"});
  const toml::table* table = reader.need(root, "host", "the file").as_table();
  if (table == nullptr) reader.refuse(root, "host", "must be a table: [host]");
  const auto read = [&](const char* key, auto& values) {
    const toml::node& node = reader.need(*table, key, "[host]");
    const toml::array* array = node.as_array();
    if (array == nullptr || array->size() != values.size())
      reader.refuse(node, key, fmt::format("must be {} numbers", values.size()));
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = reader.number((*array)[i], key);
      if (values[i] < 0.0) reader.refuse(node, key, "must not be negative");
    }
  };
  Measured m;
  read("per_unit_s", m.per_unit_s);
  for (std::size_t i = 0; i < 3; ++i) read(kModelKey[i], m.per_m3_s[i]);
  return m;
}

}  // namespace

Profile paper() {
  Profile profile;
  profile.costs = core::paper_profile();
  profile.model = {governor::from_cost(profile.costs.of(core::StageId::kMap)),
                   governor::from_cost(profile.costs.of(core::StageId::kExport)),
                   governor::from_cost(profile.costs.of(core::StageId::kPlanner))};
  return profile;
}

std::string default_host_path() {
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache != '\0')
    return fmt::format("{}/roborun/host.toml", cache);
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0')
    return fmt::format("{}/.cache/roborun/host.toml", home);
  return "roborun-host.toml";
}

Profile host(const std::string& path, double factor, std::string& note) {
  Measured m;
  std::ifstream file(path, std::ios::binary);
  if (file) {
    m = from_toml(path, std::string(std::istreambuf_iterator<char>(file), {}));
  } else {
    // Read back from its own text, so that the first run uses the same digits as all later ones.
    const std::string text = to_toml(measure());
    m = from_toml(path, text);
    std::error_code ignored;
    std::filesystem::create_directories(std::filesystem::path(path).parent_path(), ignored);
    const std::string error = report::write_file(path, text);
    note = error.empty() ? fmt::format("measured this machine once, kept in {}", path)
                         : fmt::format("measured this machine for this run only: {}", error);
  }
  Profile profile;
  for (std::size_t i = 0; i < core::kStageCount; ++i)
    profile.costs.stage[i].per_unit_s = factor * m.per_unit_s[i];
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t level = 0; level < kPrecisionLevels; ++level)
      profile.model[i].slope_s_per_m3[level] = factor * m.per_m3_s[i][level];
  }
  return profile;
}

}  // namespace roborun::app
