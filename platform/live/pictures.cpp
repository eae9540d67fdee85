#include "platform/live/pictures.hpp"

#include <fmt/format.h>

#include <chrono>
#include <thread>

#include "platform/input/input_error.hpp"

namespace roborun::live {
namespace {

std::vector<std::size_t> points_of(const sitl::CameraRig& rig, std::size_t lidars) {
  std::vector<std::size_t> points;
  for (std::size_t i = 0; i < lidars; ++i) points.push_back(rig.rays(i));
  return points;
}

}  // namespace

Pictures::Pictures(const sitl::World& world, const mission::MissionConfig& config, const std::string& port)
    : rig_(world, config.simulator, config.seed),
      faults_(config, world.start_W().z()),
      cameras_(faults_.connect(rig_.cameras())),
      ports_(sitl::rig_of(config.simulator), points_of(rig_, sitl::rig_of(config.simulator).lidars.size()),
             sensor_port::VehiclePorts(port)) {}

std::uint64_t Pictures::send(Nanos shift) noexcept {
  std::uint64_t sent = 0;
  firmware_if::DepthFrame frame;
  for (std::size_t i = 0; i < cameras_.size(); ++i)
    if (cameras_[i]->read(frame) == Status::kOk) {
      ports_.write(i, frame, cameras_[i]->mount(), shift);
      ++sent;
    }
  firmware_if::LidarSweep sweep;
  for (std::size_t i = 0; i < rig_.lidars().size(); ++i)
    if (rig_.lidars()[i]->read(sweep) == Status::kOk) {
      ports_.write(i, sweep, rig_.lidars()[i]->mount(), shift);
      ++sent;
    }
  return sent;
}

std::uint64_t feed_pictures(const sitl::World& world, const PictureFeed& config) {
  constexpr int kLooks = 1000;  // without a pose, until the plant is asked for: two seconds
  const std::string path = sensor_port::VehiclePorts(config.port).truth();
  sensor_port::PortOdometry truth;
  if (const std::string wrong = truth.open(path, {}); !wrong.empty() || !sensor_port::is_written_to(path))
    throw InputError(fmt::format("{}: {}: start roborun plant --port {} --no-pictures first", path,
                                 wrong.empty() ? "nobody writes to it" : wrong, config.port));
  Pictures pictures(world, config.mission, config.port);
  std::uint64_t sent = 0;
  for (int silent = 0; !(config.stop && config.stop());) {
    firmware_if::OdometrySample pose;
    while (truth.read(pose) == Status::kOk) {
      silent = 0;
      const Quaternion q_WB(pose.q_OB[0], pose.q_OB[1], pose.q_OB[2], pose.q_OB[3]);
      pictures.expose(pose.stamp,
                      {q_WB.toRotationMatrix(), Vector3(pose.p_OB_m[0], pose.p_OB_m[1], pose.p_OB_m[2])});
    }
    sent += pictures.send(Nanos{0});
    if (++silent > kLooks) {
      if (!sensor_port::is_written_to(path)) break;
      silent = 0;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return sent;
}

}  // namespace roborun::live
