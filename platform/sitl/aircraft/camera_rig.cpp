#include "platform/sitl/aircraft/camera_rig.hpp"

#include <algorithm>

namespace roborun::sitl {

SensorRig rig_of(const SimulatorConfig& config) noexcept {
  if (config.rig) return *config.rig;
  SensorRig rig = six_cameras(config.camera.pixels, config.camera.range_m);
  for (CameraSpec& camera : rig.cameras) {
    const SensorMount mount = camera.mount;
    camera = config.camera.spec();
    camera.mount = mount;
  }
  return rig;
}

CameraRig::CameraRig(const World& world, const SimulatorConfig& config, std::uint64_t seed, Readers readers) {
  const SensorRig rig = rig_of(config);
  const auto make_cameras = [&](std::vector<SimulatedDepthCamera>& cameras) {
    cameras.reserve(rig.cameras.size());
    for (std::size_t i = 0; i < rig.cameras.size(); ++i)
      cameras.emplace_back(world, rig.cameras[i], camera_mount(rig.cameras[i].mount), config.camera, seed,
                           static_cast<std::uint32_t>(i));
  };
  make_cameras(camera_);
  if (readers == Readers::kTwo) make_cameras(watched_camera_);
  lidar_.reserve(rig.lidars.size());
  for (std::size_t i = 0; i < rig.lidars.size(); ++i)
    lidar_.emplace_back(world, rig.lidars[i],
                        i < config.lidar_patterns.size() ? config.lidar_patterns[i] : std::vector<LidarRay>{},
                        config.lidar, seed, static_cast<std::uint32_t>(i));
  for (SimulatedDepthCamera& camera : camera_) cameras_.push_back(&camera);
  for (SimulatedDepthCamera& camera : watched_camera_) watched_.push_back(&camera);
  for (SimulatedLidar& lidar : lidar_) lidars_.push_back(&lidar);
}

void CameraRig::expose(MonotonicTime now, const Pose& X_WB) noexcept {
  for (SimulatedDepthCamera& camera : camera_) camera.expose(now, X_WB);
  for (SimulatedDepthCamera& camera : watched_camera_) camera.expose(now, X_WB);
  for (SimulatedLidar& lidar : lidar_) lidar.expose(now, X_WB);
}

CameraServer::CameraServer(const World& world, const SimulatorConfig& config, std::uint64_t seed)
    : world_(world), rig_(world, config, seed) {
  const SensorRig rig = rig_of(config);
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const std::size_t pixels = std::size_t{rig.cameras[i].width} * rig.cameras[i].height;
    for (std::deque<Served>* to : {&served_, &served_watched_}) {
      Served& served = to->emplace_back();
      served.mount_ = rig_.cameras()[i]->mount();
      for (std::size_t cell = 0; cell < 3; ++cell) served.box.cell(cell).depth_m.assign(pixels, 0.0F);
      (to == &served_ ? cameras_ : watched_).push_back(&served);
    }
  }
  for (std::size_t i = 0; i < rig.lidars.size(); ++i) {
    ServedLidar& served = served_lidar_.emplace_back();
    served.mount_ = rig_.lidars()[i]->mount();
    const std::size_t rays = rig_.rays(i);
    for (std::size_t cell = 0; cell < 3; ++cell) served.box.cell(cell).points_L_m.assign(rays, {});
    lidars_.push_back(&served);
  }
}

void CameraServer::run(core::SlotId, core::LaneExecutive& lane) noexcept {
  Exposure exposure;
  core::Work work;
  while (exposure_.pop(exposure)) {
    rig_.expose(exposure.now, exposure.X_WB);
    last_p_WB_ = exposure.X_WB.p_RT;
    least_clearance_m_ = std::min(least_clearance_m_, world_.clearance_m(last_p_WB_, 2.0));
  }
  for (std::size_t i = 0; i < cameras_.size(); ++i) serve(i, work);
  for (std::size_t i = 0; i < lidars_.size(); ++i) serve_lidar(i, work);
  lane.describe(core::SlotId::kCameras, work);
}

void CameraServer::serve(std::size_t camera, core::Work& work) noexcept {
  firmware_if::DepthFrame frame;
  if (rig_.cameras()[camera]->read(frame) != Status::kOk) return;
  for (Served* to : {&served_[camera], &served_watched_[camera]}) {
    Image& image = to->box.draft();
    std::copy(frame.depth_m.begin(), frame.depth_m.end(), image.depth_m.begin());
    image.frame = frame;
    image.frame.depth_m = image.depth_m;
    to->box.publish();
  }
  work.units += frame.depth_m.size();
}

void CameraServer::serve_lidar(std::size_t lidar, core::Work& work) noexcept {
  firmware_if::LidarSweep read;
  if (rig_.lidars()[lidar]->read(read) != Status::kOk) return;
  Sweep& to = served_lidar_[lidar].box.draft();
  std::copy(read.points_L_m.begin(), read.points_L_m.end(), to.points_L_m.begin());
  to.sweep = read;
  to.sweep.points_L_m = std::span(to.points_L_m).first(read.points_L_m.size());
  served_lidar_[lidar].box.publish();
  work.units += read.points_L_m.size();
}

Status CameraServer::Served::read(firmware_if::DepthFrame& frame) noexcept {
  if (!box.take()) return Status::kNotReady;
  frame = box.read().frame;
  return Status::kOk;
}

Status CameraServer::ServedLidar::read(firmware_if::LidarSweep& sweep) noexcept {
  if (!box.take()) return Status::kNotReady;
  sweep = box.read().sweep;
  return Status::kOk;
}

}  // namespace roborun::sitl
