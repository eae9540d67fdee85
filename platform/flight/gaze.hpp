/// Where a vehicle looks that does not see all around: a look round before its first move, then where its trajectory
/// goes, or at what it has to see; and round again when it is stuck. Safety does not depend on it: what is flown stays in known free space.
#pragma once

#include <cstdint>
#include <optional>

#include "core/trajectory.hpp"
#include "firmware_if/time.hpp"
#include "platform/flight/flight_config.hpp"

namespace roborun::flight {

struct GazeTarget {
  Vector3 at_W = Vector3::Zero();
  /// Where it flies is what counts, and this is seen aside of it; false: this is what it has to see, until it is stuck.
  bool aside{};
};

class Gaze {
 public:
  struct Input {
    MonotonicTime now{};
    const Trajectory& committed;
    std::uint64_t committed_number{};  ///< Another one for each trajectory.
    std::optional<GazeTarget> target{};
  };
  Gaze(const GazeConfig& config, double period_s) noexcept : config_(config), period_s_(period_s) {}

  /// The yaw on the ground.
  void begin(double yaw_rad) noexcept { yaw_rad_ = yaw_rad; }
  /// To be called once a minor frame in flight, with the climb as the first trajectory. Returns the yaw, which
  /// turns by at most yaw_rate_radps; that of begin() if it does not follow. RT-safe: O(1).
  [[nodiscard]] double step(const Input& in) noexcept;
  /// False until the first look round is over: nothing may be flown before.
  [[nodiscard]] bool ready() const noexcept { return !config_.follows || ready_; }

 private:
  void turn_on() noexcept;
  void turn_to(double target_rad) noexcept;

  GazeConfig config_;
  double period_s_;
  double yaw_rad_{0.0};
  double turned_rad_{0.0};  ///< In the first look round.
  bool ready_{false};
  std::uint64_t number_{0};
  MonotonicTime still_since_{};  ///< No new trajectory, no motion.
};

}  // namespace roborun::flight
