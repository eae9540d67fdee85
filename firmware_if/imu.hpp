/// Inertial measurement unit.
#pragma once

#include <array>
#include <cstdint>

#include "firmware_if/status.hpp"
#include "firmware_if/time.hpp"

namespace roborun::firmware_if {

struct ImuSample {
  MonotonicTime stamp{};
  std::uint32_t sequence{};
  std::array<double, 3> angular_rate_B_radps{};   ///< Body frame FLU.
  std::array<double, 3> specific_force_B_mps2{};  ///< Acceleration minus gravity; (0, 0, +9.81) at rest.
};

/// Contract: read() neither blocks nor allocates; kOk hands out the oldest sample not yet read, kNotReady:
/// none.
class Imu {
 public:
  virtual ~Imu() = default;
  [[nodiscard]] virtual Status read(ImuSample& sample) noexcept = 0;
};

}  // namespace roborun::firmware_if
