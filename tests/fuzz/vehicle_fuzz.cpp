/// Vehicle files, and TOML in general. Oracle: a vehicle that is accepted has a finite mass and thrust to lift it.
#include <cmath>

#include "platform/vehicle/vehicle_file.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace roborun;
  const std::string text = fuzz::Choices(data, size).text();
  fuzz::refuse_or([&] {
    const vehicle::Vehicle v = vehicle::vehicle_from_toml("memory.toml", text);
    fuzz::require(std::isfinite(v.model.mass_kg) && v.model.mass_kg > 0.0, "mass is positive");
    fuzz::require(v.digest.size() == 16, "the digest has 16 digits");
  });
  return 0;
}
