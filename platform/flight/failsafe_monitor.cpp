#include "platform/flight/failsafe_monitor.hpp"

#include <cmath>

namespace roborun::flight {

governor::ConditionSet FailsafeMonitor::step(MonotonicTime now, const FailsafeMeasures& measures) noexcept {
  governor::ConditionSet set = 0;
  for (std::size_t i = 0; i < kFailsafeThresholds.size(); ++i) {
    const FailsafeThreshold& row = kFailsafeThresholds[i];
    const double value = measures.*row.measure;
    const bool unknown_is_fine = row.condition == governor::Condition::kBatteryCritical && std::isnan(value);
    if (value <= row.limit || unknown_is_fine)
      fine_[i] = now;
    else if (seconds(now - fine_[i]) > row.for_s)
      set |= governor::bit(row.condition);
  }
  return set;
}

}  // namespace roborun::flight
