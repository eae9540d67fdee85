/// Barometric altimeter.
#pragma once

#include <cstdint>

#include "firmware_if/status.hpp"
#include "firmware_if/time.hpp"

namespace roborun::firmware_if {

struct BarometerSample {
  MonotonicTime stamp{};
  std::uint32_t sequence{};
  double altitude_m{};  ///< Above the world origin, from pressure; drifts.
};

/// Contract: read() neither blocks nor allocates; kOk hands out the oldest sample not yet read, kNotReady:
/// none.
class Barometer {
 public:
  virtual ~Barometer() = default;
  [[nodiscard]] virtual Status read(BarometerSample& sample) noexcept = 0;
};

}  // namespace roborun::firmware_if
