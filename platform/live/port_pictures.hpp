/// The depth cameras and LiDARs of a vehicle, as other processes write them to ports.
#pragma once

#include <deque>
#include <span>
#include <string>
#include <vector>

#include "core/sensor_rig.hpp"
#include "platform/live/port_look.hpp"
#include "platform/sensor_port/port_names.hpp"

namespace roborun::live {

class PortPictures {
 public:
  /// What of `rig` looks at space.
  PortPictures(const sensor_port::VehiclePorts& ports, const SensorRig& rig,
               const sensor_port::PortClock& clock);
  PortPictures(const PortPictures&) = delete;
  PortPictures& operator=(const PortPictures&) = delete;

  /// As FarEnd::look(): a camera has to be the one of the vehicle file.
  void look(MonotonicTime now, std::vector<Need>& needs);
  [[nodiscard]] std::span<firmware_if::DepthCamera* const> cameras() noexcept { return cameras_; }
  /// The same cameras once more, for another thread.
  [[nodiscard]] std::span<firmware_if::DepthCamera* const> watched() noexcept { return watched_; }
  [[nodiscard]] std::span<firmware_if::Lidar* const> lidars() noexcept { return lidars_; }
  void use(MonotonicTime now, std::vector<PortUse>& all) const;

 private:
  [[nodiscard]] Need look_at_camera(std::size_t index, MonotonicTime now);
  [[nodiscard]] Need look_at_lidar(std::size_t index, MonotonicTime now);

  SensorRig rig_;
  sensor_port::PortClock clock_;
  std::deque<Port<sensor_port::PortDepthCamera>> camera_;
  std::deque<sensor_port::PortDepthCamera> watched_camera_;
  std::deque<Port<sensor_port::PortLidar>> lidar_;
  std::vector<std::string>
      optics_;  ///< Of each camera: what contradicts the vehicle file; empty: nothing, or not seen yet.
  std::vector<firmware_if::DepthCamera*> cameras_, watched_;
  std::vector<firmware_if::Lidar*> lidars_;
};

}  // namespace roborun::live
