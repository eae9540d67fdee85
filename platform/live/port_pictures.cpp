#include "platform/live/port_pictures.hpp"

#include <fmt/format.h>

#include <cmath>

namespace roborun::live {
namespace {

// How far a camera may be from what the vehicle file says.
constexpr double kPlace_m = 0.05;
constexpr double kTurn = 0.05;  // norm of the difference of two rotations: 2 degrees
constexpr double kView_ratio = 0.05;

std::string words_of(const firmware_if::CameraMount& there, const firmware_if::CameraMount& wanted) {
  double apart_m = 0.0, turned = 0.0;
  for (std::size_t i = 0; i < 3; ++i) apart_m += std::pow(there.p_BC_m.at(i) - wanted.p_BC_m.at(i), 2.0);
  for (std::size_t i = 0; i < 9; ++i) turned += std::pow(there.R_BC.at(i) - wanted.R_BC.at(i), 2.0);
  if (std::sqrt(apart_m) > kPlace_m)
    return fmt::format("sits {:.2f} m from where the vehicle file says: mend one of both",
                       std::sqrt(apart_m));
  if (std::sqrt(turned) > kTurn) return "is turned otherwise than the vehicle file says: mend one of both";
  return {};
}

/// What contradicts the vehicle file; empty: nothing.
std::string contradiction(const firmware_if::DepthFrame& frame, const firmware_if::CameraMount& mount,
                          const CameraSpec& spec) {
  if (frame.width > spec.width || frame.height > spec.height)
    return fmt::format("has {} x {} pixels: the vehicle file says {} x {}", frame.width, frame.height,
                       spec.width, spec.height);
  const auto other = [](float there, double wanted) {
    return std::fabs(static_cast<double>(there) / wanted - 1.0) > kView_ratio;
  };
  if (other(frame.tan_half_width, spec.tan_half_width) || other(frame.tan_half_height, spec.tan_half_height))
    return fmt::format(
        "sees {:.2f} x {:.2f} (tangents of the half angles): the vehicle file says {:.2f} x {:.2f}",
        frame.tan_half_width, frame.tan_half_height, spec.tan_half_width, spec.tan_half_height);
  if (static_cast<double>(frame.range_m) < spec.range_m * (1.0 - kView_ratio))
    return fmt::format("sees {:.1f} m far: the vehicle file says {:.1f} m", frame.range_m, spec.range_m);
  return words_of(mount, camera_mount(spec.mount));
}

}  // namespace

PortPictures::PortPictures(const sensor_port::VehiclePorts& ports, const SensorRig& rig,
                           const sensor_port::PortClock& clock)
    : rig_(rig), clock_(clock), optics_(rig.cameras.size()) {
  using std::chrono::milliseconds;
  for (std::size_t i = 0; i < rig_.cameras.size(); ++i) {
    prepare(camera_.emplace_back(), fmt::format("camera {}", i + 1), ports.camera(i), milliseconds(500));
    cameras_.push_back(&camera_.back().device);
    watched_.push_back(&watched_camera_.emplace_back());
  }
  for (std::size_t i = 0; i < rig_.lidars.size(); ++i) {
    prepare(lidar_.emplace_back(), fmt::format("lidar {}", i + 1), ports.lidar(i), milliseconds(500));
    lidars_.push_back(&lidar_.back().device);
  }
}

Need PortPictures::look_at_camera(std::size_t index, MonotonicTime now) {
  Port<sensor_port::PortDepthCamera>& port = camera_[index];
  bool seen = false;
  Need need = look_at(
      port, now,
      [&] {
        std::string wrong = port.device.open(port.path, clock_);
        return wrong.empty() ? watched_camera_[index].open(port.path, clock_) : wrong;
      },
      [&] {
        firmware_if::DepthFrame frame;
        (void)watched_camera_[index].read(frame);  // its mount is that of the first image
        if (port.device.read(frame) != Status::kOk) return;
        seen = true;
        optics_[index] = contradiction(frame, port.device.mount(), rig_.cameras[index]);
      });
  if (need.lacks.empty() && !seen && refused_by(port.device) > port.device.reader().counters().read / 2)
    need.lacks =
        fmt::format("{}: most of its images are refused: roborun port check {}", port.path, port.path);
  if (need.lacks.empty() && !optics_[index].empty()) need.lacks = port.path + ": " + optics_[index];
  return need;
}

Need PortPictures::look_at_lidar(std::size_t index, MonotonicTime now) {
  Port<sensor_port::PortLidar>& port = lidar_[index];
  Need need = look_at(
      port, now, [&] { return port.device.open(port.path, clock_); },
      [&] {
        firmware_if::LidarSweep sweep;
        (void)port.device.read(sweep);
      });
  if (!need.lacks.empty() || port.device.newest() == MonotonicTime::min()) return need;
  if (const std::string mount = words_of(port.device.mount(), camera_mount(rig_.lidars[index].mount));
      !mount.empty())
    need.lacks = port.path + ": " + mount;
  return need;
}

void PortPictures::look(MonotonicTime now, std::vector<Need>& needs) {
  for (std::size_t i = 0; i < camera_.size(); ++i) needs.push_back(look_at_camera(i, now));
  for (std::size_t i = 0; i < lidar_.size(); ++i) needs.push_back(look_at_lidar(i, now));
}

void PortPictures::use(MonotonicTime now, std::vector<PortUse>& all) const {
  for (const auto& port : camera_) all.push_back(use_of(port, now));
  for (const auto& port : lidar_) all.push_back(use_of(port, now));
}

}  // namespace roborun::live
