/// Tells systemd that the program runs, and that it still does: sd_notify's protocol, without its library.
#pragma once

#include <string_view>

namespace roborun::rt {

/// Without NOTIFY_SOCKET in the environment, nothing is ever sent. Not for real-time lanes.
class ServiceNotifier {
 public:
  ServiceNotifier();
  ~ServiceNotifier();
  ServiceNotifier(const ServiceNotifier&) = delete;
  ServiceNotifier& operator=(const ServiceNotifier&) = delete;

  /// "READY=1", "WATCHDOG=1" or "STOPPING=1". False: nobody was told.
  bool tell(std::string_view state) noexcept;

 private:
  int socket_{-1};
};

}  // namespace roborun::rt
