/// What a LiDAR of today makes of the true distances: dark and oblique surfaces, edges, rain, and its own motion.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/geometry/vector.hpp"
#include "core/sensor_rig.hpp"
#include "platform/sitl/sensors/exposures.hpp"
#include "platform/sitl/sensors/surface_lattice.hpp"
#include "platform/sitl/world/world.hpp"

namespace roborun::sitl {

/// Numbers of a LiDAR model. "assumed": no source gives it.
struct LidarErrors {
  double noise_m;         ///< One sigma of the range.
  double angle_deg;       ///< One sigma of each angle of a ray.
  double tenth_range_m;   ///< Within it a surface that reflects 10 % is seen at a right angle.
  double divergence_rad;  ///< Whole angle of the beam.
  double pulse_m;         ///< Surfaces in one beam nearer to each other than this give one echo between them.
  double false_ratio;     ///< Points where nothing is, without rain.
  bool non_repeating;     ///< Each sweep looks between the rays of the one before.
  /// Part of the vehicle's motion within a sweep that the driver takes out. Assumed: by the gyroscope and the velocity.
  double deskew_ratio{0.95};
  double mount_deg{0.2};  ///< One sigma of each axis, as that of cameras. Assumed.
  double mount_m{0.003};
  TimingErrors timing{0.003, 0.001, 0.0005};  ///< Ethernet, PTP or PPS. Assumed.
};
/// Livox Mid-360 data sheet: 2 cm at 10 m, 0.15 degrees, 40 m at 10 %, false points less than 0.01 %. Divergence and pulse: as
/// other 905 nm ones with 5 ns, assumed.
inline constexpr LidarErrors kMid360{0.02, 0.15, 40.0, 0.003, 0.75, 0.0001, true};
/// Velodyne VLP-16 user manual: 3 cm; 3 mrad; Ouster OS0/OS1 data sheets: 1 to 3 cm, 0.01 degrees, 35 to 90 m at 10 %.
inline constexpr LidarErrors kRing{0.02, 0.01, 45.0, 0.003, 0.75, 0.00005, false};
[[nodiscard]] constexpr const LidarErrors& errors_of(LidarModel model) noexcept {
  return model == LidarModel::kMid360 ? kMid360 : kRing;
}

/// The way of a sensor through one sweep that ends at its stamp.
class SweepMotion {
 public:
  static constexpr std::size_t kKnots = 9;
  /// Where the sensor was; share 0: when the sweep began, 1: at its stamp. Straight between knots.
  [[nodiscard]] Pose at(double share) const noexcept;
  std::array<Pose, kKnots> X_WL{};  ///< Oldest first.
};

/// One echo of a ray.
struct Echo {
  bool there{};
  double range_m{};
};

/// Echoes are pure functions of (seed, sensor, sweep, ray, world, pose). No allocation.
///
/// A surface of reflectivity rho (a property of the place: 5 to 80 %) at angle a to the beam is seen while
/// rho cos(a) exp(-2 k r) / r^2 is not less than 10 % at tenth_range_m; a second ray within the beam finds the angle, and the
/// edges: one echo between both surfaces where they are nearer to each other than a pulse, else that of either. Rain of R mm/h
/// attenuates by 1.076 R^0.67 dB/km (ITU-R P.1814), and gives specks in R 1e-4 of the rays, 4 m away on average
/// (assumed).
class LidarEffects {
 public:
  LidarEffects(const LidarErrors& errors, double rain_mmph, std::uint64_t seed, std::uint32_t lidar);

  /// Of a ray of length 1 in the true sensor frame at that moment.
  [[nodiscard]] Echo measure(const World& world, const Pose& X_WL, const Vector3& ray_L, double range_m,
                             MonotonicTime when, core::CounterRng& rng) const noexcept;
  [[nodiscard]] Pose true_pose(const Pose& X_WL) const noexcept { return {X_WL.R_RT * R_LE_, X_WL * p_LE_}; }
  [[nodiscard]] const LidarErrors& errors() const noexcept { return errors_; }

 private:
  LidarErrors errors_;
  double extinction_pm_;
  double speck_ratio_;
  Matrix3 R_LE_;
  Vector3 p_LE_;
  SurfaceLattice lattice_;
};

}  // namespace roborun::sitl
