/// Every stage at its worst knobs (finest cells, all volume, no budget), four scans on the way into
/// environment 27. Deterministic: counted by callgrind, the same program gives the same number of
/// instructions.
#include <cstdio>
#include <limits>
#include <vector>

#include "core/geometry/camera_pose.hpp"
#include "platform/sitl/sensors/depth_camera.hpp"
#include "platform/sitl/sensors/navigation_sensors.hpp"
#include "platform/sitl/world/generator.hpp"
#include "stages/control/estimator.hpp"
#include "stages/control/tracker.hpp"
#include "stages/perception/brick_map.hpp"
#include "stages/perception/point_cloud.hpp"
#include "stages/planning/rrt_star.hpp"
#include "stages/planning/smoother.hpp"

int main() {
  using namespace roborun;
  const sitl::World world = sitl::generate(sitl::environment("27").knobs, sitl::Mission::kPackageDelivery, 1);
  sitl::DepthCameraConfig camera;
  camera.latency_s = camera.pixel_dropout_ratio = camera.frame_dropout_ratio = 0.0;
  stages::BrickMap::Config map_config;
  map_config.bounds_W = {world.bounds_W().min_W - Vector3::Constant(3.0),
                         world.bounds_W().max_W + Vector3::Constant(3.0)};
  map_config.max_image_width = map_config.max_image_height = camera.pixels;
  std::vector<std::byte> block(stages::BrickMap::arena_bytes(map_config) + stages::RrtStar::arena_bytes({}) +
                               stages::PointCloud::arena_bytes({}) + 4096);
  core::Arena arena(block);
  stages::PointCloud cloud({}, arena);
  stages::BrickMap map(map_config, arena);
  stages::RrtStar planner({}, arena);
  stages::Smoother smoother;
  core::UnlimitedBudget unlimited;
  core::Work work;
  std::uint64_t units = 0;
  constexpr double kAll = std::numeric_limits<double>::infinity();

  const auto mounts = sitl::six_camera_mounts();
  std::vector<sitl::SimulatedDepthCamera> cameras;
  for (std::size_t i = 0; i < mounts.size(); ++i)
    cameras.emplace_back(world, camera, mounts[i], 1, static_cast<std::uint32_t>(i));
  for (int pose = 0; pose < 4; ++pose) {
    const Pose X_WB{Matrix3::Identity(), world.start_W() + Vector3(1.5 * pose, 0.0, 0.0)};
    std::vector<stages::PosedDepthFrame> frames;
    for (std::size_t i = 0; i < mounts.size(); ++i) {
      cameras[i].expose(MonotonicTime{Nanos{1'000'000'000LL * (pose + 1)}}, X_WB);
      stages::PosedDepthFrame posed;
      if (cameras[i].read(posed.frame) != Status::kOk) return 1;
      posed.X_WC = core::camera_pose(X_WB, mounts[i]);
      frames.push_back(posed);
    }
    (void)cloud.step(frames, 0, unlimited, work);
    units += work.units;
    const std::array<Vector3, 1> here{X_WB.p_RT};
    stages::IntegrationResult integrated;
    (void)map.integrate({frames, 0, kAll, here}, unlimited, integrated);
    (void)map.export_view({0, kAll, X_WB.p_RT}, unlimited, work);
    units += integrated.work.units + work.units;
    stages::PlanRequest request;
    request.start_W = X_WB.p_RT;
    request.goal_W = world.goal_W();
    request.bounds_W = world.bounds_W();
    request.radius_m = 0.9;
    request.volume_m3 = 1e9;
    request.horizon_m = 24.0;
    request.seed = static_cast<std::uint64_t>(pose);
    stages::PlanResult planned;
    (void)planner.plan(request, map.view(), unlimited, planned);
    units += planned.work.units;
    if (planned.path_W.size() < 2) continue;
    stages::SmoothRequest smooth;
    smooth.path_W = {planned.path_W.begin(), planned.path_W.size()};
    smooth.start.p_W = X_WB.p_RT;
    smooth.radius_m = 0.9;
    stages::SmoothResult smoothed;
    (void)smoother.smooth(smooth, map.view(), unlimited, smoothed);
    units += smoothed.work.units;
  }

  // One second of the flight lane at rest, all sensors.
  sitl::NavigationSensors sensors({}, 1);
  stages::Estimator estimator({});
  stages::Tracker tracker({});
  sitl::VehicleState truth;
  stages::Tracker::Input in;
  firmware_if::MotorCommand command;
  for (int frame = 1; frame <= 400; ++frame) {
    sensors.sample(MonotonicTime{frame * Nanos{2'500'000}}, truth);
    firmware_if::ImuSample imu;
    while (sensors.read(imu) == Status::kOk) (void)estimator.predict(imu);
    firmware_if::GnssFix fix;
    while (sensors.read(fix) == Status::kOk) (void)estimator.update(fix);
    firmware_if::BarometerSample pressure;
    while (sensors.read(pressure) == Status::kOk) (void)estimator.update(pressure);
    if (estimator.state(in.state) == Status::kOk) (void)tracker.step(in, command);
  }
  std::printf("%llu\n", static_cast<unsigned long long>(units));
  return 0;
}
