/// A route: places that are flown to one after the other, and what is done at them; in lockstep and on real time the same.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/fence.hpp"
#include "core/geometry/vector.hpp"
#include "governor/policy/governor.hpp"
#include "platform/board/backends.hpp"

namespace roborun::mission {

/// Flown to, one after the other; then what else there is to do, in hover.
struct RouteStep {
  std::optional<Vector3> goal_W{};    ///< None: where it is.
  std::optional<double> speed_mps{};  ///< At most so fast from here on.
  double hold_s{0.0};
  bool releases{false};  ///< The package.
  bool returns{false};   ///< goal_W is over where it took off: its height alone counts.
  std::string where;     ///< "line 4", "item 3".
};

struct Route {
  std::vector<RouteStep> steps;  ///< At least one with a goal; it lands where the last one ends.
  double cruise_m{};             ///< Height of the first climb.
  core::Fence fence{};

  [[nodiscard]] Aabb box_W() const;  ///< Around its goals and the first hover.
  [[nodiscard]] const Vector3& first_W() const;
  [[nodiscard]] bool releases() const;  ///< The package, somewhere.
};

/// Throws InputError for the first goal that is not inside of bounds and fence with so much room.
void check_route(const Route& route, const Aabb& bounds_W, const core::Fence& fence, double room_m);

/// The governor that ships, and never faster than was said last. cap() from any thread.
class SpeedCap final : public governor::DecisionPolicy {
 public:
  SpeedCap(const governor::GovernorConfig& config, const std::atomic<double>& cap_mps) noexcept
      : governor_(config), cap_mps_(cap_mps) {}
  [[nodiscard]] governor::Decision decide(const SpaceProfile& profile,
                                          const governor::Situation& situation) noexcept override;
  void observe(core::StageId id, double predicted_s, double spent_s) noexcept override {
    governor_.observe(id, predicted_s, spent_s);
  }
  [[nodiscard]] double v_max_mps() const noexcept override { return governor_.v_max_mps(); }

 private:
  governor::Governor governor_;
  const std::atomic<double>& cap_mps_;
};

/// `own`, and for a route the governor with a cap, which outlives the flight.
[[nodiscard]] board::OwnParts parts_of(board::OwnParts own, const std::optional<Route>& route,
                                       const std::atomic<double>& cap_mps);

/// A route while it is flown: which goal is flown to, what is done there, and when it is done. One thread.
class RouteFlight {
 public:
  /// What is to be done now.
  struct Order {
    std::optional<Vector3> goal_W{};
    std::optional<double> speed_mps{};
    bool releases{false};
  };
  explicit RouteFlight(const Route& route) : route_(route) {}
  /// A package that has not been let go by then stays on its hook, and the route goes on.
  static constexpr double kMostRelease_s = 10.0;
  /// `is_there`: at the goal of now, and standing. `released`: packages by now, as the vehicle confirms. Called again and again
  /// once the first hover is over; goals must be obeyed in the order of their giving.
  [[nodiscard]] Order step(double now_s, const Vector3& p_W, bool is_there, std::uint64_t released);
  [[nodiscard]] bool is_done() const noexcept { return at_ == route_.steps.size(); }
  /// Steps that are over.
  [[nodiscard]] std::size_t done() const noexcept { return at_; }
  /// It is where it was to go, and waits.
  [[nodiscard]] bool holds() const noexcept { return there_s_.has_value(); }

 private:
  const Route& route_;
  std::size_t at_{0};
  bool begun_{false};                 ///< Step at_.
  std::optional<double> there_s_;     ///< Since when it is there.
  std::uint64_t released_before_{0};  ///< When the step began.
  std::optional<double> released_s_;  ///< When it was more.
  std::optional<Vector3> home_W_;     ///< Where the first call found it.
};

}  // namespace roborun::mission
