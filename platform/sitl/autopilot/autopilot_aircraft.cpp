#include "platform/sitl/autopilot/autopilot_aircraft.hpp"

#include <algorithm>

namespace roborun::sitl {

void SerialLine::send(MonotonicTime now, std::span<const std::uint8_t> bytes) noexcept {
  if (cut_ || bytes.empty() || count_ == kMost) return;
  Chunk& chunk = chunk_.at((first_ + count_++) % kMost);
  chunk.due = now + delay_;
  chunk.bytes = std::min(bytes.size(), chunk.data.size());
  std::copy_n(bytes.begin(), chunk.bytes, chunk.data.begin());
}

std::span<const std::uint8_t> SerialLine::receive(MonotonicTime now) noexcept {
  if (cut_) count_ = 0;
  if (count_ == 0 || chunk_.at(first_).due > now) return {};
  const Chunk& chunk = chunk_.at(first_);
  first_ = (first_ + 1) % kMost;
  --count_;
  return std::span<const std::uint8_t>(chunk.data).first(chunk.bytes);
}

void AutopilotAircraft::begin_frame(MonotonicTime now) noexcept {
  for (int i = 0; i < 40 && now_ < now; ++i) {
    now_ += minor_frame_;
    body_.begin_frame(now_);
    for (auto bytes = up_.receive(now_); !bytes.empty(); bytes = up_.receive(now_))
      fake_.receive(now_, bytes);
    // Its battery is what its power module says, with the faults of that.
    fake_.step(now_, body_, body_.vehicle().state().on_ground, body_.health(now_).battery_ratio);
    body_.end_frame(now_);
    down_.send(now_, fake_.outgoing());
    fake_.sent_all();
  }
  for (auto bytes = down_.receive(now); !bytes.empty(); bytes = down_.receive(now))
    (void)companion_.receive(now, bytes);
}

void AutopilotAircraft::end_frame(MonotonicTime now) noexcept {
  up_.send(now, companion_.outgoing());
  companion_.sent(companion_.outgoing().size());
}

flight::AircraftHealth AutopilotAircraft::health(MonotonicTime now) noexcept {
  const flight::AircraftHealth simulated = body_.health(now);
  const double told = companion_.report().battery_ratio;
  return {told, Nanos{0}, simulated.hears_operator, simulated.killed};
}

}  // namespace roborun::sitl
