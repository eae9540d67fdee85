#include "platform/app/earth_argument.hpp"

#include <fmt/format.h>

#include <vector>

#include "platform/input/arguments.hpp"
#include "platform/input/input_error.hpp"

namespace roborun::app {

std::optional<sensor_port::EarthPlace> origin_of(const std::string& text) {
  if (text.empty()) return std::nullopt;
  const std::vector<std::string> parts = input::split(text);
  std::vector<double> values;
  for (const std::string& part : parts)
    if (const auto value = input::number(part)) values.push_back(*value);
  if (parts.size() == 3 && values.size() == 3) {
    const sensor_port::EarthPlace place{values[0], values[1], values[2]};
    if (sensor_port::is_on_earth(place)) return place;
  }
  throw InputError(fmt::format(
      "--origin: '{}' is no place: must be LATITUDE,LONGITUDE,HEIGHT in degrees and metres", text));
}

}  // namespace roborun::app
