#include "platform/sitl/aircraft/camera_rig.hpp"

#include <algorithm>

namespace roborun::sitl {

CameraRig::CameraRig(const World& world, const DepthCameraConfig& config, std::uint64_t seed) {
  const auto mounts = six_camera_mounts();
  camera_.reserve(mounts.size());
  for (std::size_t i = 0; i < mounts.size(); ++i)
    camera_.emplace_back(world, config, mounts[i], seed, static_cast<std::uint32_t>(i));
  for (SimulatedDepthCamera& camera : camera_) cameras_.push_back(&camera);
}

void CameraRig::expose(MonotonicTime now, const Pose& X_WB) noexcept {
  for (SimulatedDepthCamera& camera : camera_) camera.expose(now, X_WB);
}

CameraServer::CameraServer(const World& world, const DepthCameraConfig& config, std::uint64_t seed)
    : world_(world), rig_(world, config, seed) {
  const std::size_t pixels = std::size_t{config.pixels} * config.pixels;
  for (const firmware_if::DepthCamera* camera : rig_.cameras()) {
    Served& served = served_.emplace_back();
    served.mount_ = camera->mount();
    for (std::size_t cell = 0; cell < 3; ++cell) served.box.cell(cell).depth_m.assign(pixels, 0.0F);
    cameras_.push_back(&served);
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
  for (std::size_t i = 0; i < cameras.size(); ++i) {
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

Status CameraServer::Served::read(firmware_if::DepthFrame& frame) noexcept {
  if (!box.take()) return Status::kNotReady;
  frame = box.read().frame;
  return Status::kOk;
}

}  // namespace roborun::sitl
