#include "platform/app/camera_rig.hpp"

#include <algorithm>

namespace roborun::app {

CameraRig::CameraRig(const sitl::World& world, const sitl::DepthCameraConfig& config, std::uint64_t seed) {
  const auto mounts = sitl::six_camera_mounts();
  camera_.reserve(mounts.size());
  for (std::size_t i = 0; i < mounts.size(); ++i)
    camera_.emplace_back(world, config, mounts[i], seed, static_cast<std::uint32_t>(i));
}

void CameraRig::expose(MonotonicTime now, const Pose& X_WB) noexcept {
  for (sitl::SimulatedDepthCamera& camera : camera_) camera.expose(now, X_WB);
}

std::array<firmware_if::DepthCamera*, kCameras> CameraRig::cameras() noexcept {
  std::array<firmware_if::DepthCamera*, kCameras> all{};
  for (std::size_t i = 0; i < kCameras; ++i) all[i] = &camera_[i];
  return all;
}

CameraServer::CameraServer(const sitl::World& world, const sitl::DepthCameraConfig& config,
                           std::uint64_t seed)
    : world_(world), rig_(world, config, seed) {
  const auto mounts = sitl::six_camera_mounts();
  const std::size_t pixels = std::size_t{config.pixels} * config.pixels;
  for (std::size_t i = 0; i < kCameras; ++i) {
    served_[i].mount_ = mounts[i];
    for (std::size_t cell = 0; cell < 3; ++cell) served_[i].box.cell(cell).depth_m.assign(pixels, 0.0F);
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
  const auto cameras = rig_.cameras();
  for (std::size_t i = 0; i < kCameras; ++i) {
    firmware_if::DepthFrame frame;
    if (cameras[i]->read(frame) != Status::kOk) continue;
    Image& image = served_[i].box.draft();
    std::copy(frame.depth_m.begin(), frame.depth_m.end(), image.depth_m.begin());
    image.frame = frame;
    image.frame.depth_m = image.depth_m;
    served_[i].box.publish();
    work.units += frame.depth_m.size();
  }
  lane.describe(core::SlotId::kCameras, work);
}

std::array<firmware_if::DepthCamera*, kCameras> CameraServer::cameras() noexcept {
  std::array<firmware_if::DepthCamera*, kCameras> all{};
  for (std::size_t i = 0; i < kCameras; ++i) all[i] = &served_[i];
  return all;
}

Status CameraServer::Served::read(firmware_if::DepthFrame& frame) noexcept {
  if (!box.take()) return Status::kNotReady;
  frame = box.read().frame;
  return Status::kOk;
}

}  // namespace roborun::app
