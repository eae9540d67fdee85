/// The vehicle files of platform/vehicle, as text in the program: CMake writes the source.
#pragma once

#include <array>

namespace roborun::vehicle {

struct ShippedVehicle {
  const char* name;
  const char* text;
};
extern const std::array<ShippedVehicle, 7> kShippedVehicles;

}  // namespace roborun::vehicle
