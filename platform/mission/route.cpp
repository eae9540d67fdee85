#include "platform/mission/route.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "platform/flight/flight_system.hpp"
#include "platform/input/input_error.hpp"

namespace roborun::mission {

Aabb Route::box_W() const {
  Aabb box_W{Vector3(0.0, 0.0, cruise_m), Vector3(0.0, 0.0, cruise_m)};
  for (const RouteStep& step : steps) {
    if (!step.goal_W) continue;
    box_W.min_W = box_W.min_W.cwiseMin(*step.goal_W);
    box_W.max_W = box_W.max_W.cwiseMax(*step.goal_W);
  }
  return box_W;
}

const Vector3& Route::first_W() const {
  return *std::find_if(steps.begin(), steps.end(), [](const RouteStep& s) {
            return s.goal_W.has_value();
          })->goal_W;
}

bool Route::releases() const {
  return std::any_of(steps.begin(), steps.end(), [](const RouteStep& s) { return s.releases; });
}

void check_route(const Route& route, const Aabb& bounds_W, const core::Fence& fence, double room_m) {
  RouteStep first;
  first.where = "take-off";
  first.goal_W = Vector3(0.0, 0.0, route.cruise_m);
  std::vector<RouteStep> steps{first};
  steps.insert(steps.end(), route.steps.begin(), route.steps.end());
  for (const RouteStep& step : steps) {
    if (!step.goal_W) continue;
    const Vector3& p_W = *step.goal_W;
    if (!bounds_W.contains(p_W))
      throw InputError(
          fmt::format("{}: ({:.2f}, {:.2f}, {:.2f}): must be inside the bounds, ({:g}, {:g}, {:g}) to "
                      "({:g}, {:g}, {:g})",
                      step.where, p_W.x(), p_W.y(), p_W.z(), bounds_W.min_W.x(), bounds_W.min_W.y(),
                      bounds_W.min_W.z(), bounds_W.max_W.x(), bounds_W.max_W.y(), bounds_W.max_W.z()));
    if (!fence.allows(Aabb::around(p_W, room_m)))
      throw InputError(
          fmt::format("{}: ({:.2f}, {:.2f}, {:.2f}): must be inside the fence, with {} m to spare",
                      step.where, p_W.x(), p_W.y(), p_W.z(), room_m));
  }
}

governor::Decision SpeedCap::decide(const SpaceProfile& profile,
                                    const governor::Situation& situation) noexcept {
  governor::Decision decision = governor_.decide(profile, situation);
  decision.cap_speed(cap_mps_.load(std::memory_order_relaxed));
  return decision;
}

RouteFlight::Order RouteFlight::step(double now_s, const Vector3& p_W, bool is_there,
                                     std::uint64_t released) {
  constexpr double kRelease_s = 2.0;  // until it has fallen clear
  Order order;
  if (!home_W_) home_W_ = p_W;
  if (is_done()) return order;
  const RouteStep& step = route_.steps[at_];
  if (!begun_) {
    begun_ = true;
    there_s_.reset();
    released_s_.reset();
    released_before_ = released;
    order.goal_W = step.goal_W;
    if (step.returns) order.goal_W = Vector3(home_W_->x(), home_W_->y(), step.goal_W->z());
    order.speed_mps = step.speed_mps;
    order.releases = step.releases;
    if (step.goal_W) return order;  // is_there is about the goal before
    there_s_ = now_s;
  }
  if (!there_s_ && is_there) there_s_ = now_s;
  if (released > released_before_ && !released_s_) released_s_ = now_s;
  const bool has_fallen = !step.releases || (released_s_ && now_s - *released_s_ >= kRelease_s);
  const double waited_s = there_s_ ? now_s - *there_s_ : -1.0;
  if (waited_s >= (has_fallen ? step.hold_s : kMostRelease_s)) {
    ++at_;
    begun_ = false;
    there_s_.reset();
  }
  return order;
}

board::OwnParts parts_of(board::OwnParts own, const std::optional<Route>& route,
                         const std::atomic<double>& cap_mps) {
  if (route && !own.policy)
    own.policy = [&cap_mps](const flight::FlightConfig& flight) {
      return std::make_unique<SpeedCap>(flight::governor_config(flight), cap_mps);
    };
  return own;
}

}  // namespace roborun::mission
