/// Satellite navigation with carrier-phase correction (RTK) and a two-antenna heading.
#pragma once

#include <array>
#include <cstdint>

#include "firmware_if/status.hpp"
#include "firmware_if/time.hpp"

namespace roborun::firmware_if {

struct GnssFix {
  MonotonicTime stamp{};  ///< Instant of validity; the fix arrives later.
  std::uint32_t sequence{};
  std::array<double, 3> p_WB_m{};    ///< World frame ENU, local origin.
  std::array<double, 3> v_WB_mps{};  ///< World frame ENU.
  double heading_rad{};         ///< Yaw of the body x axis from East, counter-clockwise; NaN: not available.
  double sigma_horizontal_m{};  ///< One standard deviation, as the receiver states it.
  double sigma_vertical_m{};
  double sigma_speed_mps{};
  double sigma_heading_rad{};
};

/// Contract: read() neither blocks nor allocates; kOk hands out the oldest fix not yet read, kNotReady: none.
class Gnss {
 public:
  virtual ~Gnss() = default;
  [[nodiscard]] virtual Status read(GnssFix& fix) noexcept = 0;
};

}  // namespace roborun::firmware_if
