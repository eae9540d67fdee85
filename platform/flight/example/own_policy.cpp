/// A decision policy of your own, flown by the shipped simulator: slower the nearer something stands. Links
/// roborun::mission; in your own program it is FlightParts::policy.
#include <memory>

#include "fly.hpp"
#include "governor/policy/governor.hpp"
#include "platform/flight/flight_system.hpp"

namespace {

/// Keeps the contract of governor::DecisionPolicy (governor/policy/decision_policy.hpp). It asks the governor
/// that ships and changes its answer; a policy from nothing fills `point` itself: two precisions, three
/// volumes, a deadline and a speed.
class ShyPolicy final : public roborun::governor::DecisionPolicy {
 public:
  explicit ShyPolicy(const roborun::governor::GovernorConfig& config) noexcept : governor_(config) {}

  [[nodiscard]] roborun::governor::Decision decide(
      const roborun::SpaceProfile& profile, const roborun::governor::Situation& situation) noexcept override {
    roborun::governor::Decision decision = governor_.decide(profile, situation);
    // Half a metre per second for each metre of room, from walking pace on. Without an obstacle in view the
    // distance is infinite; the comparison is written so that NaN counts as no room.
    const double room_m = profile.closest_obstacle_m > 2.0 ? profile.closest_obstacle_m : 2.0;
    decision.cap_speed(0.5 * room_m);
    return decision;
  }
  void observe(roborun::core::StageId id, double predicted_s, double spent_s) noexcept override {
    governor_.observe(id, predicted_s, spent_s);  // its models follow the machine
  }
  [[nodiscard]] double v_max_mps() const noexcept override { return governor_.v_max_mps(); }

 private:
  roborun::governor::Governor governor_;
};

}  // namespace

int main() {
  roborun::board::OwnParts own;
  own.policy = [](const roborun::flight::FlightConfig& config) {
    return std::make_unique<ShyPolicy>(roborun::flight::governor_config(config));
  };
  return example::fly(own);
}
