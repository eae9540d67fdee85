/// The vehicle's light: what people near it have to know.
#pragma once

#include <cstdint>

#include "firmware_if/transmit_gate.hpp"

namespace roborun::firmware_if {

enum class VehicleState : std::uint8_t {
  kSafe,      ///< Green: disarmed, no throttle can leave.
  kArmed,     ///< Red: propellers turn, or may at any moment.
  kFailsafe,  ///< Red and blue in turn: armed, and about to do something nobody commanded.
};

/// Sends LightsCommand at 2 Hz and at each change. One lane owns it. RT-safe: O(1).
class StatusLights {
 public:
  StatusLights(std::uint8_t light_id, TransmitGate& gate) noexcept : light_id_(light_id), gate_(gate) {}
  void step(MonotonicTime now, VehicleState state) noexcept;

 private:
  std::uint8_t light_id_;
  TransmitGate& gate_;
  bool said_{false};
  bool blink_{false};
  VehicleState said_state_{};
  MonotonicTime said_at_{};
};

}  // namespace roborun::firmware_if
