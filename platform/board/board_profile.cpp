#include "platform/board/board_profile.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "core/geometry/camera_pose.hpp"
#include "platform/board/plugin_loader.hpp"
#include "platform/board/shipped_boards.hpp"
#include "platform/board/thread_time.hpp"
#include "platform/input/cache_folder.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/text_file.hpp"
#include "platform/input/toml_reader.hpp"
#include "platform/rt/host_identity.hpp"
#include "platform/sitl/sensors/depth_camera.hpp"
#include "platform/sitl/world/generator.hpp"
#include "stages/perception/point_cloud.hpp"
#include "stages/perception/space_profiler.hpp"
#include "stages/planning/smoother.hpp"

namespace roborun::board {
namespace {

constexpr int kScenes =
    2;  // among obstacles at the start, and in the open half-way: coarse cells plan nothing at the start
constexpr int kPosesAScene = 2;
constexpr int kPoses = kScenes * kPosesAScene;
constexpr int kVolumes = 8;
constexpr double kPoseStep_m = 1.5;
constexpr double kMapReach_m = 40.0;
constexpr double kPlannerShare = 0.4;
constexpr ImageLimits kImages{sitl::DepthCameraConfig{}.pixels, sitl::DepthCameraConfig{}.pixels,
                              sitl::DepthCameraConfig{}.range_m};
constexpr std::array<const char*, 3> kStageName{"map", "export", "planner"};

/// Seconds of this thread's own processor time.
template <typename Work>
double timed(Work&& work) {
  const double begin_s = thread_time_s();
  work();
  return thread_time_s() - begin_s;
}

/// Six images from a hover; the memory behind them lives as long as this does.
class Scan {
 public:
  Scan(const sitl::World& world, const Pose& X_WB, std::uint64_t seed) {
    sitl::DepthCameraConfig config;
    config.latency_s = 0.0;
    config.pixel_dropout_ratio =
        0.0;  // one scan must do: holes near the vehicle would end every plan at once
    config.frame_dropout_ratio = 0.0;
    const auto mounts = sitl::six_camera_mounts();
    cameras_.reserve(mounts.size());
    for (std::size_t i = 0; i < mounts.size(); ++i) {
      cameras_.emplace_back(world, config, mounts[i], seed, static_cast<std::uint32_t>(i));
      cameras_[i].expose(MonotonicTime{}, X_WB);
      stages::PosedDepthFrame posed;
      if (cameras_[i].read(posed.frame) != Status::kOk) continue;
      posed.X_WC = core::camera_pose(X_WB, mounts[i]);
      frames_.push_back(posed);
    }
  }
  [[nodiscard]] std::span<const stages::PosedDepthFrame> frames() const { return frames_; }

 private:
  std::vector<sitl::SimulatedDepthCamera> cameras_;
  std::vector<stages::PosedDepthFrame> frames_;
};

struct Samples {
  std::vector<double> time_s;
  double volume_m3{};
};

class Sweeper {
 public:
  explicit Sweeper(const BackendNames& backends)
      : backends_(backends),
        world_(sitl::generate(sitl::environment("14").knobs, sitl::Mission::kPackageDelivery, 1)) {
    const Vector3 way = world_.goal_W() - world_.start_W();
    for (int scene = 0; scene < kScenes; ++scene) {
      const Vector3 center_W = world_.start_W() + 0.5 * scene * way;
      const Vector3 reach(kMapReach_m, kMapReach_m, 0.0);
      Aabb bounds_W{center_W - reach, center_W + reach};
      bounds_W.min_W.z() = world_.bounds_W().min_W.z() - 3.0;
      bounds_W.max_W.z() = world_.bounds_W().max_W.z() + 3.0;
      bounds_W_.push_back(bounds_W);
      for (int pose = 0; pose <= kPosesAScene; ++pose) {
        const Pose X_WB{Matrix3::Identity(), center_W + Vector3(kPoseStep_m * pose, 0.0, 0.0)};
        poses_W_.push_back(X_WB.p_RT);
        scans_.emplace_back(world_, X_WB, static_cast<std::uint64_t>(pose));
      }
    }
    block_.resize(backend_bytes(bounds_W_[0], kImages) + stages::PointCloud::arena_bytes({}) + 4096);
  }

  /// One decision's stages at a level and a share of the volume in view, on a map that knows the pose before.
  void run(int pose, int level, int eighth, std::uint64_t seed) {
    const auto scene = static_cast<std::size_t>(pose / kPosesAScene);
    const auto at = static_cast<std::size_t>(pose) + scene;  // a scene has a pose more than it has steps
    core::Arena arena(block_);
    stages::PointCloud cloud({}, arena);
    const Backends backends = make_backends(backends_, {bounds_W_[scene], kImages}, arena);
    core::UnlimitedBudget unlimited;
    core::Work work;
    const std::array<Vector3, 1> before{poses_W_[at]};
    const std::array<Vector3, 1> here{poses_W_[at + 1]};
    stages::IntegrationResult integrated;
    (void)backends.map->integrate({scans_[at].frames(), level, 1e9, before}, unlimited, integrated);
    const auto frames = scans_[at + 1].frames();
    const stages::CloudNeed need = stages::needed_points({}, here[0], world_.bounds_W());
    add_units(core::StageId::kPointCloud,
              timed([&] { (void)cloud.step(frames, level, need, unlimited, work); }), work);

    const double share = static_cast<double>(eighth) / kVolumes;
    const double seen_m3 = cloud.seen_volume_m3();
    double s = timed([&] {
      (void)backends.map->integrate({frames, level, share * seen_m3, here}, unlimited, integrated);
    });
    add(0, level, eighth, s, integrated.work);
    s = timed([&] { (void)backends.map->export_view({level, share * seen_m3, here[0]}, unlimited, work); });
    add(1, level, eighth, s, work);

    stages::PlanRequest request;
    request.start_W = here[0];
    request.goal_W = world_.goal_W();
    request.bounds_W = world_.bounds_W();
    request.radius_m = planned_radius_m(VehicleModel{});
    request.volume_m3 = share * kPlannerShare * seen_m3;
    request.horizon_m = 24.0;
    request.seed = seed;
    stages::PlanResult planned;
    s = timed([&] { (void)backends.planner->plan(request, backends.map->view(), unlimited, planned); });
    planned.work.level = level;
    // Blocked at its start: nothing was planned, nothing measured.
    if (planned.work.volume_m3 > 0.0) add(2, level, eighth, s, planned.work);
    if (planned.path_W.size() < 2) return;
    stages::SmoothRequest smooth;
    smooth.path_W = {planned.path_W.begin(), planned.path_W.size()};
    smooth.start.p_W = here[0];
    smooth.radius_m = planned_radius_m(VehicleModel{});
    stages::SmoothResult smoothed;
    s = timed([&] { (void)smoother_.smooth(smooth, backends.map->view(), unlimited, smoothed); });
    add_units(core::StageId::kSmoother, s, smoothed.work);
  }

  BoardProfile result(BoardSweep& sweep) {
    BoardProfile board;
    for (std::size_t i = 0; i < core::kStageCount; ++i)
      board.per_unit_s[i] = units_[i] > 0.0 ? time_s_[i] / units_[i] : 0.0;
    for (std::size_t m = 0; m < 3; ++m) {
      BoardSweep::Stage& points = sweep.stage[m];
      for (int level = 0; level < kPrecisionLevels; ++level) {
        for (int eighth = 1; eighth <= kVolumes; ++eighth) {
          Samples& samples = at(m, level, eighth);
          if (samples.time_s.empty()) continue;
          std::sort(samples.time_s.begin(), samples.time_s.end());
          const auto count = static_cast<double>(samples.time_s.size());
          double sum_s = 0.0;
          for (const double t : samples.time_s) sum_s += t;
          const auto last = static_cast<std::size_t>(std::ceil(0.99 * count)) - 1;
          const bool hold_out = eighth % 3 == 0;
          const double volume_m3 = samples.volume_m3 / count;
          (hold_out ? points.mean_hold_out : points.mean).push_back({level, volume_m3, sum_s / count});
          (hold_out ? points.p99_hold_out : points.p99).push_back({level, volume_m3, samples.time_s[last]});
        }
      }
      StageModel& stage = board.stage[m];
      stage.mean = governor::fit_latency(points.mean);
      stage.p99 = governor::fit_latency(points.p99);
      stage.mean_error = governor::error_of(stage.mean, points.mean_hold_out);
      stage.p99_error = governor::error_of(stage.p99, points.p99_hold_out);
    }
    return board;
  }

 private:
  Samples& at(std::size_t model, int level, int eighth) {
    return samples_[model][static_cast<std::size_t>(level)][static_cast<std::size_t>(eighth - 1)];
  }
  void add_units(core::StageId id, double s, const core::Work& work) {
    time_s_[static_cast<std::size_t>(id)] += s;
    units_[static_cast<std::size_t>(id)] += static_cast<double>(work.units);
  }
  void add(std::size_t model, int level, int eighth, double s, const core::Work& work) {
    Samples& samples = at(model, level, eighth);
    samples.time_s.push_back(s);
    samples.volume_m3 += work.volume_m3;
    constexpr std::array<core::StageId, 3> kId{core::StageId::kMap, core::StageId::kExport,
                                               core::StageId::kPlanner};
    add_units(kId[model], s, work);
  }

  BackendNames backends_;
  sitl::World world_;
  std::vector<Aabb> bounds_W_;  ///< Of the map, a scene.
  std::vector<std::byte> block_;
  std::vector<Vector3> poses_W_;
  std::vector<Scan> scans_;
  stages::Smoother smoother_;
  std::array<std::array<std::array<Samples, kVolumes>, kPrecisionLevels>, 3> samples_;
  std::array<double, core::kStageCount> time_s_{};
  std::array<double, core::kStageCount> units_{};
};

}  // namespace

BoardProfile measure_board(const BackendNames& backends, int repeats,
                           const std::function<void(double)>& progress, BoardSweep& sweep) {
  Sweeper sweeper(backends);
  for (int repeat = 0; repeat < repeats; ++repeat) {
    for (int pose = 0; pose < kPoses; ++pose) {
      for (int level = 0; level < kPrecisionLevels; ++level) {
        for (int eighth = 1; eighth <= kVolumes; ++eighth)
          sweeper.run(pose, level, eighth,
                      static_cast<std::uint64_t>(repeat) * kPoses + static_cast<std::uint64_t>(pose));
      }
      if (progress) progress(static_cast<double>(repeat * kPoses + pose + 1) / (repeats * kPoses));
    }
  }
  sweep = {};
  BoardProfile board = sweeper.result(sweep);
  board.machine = rt::identify_host().cpu;
  board.backends = backends;
  return board;
}

std::string to_toml(const BoardProfile& board) {
  std::string machine = board.machine;
  std::erase_if(machine,
                [](char c) { return c == '"' || c == '\\' || static_cast<unsigned char>(c) < 0x20; });
  std::string text = fmt::format(
      "# What the stages of roborun cost on a machine; written by roborun calibrate.\n"
      "# latency = fixed_s + s_per_m3 volume, a pair for each precision from 0.3 to 9.6 m: mean and 99th "
      "percentile.\n"
      "[board]\nmachine = \"{}\"\nmap = \"{}\"\nplanner = \"{}\"\nper_unit_s = [{:.6e}]\n",
      machine, board.backends.map, board.backends.planner, fmt::join(board.per_unit_s, ", "));
  if (board.factor < 1.0 || board.factor > 1.0) text += fmt::format("factor = {}\n", board.factor);
  for (std::size_t i = 0; i < 3; ++i) {
    const StageModel& s = board.stage[i];
    text += fmt::format("\n[{}]\n", kStageName[i]);
    for (const auto& [name, model] : {std::pair("mean", s.mean), std::pair("p99", s.p99)}) {
      text += fmt::format("{0}_fixed_s = [{1:.6e}]\n{0}_s_per_m3 = [{2:.6e}]\n", name,
                          fmt::join(model.fixed_s, ", "), fmt::join(model.slope_s_per_m3, ", "));
    }
    text += fmt::format(
        "# on points not fitted: mean {:.1f} % (at most {:.1f} %), p99 {:.1f} % (at most {:.1f} %)\n",
        100.0 * s.mean_error.mean_relative, 100.0 * s.mean_error.max_relative,
        100.0 * s.p99_error.mean_relative, 100.0 * s.p99_error.max_relative);
  }
  return text;
}

BoardProfile board_from_toml(const std::string& path, const std::string& text) {
  const toml::table root = input::parse_toml(path, text);
  const input::TomlReader reader(path);
  reader.allow_keys(root, "a board file", {"board", "map", "export", "planner"});
  const auto table = [&](const char* name) -> const toml::table& {
    const toml::node& node = reader.need(root, name, "a board file");
    if (node.as_table() == nullptr) reader.refuse(node, name, fmt::format("must be a table: [{}]", name));
    return *node.as_table();
  };
  const auto read = [&](const toml::table& from, const char* key, const char* where, auto& values) {
    const toml::node& node = reader.need(from, key, where);
    const toml::array* array = node.as_array();
    if (array == nullptr || array->size() != values.size())
      reader.refuse(node, key, fmt::format("must be {} numbers", values.size()));
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = reader.number((*array)[i], key);
      if (values[i] < 0.0) reader.refuse(node, key, "must not be negative");
    }
  };
  BoardProfile board;
  const toml::table& head = table("board");
  reader.allow_keys(head, "[board]", {"machine", "map", "planner", "factor", "per_unit_s"});
  board.machine = head["machine"].value_or(std::string("unknown"));
  board.backends.map = head["map"].value_or(board.backends.map);
  board.backends.planner = head["planner"].value_or(board.backends.planner);
  board.factor = reader.number_or(head, "factor", 1.0);
  if (!(board.factor > 0.0 && board.factor <= 1000.0))
    reader.refuse(*head.get("factor"), "factor", "must be above 0, at most 1000");
  read(head, "per_unit_s", "[board]", board.per_unit_s);
  for (std::size_t i = 0; i < 3; ++i) {
    const std::string where = fmt::format("[{}]", kStageName[i]);
    const toml::table& stage = table(kStageName[i]);
    reader.allow_keys(stage, where, {"mean_fixed_s", "mean_s_per_m3", "p99_fixed_s", "p99_s_per_m3"});
    StageModel& model = board.stage[i];
    read(stage, "mean_fixed_s", where.c_str(), model.mean.fixed_s);
    read(stage, "mean_s_per_m3", where.c_str(), model.mean.slope_s_per_m3);
    read(stage, "p99_fixed_s", where.c_str(), model.p99.fixed_s);
    read(stage, "p99_s_per_m3", where.c_str(), model.p99.slope_s_per_m3);
  }
  return board;
}

Profile slower(const Profile& profile, double factor) {
  Profile result{core::slower(profile.costs, factor), profile.model};
  for (governor::LatencyModel& model : result.model) model = governor::slower(model, factor);
  return result;
}

Profile to_profile(const BoardProfile& board, double factor) {
  constexpr std::array<core::StageId, 3> kId{core::StageId::kMap, core::StageId::kExport,
                                             core::StageId::kPlanner};
  Profile profile;
  for (std::size_t i = 0; i < core::kStageCount; ++i) profile.costs.stage[i].per_unit_s = board.per_unit_s[i];
  for (std::size_t i = 0; i < 3; ++i) {
    profile.model[i] = board.stage[i].p99;
    if ((kId[i] == core::StageId::kPlanner ? board.backends.planner : board.backends.map) == "own") continue;
    const governor::LatencyModel& mean = board.stage[i].mean;
    profile.costs.stage[static_cast<std::size_t>(kId[i])] = {mean.fixed_s, 0.0, mean.slope_s_per_m3};
  }
  return slower(profile, factor * board.factor);
}

namespace {

Profile profile_for(const std::string& path, const std::string& text, const BackendNames& backends,
                    double factor) {
  const BoardProfile board = board_from_toml(path, text);
  if (!(board.backends == backends)) {
    throw InputError(
        fmt::format("{}: has the costs of map {}, planner {}: must have those of map {}, planner {}: roborun "
                    "calibrate --map {} --planner {} --out FILE",
                    path, board.backends.map, board.backends.planner, backends.map, backends.planner,
                    backends.map, backends.planner));
  }
  return to_profile(board, factor);
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

std::string default_host_path(const BackendNames& backends) {
  if (uses_plugin(backends))
    throw InputError(
        "--profile host: what a plugin costs is not kept, it may be built anew: must go with --host-file "
        "FILE, or "
        "be the file of roborun calibrate");
  std::string name = "host";
  if (!(backends == BackendNames{})) name = fmt::format("host-{}-{}", backends.map, backends.planner);
  std::replace(name.begin(), name.end(), ':', '_');
  const std::string folder = input::cache_folder();
  return folder.empty() ? fmt::format("roborun-{}.toml", name) : fmt::format("{}/{}.toml", folder, name);
}

Profile host(const std::string& path, const BackendNames& backends, double factor, std::string& note) {
  if (std::filesystem::exists(path))
    return profile_for(path, input::read_text(path, "a readable file"), backends, factor);
  // Read back from its own text, so that the first run uses the same digits as all later ones.
  BoardSweep sweep;
  const std::string text = to_toml(measure_board(backends, 2, {}, sweep));
  std::error_code ignored;
  std::filesystem::create_directories(std::filesystem::path(path).parent_path(), ignored);
  try {
    input::write_file(path, text);
    note = fmt::format("measured this machine quickly, kept in {} (better: roborun calibrate)", path);
  } catch (const InputError& error) {
    note = fmt::format("measured this machine for this run only: {}", error.what());
  }
  return profile_for(path, text, backends, factor);
}

std::optional<core::CostProfile> known_host_costs(BackendNames backends) {
  if (is_plugin(backends.map)) backends.map = "own";
  if (is_plugin(backends.planner)) backends.planner = "own";
  const std::string path = default_host_path(backends);
  if (!std::filesystem::exists(path)) return std::nullopt;
  try {
    return profile_for(path, input::read_text(path, "a readable file"), backends, 1.0).costs;
  } catch (const InputError&) {
    return std::nullopt;  // --profile host says what is wrong with it
  }
}

Profile load_profile(const std::string& name, const BackendNames& backends) {
  if (name == "paper") return paper();
  std::string note;
  if (name == "host") return host(default_host_path(backends), backends, 1.0, note);
  if (name == "cortex-a72") {
    const bool own = backends == BackendNames{};
    return profile_for(name, own ? kCortexA72 : kCortexA72Stock, backends, 1.0);
  }
  const std::string text =
      input::read_text(name, "paper, host, cortex-a72, or a file that roborun calibrate wrote");
  return profile_for(name, text, backends, 1.0);
}

}  // namespace roborun::board
