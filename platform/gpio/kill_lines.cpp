#include "platform/gpio/kill_lines.hpp"

#include "firmware_if/kill_switch.hpp"
#include "platform/input/input_error.hpp"

namespace roborun::gpio {

KernelKillLines::KernelKillLines(const KillWiring& wiring) {
  for (const auto& [line, config] : {std::pair{&open_, &wiring[0]}, std::pair{&closed_, &wiring[1]}}) {
    if (const std::string why = line->open(*config); !why.empty())
      throw InputError("--kill-lines: not armed: " + why);
  }
  firmware_if::KillSwitch now(open_, closed_);
  (void)now.sample();
  if (now.released()) return;
  throw InputError("--kill-lines: not armed: " +
                   std::string(now.counters().pressed > 0
                                   ? "the kill switch is pressed, or its wires are swapped, or "
                                     "--active-low is not how they are wired"
                                   : "both contacts of the kill switch say the same, or one says "
                                     "nothing: a wire is broken (roborun gpio check)"));
}

}  // namespace roborun::gpio
