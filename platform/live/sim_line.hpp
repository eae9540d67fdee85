/// A line of the kernel's gpio-sim as a plant pulls it: what is wired to it in a vehicle.
#pragma once

#include <optional>
#include <string>

namespace roborun::live {

/// Writes "pull-up" or "pull-down" to a file, when the level changes. One thread.
class SimLine {
 public:
  /// `path`: the line's pull, below /sys/devices/platform/gpio-sim.N. Throws InputError for a file that cannot be written to.
  SimLine(const std::string& option, const std::string& path);
  ~SimLine();
  SimLine(const SimLine&) = delete;
  SimLine& operator=(const SimLine&) = delete;
  /// False: the kernel did not take it; the next call tries again.
  [[nodiscard]] bool pull(bool up) noexcept;

 private:
  int file_;
  std::optional<bool> is_up_;
};

}  // namespace roborun::live
