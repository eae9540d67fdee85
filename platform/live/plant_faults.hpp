/// The faults of a scenario over a plant: begun by what can be seen of a flight from outside.
#pragma once

#include <string>

#include "platform/mission/mission_faults.hpp"

namespace roborun::live {

/// Throws InputError, with the file's name, for a fault that is not the plant's (planner, map, computer), or that begins with a
/// phase that cannot be told from outside (holding, returning, landing).
void check_plant_faults(const std::string& file, const mission::MissionConfig& config);

/// Phases are ground until it has left the ground, take_off until it is at the height of its first hover, and mission from then
/// on. What counts from no phase counts from leaving the ground. One thread: cameras in another one have their own.
class PlantFaults {
 public:
  /// `config` must outlive it.
  PlantFaults(const mission::MissionConfig& config, double cruise_m) noexcept
      : faults_(config), cruise_m_(cruise_m) {
    faults_.count_from(std::nullopt);
  }
  [[nodiscard]] bool empty() const noexcept { return faults_.empty(); }
  [[nodiscard]] const sitl::FaultLine& line() const noexcept { return faults_.line(); }
  /// As MissionFaults::connect().
  [[nodiscard]] std::vector<firmware_if::DepthCamera*> connect(
      std::span<firmware_if::DepthCamera* const> cameras) {
    return faults_.connect(cameras);
  }
  /// `height_m`: where the vehicle is at `now`, world frame.
  void advance(MonotonicTime now, double height_m) noexcept;
  [[nodiscard]] Vector3 mean_wind_W_mps() const { return faults_.mean_wind_W_mps(); }
  [[nodiscard]] std::size_t begun() const noexcept { return faults_.begun(); }

 private:
  mission::MissionFaults faults_;
  double cruise_m_;
  std::optional<double> stood_m_;  ///< Height at the start.
  governor::Phase phase_{governor::Phase::kGround};
};

}  // namespace roborun::live
