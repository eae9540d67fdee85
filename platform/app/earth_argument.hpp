/// --origin, as `plant` and `run` take it.
#pragma once

#include <optional>
#include <string>

#include "platform/sensor_port/port_navigation.hpp"

namespace roborun::app {

/// LATITUDE,LONGITUDE,HEIGHT; none for an empty text. Throws InputError "--origin: ...".
[[nodiscard]] std::optional<sensor_port::EarthPlace> origin_of(const std::string& text);

}  // namespace roborun::app
