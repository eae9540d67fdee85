#include "platform/live/far_end.hpp"

#include <fmt/format.h>

#include <cmath>

namespace roborun::live {
namespace {

constexpr Nanos kEscSilence{500'000'000};

}  // namespace

void look_at_power(const flight::ActuatorSide& motors, MonotonicTime now, std::vector<Need>& needs) {
  Need escs{"ESCs", {}};
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& esc = motors.node().inbox().esc[i];
    if (esc.count == 0 || now - esc.stamp > kEscSilence)
      escs.lacks += fmt::format("{}ESC {} is silent on the bus", escs.lacks.empty() ? "" : ", ", i + 1);
  }
  needs.push_back(escs);
  needs.push_back(battery_need(motors.charge_ratio(now), "its monitor says nothing on the bus"));
}

Need battery_need(double charge_ratio, const char* unknown) {
  constexpr double kLeast_ratio = 0.3;
  Need battery{"battery", {}};
  if (std::isnan(charge_ratio))
    battery.lacks = unknown;
  else if (charge_ratio < kLeast_ratio)
    battery.lacks =
        fmt::format("{:.0f} % left: must be {:.0f} % at least", 100.0 * charge_ratio, 100.0 * kLeast_ratio);
  return battery;
}

}  // namespace roborun::live
