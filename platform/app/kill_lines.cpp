#include "platform/app/kill_lines.hpp"

#include "firmware_if/kill_switch.hpp"
#include "platform/sitl/world/input_error.hpp"

namespace roborun::app {

KernelKillLines::KernelKillLines(const KillWiring& wiring) {
  for (const auto& [line, config] : {std::pair{&open_, &wiring[0]}, std::pair{&closed_, &wiring[1]}}) {
    if (const std::string why = line->open(*config); !why.empty())
      throw sitl::InputError("--kill-lines: not armed: " + why);
  }
  firmware_if::KillSwitch now(open_, closed_);
  (void)now.sample();
  if (now.released()) return;
  throw sitl::InputError("--kill-lines: not armed: " +
                         std::string(now.counters().pressed > 0
                                         ? "the kill switch is pressed: release it"
                                         : "both contacts say the same: a wire is broken or swapped (roborun "
                                           "gpio check shows it)"));
}

}  // namespace roborun::app
