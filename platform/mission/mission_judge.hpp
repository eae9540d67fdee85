/// Judges a simulated mission by the true world: collisions, safety, and when and why it ends.
#pragma once

#include <limits>
#include <string>

#include "core/geometry/fence.hpp"
#include "platform/flight/flight_system.hpp"
#include "platform/mission/mission_config.hpp"
#include "platform/report/mission_result.hpp"
#include "platform/sitl/aircraft/simulated_aircraft.hpp"
#include "platform/sitl/world/world.hpp"

namespace roborun::mission {

class MissionJudge {
 public:
  /// What it judges must outlive it.
  MissionJudge(const JudgeConfig& config, const core::Fence& fence, double radius_m, const sitl::World& world,
               const sitl::SimulatedAircraft& aircraft, flight::FlightSystem& system)
      : config_(config),
        fence_(fence),
        radius_m_(radius_m),
        world_(world),
        aircraft_(aircraft),
        system_(system) {}

  /// To be called after every minor frame. Why the mission is over, or null: it goes on. A mission that is
  /// given up (too late, no progress) goes on without decisions until the vehicle stands.
  [[nodiscard]] const char* judge(MonotonicTime now);
  [[nodiscard]] bool given_up() const noexcept { return give_up_ != nullptr; }
  [[nodiscard]] bool collided() const noexcept { return collided_; }
  [[nodiscard]] report::SafetyRecord& safety() noexcept { return safety_; }

  /// A route: the goal of now is (not) the one where the mission ends; `waits`: at a place on purpose.
  void on_route(bool is_last, bool waits, MonotonicTime now) noexcept {
    is_last_ = is_last;
    if (waits) best_at_ = now;
  }

 private:
  [[nodiscard]] bool is_last() const noexcept {
    return is_last_ && system_.decision_program().goals().is_last();
  }
  void watch(MonotonicTime now);
  /// "collision" or "struck", with safety_.end; null: it touches nothing that it should not.
  [[nodiscard]] const char* contact(MonotonicTime now);
  /// Why a mission that the failsafe left alone is over or given up, with safety_.end; null: neither.
  [[nodiscard]] const char* hopeless(MonotonicTime now);
  const char* ends(const char* reason, std::string why);
  [[nodiscard]] const char* failsafe_reason(MonotonicTime now) const;
  /// Or needs not to, because the judge asks for no less.
  [[nodiscard]] bool believes_to_have_arrived() const;

  const JudgeConfig& config_;
  const core::Fence& fence_;
  double radius_m_;  ///< Of the vehicle's body, a sphere.
  const sitl::World& world_;
  const sitl::SimulatedAircraft& aircraft_;
  flight::FlightSystem& system_;
  report::SafetyRecord safety_;
  const char* give_up_{nullptr};  ///< Why the vehicle stops where it is.
  bool collided_{false};
  bool left_ground_{false};
  bool is_last_{true};
  double sink_mps_{0.0};
  double best_distance_m_{std::numeric_limits<double>::infinity()};
  Vector3 goal_W_ = Vector3::Zero();  ///< Of the time before.
  Vector3 moved_to_W_ = Vector3::Zero();
  MonotonicTime best_at_{};
};

}  // namespace roborun::mission
