/// Visual-inertial or LiDAR odometry, computed elsewhere: where the vehicle is in a frame of the sensor's own.
/// Source of the fields: MAVLink common ODOMETRY (331) and its reset_counter; REP 105 (odom).
#pragma once

#include <array>
#include <cstdint>

#include "firmware_if/status.hpp"
#include "firmware_if/time.hpp"

namespace roborun::firmware_if {

/// Frame O: z up, origin and heading as the sensor chose them; both are W's for a vehicle that starts without satellite
/// navigation. It is continuous and drifts, until reset_counter says that it begins anew, anywhere.
struct OdometrySample {
  MonotonicTime stamp{};  ///< Instant of validity; the sample arrives later.
  std::uint32_t sequence{};
  std::uint8_t reset_counter{};                      ///< Another number: O is another frame than before.
  std::array<double, 3> p_OB_m{};                    ///< Of the body (FLU).
  std::array<double, 4> q_OB{1.0, 0.0, 0.0, 0.0};    ///< w, x, y, z; of length 1 within 1 %.
  std::array<double, 3> v_OB_mps{};                  ///< Expressed in O.
  // Square roots of the largest entries of both covariances, without the drift since the reset.
  double sigma_position_m{};
  double sigma_attitude_rad{};
  double sigma_speed_mps{};
};

/// Contract: read() neither blocks nor allocates; kOk hands out the oldest sample not yet read, kNotReady: none.
class Odometry {
 public:
  virtual ~Odometry() = default;
  [[nodiscard]] virtual Status read(OdometrySample& sample) noexcept = 0;
};

}  // namespace roborun::firmware_if
