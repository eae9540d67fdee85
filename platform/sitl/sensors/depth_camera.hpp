/// A simulated depth camera: ray-cast, with noise that grows with depth, dropouts and latency; or with the errors of a product.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/geometry/vector.hpp"
#include "core/sensor_rig.hpp"
#include "firmware_if/depth_camera.hpp"
#include "platform/sitl/sensors/depth_effects.hpp"
#include "platform/sitl/sensors/exposures.hpp"
#include "platform/sitl/world/world.hpp"

namespace roborun::sitl {

/// What goes wrong in a depth camera.
struct DepthNoise {
  double noise_m{0.005};  ///< [0, 1]. One sigma at zero depth.
  double noise_per_m{
      0.0004};  ///< [0, 0.1]. Times depth squared: stereo with 12 cm base, 1/10 pixel matching error.
  double pixel_dropout_ratio{0.005};  ///< [0, 1]. Reads NaN.
  double frame_dropout_ratio{0.005};  ///< [0, 1]. The whole frame never arrives.
};

/// A square camera with its noise.
struct DepthCameraConfig : DepthNoise {
  /// Width and height. [8, 1280]. 96: 0.5 m at 25 m, finer than the 4 m pillars by far.
  std::uint16_t pixels{96};
  double range_m{25.0};            ///< [1, 200]. FACTS: camera range 25 m.
  double tan_half_fov_ratio{1.0};  ///< (0, 2]. 90 degrees.
  double rate_Hz{20.0};            ///< [1, 100].
  double latency_s{0.030};         ///< [0, 1]. Exposure, transfer and depth computation.
  CameraModel model{};             ///< All but kClean: no pixel has `noise_*` and `pixel_dropout_ratio`.
  double invalid_ratio{CameraSpec{}.invalid_ratio};

  [[nodiscard]] CameraSpec spec() const noexcept;
};

/// `clean`, by the spec's model: white noise of `DepthNoise` on the true depth. The others: depth_effects.hpp.
/// Frames are rendered only when somebody reads them; their noise depends on (seed, camera, sequence, pixel)
/// alone, so what is read never depends on what was read before.
class SimulatedDepthCamera final : public firmware_if::DepthCamera {
 public:
  SimulatedDepthCamera(const World& world, const CameraSpec& spec, const firmware_if::CameraMount& mount,
                       const DepthNoise& noise, std::uint64_t seed, std::uint32_t camera);
  SimulatedDepthCamera(const World& world, const DepthCameraConfig& config,
                       const firmware_if::CameraMount& mount, std::uint64_t seed, std::uint32_t camera)
      : SimulatedDepthCamera(world, config.spec(), mount, config, seed, camera) {}

  /// To be called at every minor frame with the true pose; takes an exposure when one is due.
  void expose(MonotonicTime now, const Pose& X_WB) noexcept { (void)exposures_.expose(now, X_WB); }
  [[nodiscard]] Status read(firmware_if::DepthFrame& frame) noexcept override;
  [[nodiscard]] const firmware_if::CameraMount& mount() const noexcept override { return exposures_.mount(); }

 private:
  void render(const Exposure& exposure) noexcept;
  void render_product(const Exposure& exposure, DepthEffects& effects) noexcept;

  const World& world_;
  CameraSpec spec_;
  DepthNoise noise_;
  std::uint64_t seed_;
  std::uint32_t camera_;
  std::vector<Vector3> ray_C_;  ///< Per pixel, x component 1.
  std::vector<float> image_;
  std::optional<DepthEffects> effects_;  ///< None: clean.
  Exposures exposures_;
};

/// Forward, left, back, right, up, down: together they see the whole sphere.
[[nodiscard]] std::array<firmware_if::CameraMount, 6> six_camera_mounts() noexcept;

}  // namespace roborun::sitl
