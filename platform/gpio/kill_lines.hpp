/// The two contacts of a kill switch when they are not the simulator's own: lines of the kernel.
#pragma once

#include <array>

#include "platform/gpio/gpiod_line.hpp"

namespace roborun::gpio {

/// Normally open and normally closed contact.
using KillWiring = std::array<gpio::LineConfig, 2>;

class KernelKillLines {
 public:
  /// Throws InputError, in one line, for a line that cannot be had (missing, busy, renamed) and for a
  /// switch that does not stand on "run": then nothing may be armed.
  explicit KernelKillLines(const KillWiring& wiring);

  [[nodiscard]] firmware_if::GpioInput& open() noexcept { return open_; }
  [[nodiscard]] firmware_if::GpioInput& closed() noexcept { return closed_; }

 private:
  gpio::GpiodInput open_;
  gpio::GpiodInput closed_;
};

}  // namespace roborun::gpio
