/// What simulated cameras and LiDARs see, written to their ports: by the plant, or by a process of its own.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "platform/live/plant_faults.hpp"
#include "platform/live/plant_ports.hpp"
#include "platform/mission/mission_config.hpp"
#include "platform/sitl/aircraft/camera_rig.hpp"

namespace roborun::live {

/// One thread.
class Pictures {
 public:
  /// Makes the ports. `world` must outlive it. Throws InputError.
  Pictures(const sitl::World& world, const mission::MissionConfig& config, const std::string& port);
  void expose(MonotonicTime now, const Pose& X_WB) noexcept {
    rig_.expose(now, X_WB);
    faults_.advance(now, X_WB.p_RT.z());
  }
  /// Renders and writes what is due; how many that were. Stamps become CLOCK_MONOTONIC by `shift`.
  std::uint64_t send(Nanos shift) noexcept;

 private:
  sitl::CameraRig rig_;
  PlantFaults faults_;
  std::vector<firmware_if::DepthCamera*> cameras_;  ///< Behind their faults.
  PicturePorts ports_;
};

struct PictureFeed {
  mission::MissionConfig mission{};  ///< As of the plant: vehicle, seed.
  std::string port;
  std::function<bool()> stop{};  ///< Asked once a millisecond or so; may be empty.
};

/// Makes the pictures of a plant that makes none, until that plant ends. How many were sent. Throws InputError if there is no such plant.
[[nodiscard]] std::uint64_t feed_pictures(const sitl::World& world, const PictureFeed& config);

}  // namespace roborun::live
