/// The kill switch: two wires that must disagree, and a memory that does not forget.
#pragma once

#include <cstdint>

#include "firmware_if/gpio.hpp"

namespace roborun::firmware_if {

/// A switch with one normally open and one normally closed contact on two lines:
///   open inactive, closed active   run
///   open active, closed inactive   pressed
///   both the same, or unreadable   broken wire, short, or gone: treated as pressed
///
/// Sampled once a control frame (period T). Two samples in a row that are not "run" kill: a pulse shorter
/// than T (interference) never does, one of 2 T always does, and the first frame that is zero is sent at most
/// 2 T after the edge. Latched until reset(). RT-safe: O(1).
class KillSwitch {
 public:
  struct Counters {
    std::uint64_t samples{};
    std::uint64_t pressed{};   ///< Samples with the pattern of a pressed switch.
    std::uint64_t faults{};    ///< Samples with an impossible pattern or an unreadable line.
    std::uint64_t glitches{};  ///< Single samples that were not "run", followed by one that was.
    std::uint64_t edges{};     ///< Of either line, as far as the buffer kept them.
  };

  KillSwitch(GpioInput& normally_open, GpioInput& normally_closed) noexcept
      : open_(normally_open), closed_(normally_closed) {}

  /// One sample; true: killed (now or before).
  [[nodiscard]] bool sample() noexcept;
  [[nodiscard]] bool killed() const noexcept { return killed_; }
  /// Both positions were seen since start: the switch works. TransmitGate::arm() asks for it.
  [[nodiscard]] bool proven() const noexcept { return seen_run_ && seen_pressed_; }
  /// The switch stands on "run" now.
  [[nodiscard]] bool released() const noexcept { return released_; }
  /// Forgets the kill. kNotReady: the switch does not stand on "run". A gate that was killed stays killed until
  /// its own reset_kill(), and disarmed after it.
  [[nodiscard]] Status reset() noexcept;
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  GpioInput& open_;
  GpioInput& closed_;
  bool killed_{false};
  bool released_{false};
  bool suspect_{false};  ///< The last sample was not "run".
  bool seen_run_{false};
  bool seen_pressed_{false};
  Counters counters_{};
};

}  // namespace roborun::firmware_if
