/// A simulated LiDAR: rings or a pattern of rays with noise, dropouts and latency; or with the errors of a product.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/vector.hpp"
#include "core/sensor_rig.hpp"
#include "firmware_if/lidar.hpp"
#include "platform/sitl/sensors/exposures.hpp"
#include "platform/sitl/sensors/lidar_effects.hpp"
#include "platform/sitl/world/world.hpp"

namespace roborun::sitl {

/// What goes wrong in a LiDAR.
struct LidarNoise {
  double noise_m{0.015};              ///< [0, 1]. One sigma, the same at all distances; of `clean`.
  double point_dropout_ratio{0.005};  ///< [0, 1]. Such a ray is not in the sweep; of `clean`.
  double sweep_dropout_ratio{0.005};  ///< [0, 1]. The whole sweep never arrives.
  double rain_mmph{0.0};              ///< [0, 100]. Of models but `clean`.
};

/// One direction of a pattern.
struct LidarRay {
  double azimuth_deg{}, elevation_deg{};
};
/// The rays of a file: lines "azimuth_deg elevation_deg", both within 360 and 90; "#" begins a comment. Throws
/// InputError with file and line; 65,536 rays at most.
[[nodiscard]] std::vector<LidarRay> load_lidar_pattern(const std::string& path);
/// What a pattern needs of a rig: its elevations, and as many rings and columns as say how dense it is.
[[nodiscard]] LidarSpec spec_of(const std::vector<LidarRay>& pattern, const LidarSpec& rest);

/// Sweeps are cast only when somebody reads them; their noise depends on (seed, sensor, sequence, ray) alone, so what
/// is read never depends on what was read before. A ray that meets nothing says so (firmware_if/lidar.hpp).
/// `clean`, by the spec's model: all rays at one instant. The others (lidar_effects.hpp): a sweep takes the whole turn before its
/// stamp, ring by ring at the same time or, with a pattern, in its order; what the driver leaves of the motion is in the points;
/// rays without an echo are not in the sweep: a product does not tell sky from a surface that is too dark.
class SimulatedLidar final : public firmware_if::Lidar {
 public:
  /// An empty pattern: the rings of the spec.
  SimulatedLidar(const World& world, const LidarSpec& spec, const std::vector<LidarRay>& pattern,
                 const LidarNoise& noise, std::uint64_t seed, std::uint32_t lidar);

  /// To be called at every minor frame with the true pose; takes a sweep when one is due.
  void expose(MonotonicTime now, const Pose& X_WB) noexcept;
  [[nodiscard]] Status read(firmware_if::LidarSweep& sweep) noexcept override;
  [[nodiscard]] const firmware_if::CameraMount& mount() const noexcept override { return exposures_.mount(); }
  [[nodiscard]] std::size_t rays() const noexcept { return ray_L_.size(); }

 private:
  void cast(const Exposure& exposure) noexcept;
  void remember(MonotonicTime now, const Pose& X_WB) noexcept;
  void cast_product(const Exposure& exposure, const LidarEffects& effects) noexcept;

  const World& world_;
  LidarSpec spec_;
  LidarNoise noise_;
  std::uint64_t seed_;
  std::uint32_t lidar_;
  std::vector<Vector3> ray_L_;  ///< Of length 1.
  std::vector<std::array<float, 3>> point_L_m_;
  std::size_t points_{0};
  std::optional<LidarEffects> effects_;  ///< None: clean.
  std::size_t columns_{1};               ///< Instants of a sweep.
  double ring_step_rad_{0.0};
  SweepMotion recent_{};  ///< Of the vehicle, ready to be taken when a sweep ends.
  MonotonicTime next_knot_{};
  std::vector<SweepMotion> motion_;  ///< By sequence; of the true sensor.
  Exposures exposures_;
};

}  // namespace roborun::sitl
