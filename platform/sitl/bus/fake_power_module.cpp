#include "platform/sitl/bus/fake_power_module.hpp"

namespace roborun::sitl {

void FakePowerModule::step(double charge_ratio, MonotonicTime now) noexcept {
  constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
  if (silent_) return;
  if (info_.due(now)) {
    const bool known = charge_ratio >= 0.0 && charge_ratio <= 1.0;
    info_.say(
        {.temperature = kUnknown,
         .voltage = 44.4F,
         .current = kUnknown,
         .average_power_10sec = kUnknown,
         .remaining_capacity_wh = kUnknown,
         .full_charge_capacity_wh = kUnknown,
         .hours_to_full_charge = kUnknown,
         .state_of_health_pct = 127,
         .state_of_charge_pct = known ? static_cast<std::uint8_t>(100.0 * charge_ratio) : kNoCharge_pct},
        now);
  }
  heartbeat_.step(now);
}

}  // namespace roborun::sitl
