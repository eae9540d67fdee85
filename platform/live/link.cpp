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

Link link_of(const std::string& text, const std::string& port) {
  if (text.find("://") != std::string::npos) {
    if (port.empty()) throw InputError("--port: must name the ports of the vehicle's depth images");
    check_port_name("--port", port);
    try {
      return {port, mavlink::parse_link(text)};
    } catch (const InputError& error) {
      throw InputError(fmt::format("--link: {}", error.what()));
    }
  }
  if (!port.empty()) throw InputError("--port: goes with a MAVLink --link: port:NAME has them all");
  const std::size_t colon = text.find(':');
  const std::string kind = text.substr(0, colon);
  const std::string rest = colon == std::string::npos ? "" : text.substr(colon + 1);
  if (kind == "dronecan")
    throw InputError(fmt::format(
        "--link: {}: sensors from the bus (RawIMU, Fix2, pressure) are not there yet: must be port:NAME",
        text));
  if (kind != "port" || colon == std::string::npos)
    throw InputError(fmt::format(
        "--link: '{}' is no way to a vehicle: must be port:NAME, or a MAVLink URL (udpin://[HOST]:PORT, ...)",
        text));
  check_port_name("--link", rest);
  return {rest, std::nullopt};
}

}  // namespace roborun::live
