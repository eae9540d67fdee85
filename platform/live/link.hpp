/// The way from the runtime to what it flies, as a command line names it.
#pragma once

#include <optional>
#include <string>

#include "platform/mavlink/link.hpp"

namespace roborun::live {

struct Link {
  std::string name;  ///< Of the vehicle's ports (sensor_port::VehiclePorts).
  std::optional<mavlink::LinkAddress>
      mavlink{};  ///< To an autopilot; then only depth images come over ports.
  /// The vehicle's DroneCAN bus: an interface of the kernel, or empty for a bus made of ports. None: its sensors are ports.
  std::optional<std::string> dronecan{};
};

/// "port:NAME" or "dronecan:port:NAME"; or, with the ports `port`, "dronecan:INTERFACE" or what parse_link() reads. Throws InputError
/// for anything else.
[[nodiscard]] Link link_of(const std::string& text, const std::string& port = {});
/// Throws InputError "OPTION: ..." for what is no name of ports: letters, digits and ._- and at most 60 of them, or a path.
void check_port_name(const std::string& option, const std::string& name);

}  // namespace roborun::live
