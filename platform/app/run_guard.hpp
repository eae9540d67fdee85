/// `roborun run --guard`.
#pragma once

#include <string>

namespace roborun::app {

struct GuardOptions {
  std::string vehicle, link, port;
  double seconds{}, wait_s{};
  bool limits_speed{};
  bool json{};
};

/// The exit code. Throws InputError, also for cameras that are missing, and Interrupted.
[[nodiscard]] int run_guard(const GuardOptions& options);

}  // namespace roborun::app
