#include "firmware_if/kill_switch.hpp"

namespace roborun::firmware_if {

bool KillSwitch::sample() noexcept {
  constexpr int kMostEdges = 16;
  GpioEdge edge;
  for (GpioInput* line : {&open_, &closed_}) {
    for (int i = 0; i < kMostEdges && line->next_edge(edge) == Status::kOk; ++i) ++counters_.edges;
  }
  auto open = open_.active();
  auto closed = closed_.active();
  const bool readable = open.ok() && closed.ok();
  const bool pressed = readable && open.value() && !closed.value();
  released_ = readable && !open.value() && closed.value();
  ++counters_.samples;
  counters_.pressed += pressed ? 1U : 0U;
  counters_.faults += !pressed && !released_ ? 1U : 0U;
  seen_run_ = seen_run_ || released_;
  seen_pressed_ = seen_pressed_ || pressed;
  if (released_) {
    counters_.glitches += suspect_ && !killed_ ? 1U : 0U;
  } else if (suspect_) {
    killed_ = true;
  }
  suspect_ = !released_;
  return killed_;
}

Status KillSwitch::reset() noexcept {
  if (!released_) return Status::kNotReady;
  killed_ = false;
  return Status::kOk;
}

}  // namespace roborun::firmware_if
