#include "platform/live/far_end.hpp"

#include <fmt/format.h>

#include <cmath>

namespace roborun::live {

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
