/// A power module on the bus: tells how much the battery still holds.
#pragma once

#include <cstdint>
#include <limits>

#include "platform/sitl/bus/fake_node.hpp"

namespace roborun::sitl {

/// Sends power.BatteryInfo at 10 Hz and NodeStatus at 1 Hz. Listens to nobody.
class FakePowerModule {
 public:
  static constexpr Nanos kPeriod{100'000'000};
  /// Of a charge: what a monitor says that does not know, or is broken. Any value above 100 is none.
  static constexpr std::uint8_t kNoCharge_pct = 127;

  FakePowerModule(std::uint8_t node_id, firmware_if::CanBus& bus) noexcept
      : info_(bus, node_id, 24, kPeriod), heartbeat_(bus, node_id) {}

  /// @param charge_ratio  Of the full charge, 0 .. 1; said in whole percent, rounded down. Anything else,
  ///                      NaN included, is said as kNoCharge_pct.
  void step(double charge_ratio, MonotonicTime now) noexcept;
  void set_silent(bool silent) noexcept { silent_ = silent; }

 private:
  FakeVoice<firmware_if::dronecan::BatteryInfo> info_;
  FakeHeartbeat heartbeat_;
  bool silent_{false};
};

}  // namespace roborun::sitl
