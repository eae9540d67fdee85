#include "platform/app/flight_system.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "platform/sitl/world/input_error.hpp"
#include "stages/perception/brick_map.hpp"

namespace roborun::app {
namespace {

constexpr double kMapMargin_m = 3.0;
constexpr double kTakeOff_mps = 1.5;

/// Straight up from the ground to the cruise altitude.
Trajectory take_off(const Vector3& ground_W, const Vector3& top_W, MonotonicTime start) {
  Trajectory t;
  t.start_time = start;
  (void)stages::append_rest_to_rest(ground_W, top_W, {kTakeOff_mps, kTakeOff_mps}, t);
  return t;
}

/// Gives no answer while its fault lasts.
class FaultyPlanner final : public stages::Planner {
 public:
  FaultyPlanner(std::unique_ptr<stages::Planner> planner, const sitl::FaultKind& fault)
      : planner_(std::move(planner)), fault_(fault) {}
  [[nodiscard]] Status plan(const stages::PlanRequest& request, const stages::MapView& view,
                            core::StageBudget& budget, stages::PlanResult& result) noexcept override {
    const bool silent = fault_ == sitl::FaultKind::kOff ||
                        (fault_ == sitl::FaultKind::kIntermittent && request.seed % 2 == 0);
    if (!silent) return planner_->plan(request, view, budget, result);
    result = {};
    return Status::kBudgetSpent;
  }

 private:
  std::unique_ptr<stages::Planner> planner_;
  const sitl::FaultKind& fault_;
};

}  // namespace

FlightSystem::FlightSystem(const sitl::World& world, const MissionConfig& config, core::StageMeter& meter,
                           Aircraft& aircraft, const std::array<firmware_if::DepthCamera*, kCameras>& cameras)
    : cameras_(cameras), flight_({}, {.period_s = seconds(config.minor_frame)}) {
  PipelineConfig pipeline;
  pipeline.flight_bounds_W = world.bounds_W();
  pipeline.map_bounds_W = {world.bounds_W().min_W - Vector3::Constant(kMapMargin_m),
                           world.bounds_W().max_W + Vector3::Constant(kMapMargin_m)};
  pipeline.cameras = kCameras;
  pipeline.horizon_m = config.camera.range_m - 1.0;
  pipeline.fence = config.fence;
  pipeline.minor_frame = config.minor_frame;

  for (const auto& [name, p_W] : {std::pair{"start", world.start_W()}, std::pair{"goal", world.goal_W()}}) {
    const double room_m = pipeline.vehicle_radius_m + pipeline.inflation_m;
    if (!config.fence.allows(Aabb::around(p_W, room_m)))
      throw sitl::InputError(
          fmt::format("fence: the {} ({:.2f}, {:.2f}, {:.2f}) must be inside, with {} m to spare", name,
                      p_W.x(), p_W.y(), p_W.z(), room_m));
  }
  const std::size_t cloud_bytes = stages::PointCloud::arena_bytes({});
  block_.resize(cloud_bytes + backend_bytes(pipeline.map_bounds_W, config.camera) + 4096);
  arena_.emplace(block_);
  cloud_.emplace(stages::PointCloud::Config{}, *arena_);
  backends_ = make_backends(config.map_backend, config.planner_backend, pipeline.map_bounds_W, config.camera,
                            *arena_);
  if (!config.faults.empty())
    backends_.planner = std::make_unique<FaultyPlanner>(std::move(backends_.planner), planner_fault_);
  if (arena_->exhausted()) throw sitl::InputError("memory plan: the arena is too small for this world");

  const auto cost_of = [&config](core::StageId id) { return seconds(config.costs.cost(id, {})); };
  governor::GovernorConfig g;
  g.design = config.design;
  g.model = config.model;
  g.point_cloud_s = cost_of(core::StageId::kPointCloud);
  g.governor_s = config.design == governor::Design::kAware ? cost_of(core::StageId::kGovernor) : 0.0;
  g.smoother_s = cost_of(core::StageId::kSmoother);
  g.v_max_mps = config.v_max_mps;
  const double height_m = pipeline.map_bounds_W.size().z();
  g.sensor_volume_max_m3 =
      4.0 * config.camera.range_m * config.camera.range_m * std::min(height_m, 2.0 * config.camera.range_m);
  g.coarsest_level = coarsest_level_within(world.bounds_W().size().z() / 3.0);
  g.minor_frame = config.minor_frame;
  governor_.emplace(g);
  pipeline_.emplace(pipeline, meter, *governor_, *cloud_, *backends_.map, *backends_.planner, smoother_);

  flight_.set_take_off([cruise_m = world.start_W().z()](const Vector3& ground_W, MonotonicTime start) {
    return take_off(ground_W, Vector3(ground_W.x(), ground_W.y(), cruise_m), start);
  });
  flight_program_.emplace(FlightProgram::Config{config.fence, config.answers}, flight_, aircraft, mail_);
  const std::uint64_t* refusals = nullptr;
  if (config.map_backend == "own")  // the stages have no type information to ask
    refusals = &static_cast<const stages::BrickMap&>(*backends_.map).counters().bricks_refused;
  decision_program_.emplace(
      DecisionProgram::Config{world.goal_W(), config.seed, config.fence, config.minor_frame, refusals},
      *pipeline_, cameras_, mail_);
}

void FlightSystem::refuse_bricks(bool refuse) noexcept {
  core::PoolRecord* bricks = arena_->find("map bricks");
  if (bricks == nullptr) return;
  bricks->fault = refuse ? core::PoolRecord::Fault{0, std::numeric_limits<std::uint64_t>::max()}
                         : core::PoolRecord::Fault{};
}

std::vector<report::PoolUse> FlightSystem::pools() const {
  std::vector<report::PoolUse> pools;
  for (const core::PoolRecord& p : arena_->plan())
    pools.push_back({p.name, p.element_bytes, p.count, p.high_water, p.tells_use});
  return pools;
}

}  // namespace roborun::app
