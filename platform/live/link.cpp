#include "platform/live/link.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "platform/input/input_error.hpp"

namespace roborun::live {

void check_port_name(const std::string& option, const std::string& name) {
  constexpr std::size_t kMost = 60;
  const bool is_path = name.find('/') != std::string::npos;
  const bool plain = std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '.' || c == '_' || c == '-';
  });
  if (name.empty() || (!is_path && (!plain || name.size() > kMost)))
    throw InputError(
        fmt::format("{}: '{}' is no name of ports: must be letters, digits and ._-, at most {} of them",
                    option, name, kMost));
}

namespace {

void need_ports(const std::string& port) {
  if (port.empty()) throw InputError("--port: must name the ports of the vehicle's depth images");
  check_port_name("--port", port);
}

}  // namespace

Link link_of(const std::string& text, const std::string& port) {
  if (text.find("://") != std::string::npos) {
    need_ports(port);
    try {
      return {port, mavlink::parse_link(text)};
    } catch (const InputError& error) {
      throw InputError(fmt::format("--link: {}", error.what()));
    }
  }
  const auto after = [](const std::string& word, const std::string& start) {
    return word.rfind(start, 0) == 0 ? std::optional(word.substr(start.size())) : std::nullopt;
  };
  const auto bus = after(text, "dronecan:");
  const auto name = after(bus.value_or(text), "port:");
  if (bus && !name) {
    if (bus->empty()) throw InputError("--link: dronecan: must be followed by an interface: dronecan:can0");
    need_ports(port);
    return {port, std::nullopt, *bus};
  }
  if (!port.empty()) throw InputError("--port: goes with a MAVLink or CAN --link: port:NAME has them all");
  if (!name)
    throw InputError(
        fmt::format("--link: '{}' is no way to a vehicle: must be port:NAME, dronecan:INTERFACE, or a "
                    "MAVLink URL (udpin://[HOST]:PORT, ...)",
                    text));
  check_port_name("--link", *name);
  return {*name, std::nullopt, bus ? std::optional<std::string>("") : std::nullopt};
}

}  // namespace roborun::live
