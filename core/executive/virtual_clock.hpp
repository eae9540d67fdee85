/// Time that moves only when told to: simulation and replay in lockstep.
#pragma once

#include "firmware_if/clock.hpp"

namespace roborun::core {

/// One instance a lane, so that a lane whose work is charged runs ahead of the others until they catch up.
/// Neither call goes back: an earlier time or a negative cost changes nothing. One thread.
class VirtualClock final : public firmware_if::Clock {
 public:
  [[nodiscard]] MonotonicTime now() const noexcept override { return now_; }
  void set(MonotonicTime time) noexcept { now_ = time > now_ ? time : now_; }
  void advance(Nanos cost) noexcept { now_ += cost > Nanos{0} ? cost : Nanos{0}; }

 private:
  MonotonicTime now_{};
};

}  // namespace roborun::core
