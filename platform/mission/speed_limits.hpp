/// How fast a vehicle can be flown, and which of its numbers limits that.
#pragma once

#include <string>
#include <vector>

#include "platform/flight/flight_config.hpp"

namespace roborun::mission {

struct SpeedLimit {
  const char* name;  ///< One word.
  double speed_mps{};
  std::string why;  ///< The numbers that it follows from.
};

struct SpeedLimits {
  std::vector<SpeedLimit> always{};  ///< "file", "sight", "drag".
  std::vector<SpeedLimit>
      where{};  ///< What the flight lowers it to: "slow-decisions", "thin", "motion", "goal".
  /// Returns the least of `always`, the first of equal ones: what it can be flown at in the open.
  [[nodiscard]] const SpeedLimit& lowest() const;
};

/// All of them, of the design aware. They come from the functions that the flight calls: the governor's upper bound, its safe
/// speed for the stop that trajectories are planned with inside what the sensors see, its limit in each situation, and the level
/// flight that a vehicle is refused beyond. A plan may still be slower: around obstacles, through what is not seen yet, and where decisions
/// take longer. Precondition: config.validate() is kOk, it aims at time, and sensors are described (flight::describe_sensors).
[[nodiscard]] SpeedLimits speed_limits(const flight::FlightConfig& config);

}  // namespace roborun::mission
