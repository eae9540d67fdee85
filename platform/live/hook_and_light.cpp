#include "platform/live/hook_and_light.hpp"

#include "platform/mission/route.hpp"

namespace roborun::live {
namespace {

constexpr Nanos kAsked = from_seconds(mission::RouteFlight::kMostRelease_s);
constexpr Nanos kFalls{1'000'000'000};  // clear of the hook

}  // namespace

void HookAndLight::step(MonotonicTime now, std::optional<double> height_m) noexcept {
  if (is_asked_.exchange(false, std::memory_order_relaxed)) {
    asked_until_ = now + kAsked;
    hangs_ = true;
  }
  const bool killed = motors_.kill_switch().killed();
  (void)hook_.step(now, {.wanted = now < asked_until_,
                         .killed = killed,
                         .estimated = flown_.estimated,
                         .height_m = height_m.value_or(flown_.height_m),
                         .speed_mps = flown_.speed_mps});
  const auto& hook = motors_.node().inbox().hardpoint;
  if (hangs_ && hook_.open() && hook.count > 0 && hook.message.status == 0) {
    hangs_ = false;
    asked_until_ = now + kFalls;
    released_.fetch_add(1, std::memory_order_relaxed);
  }
  using firmware_if::VehicleState;
  light_.step(now, !motors_.armed() || killed ? VehicleState::kSafe
                   : flown_.acts              ? VehicleState::kFailsafe
                                              : VehicleState::kArmed);
}

void HookAndLight::look(MonotonicTime now, std::vector<Need>& needs) const {
  constexpr Nanos kSilent{2'500'000'000};  // two of its messages
  if (!needs_hook_) return;
  const auto& hook = motors_.node().inbox().hardpoint;
  Need need{"hook", {}};
  if (hook.count == 0 || now - hook.stamp > kSilent)
    need.lacks = "no hardpoint.Status on the bus: the mission releases a package; is its node powered?";
  else if (hook.message.status == 0)
    need.lacks = "says that it holds nothing: hang the package on it";
  needs.push_back(need);
}

}  // namespace roborun::live
