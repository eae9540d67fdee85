/// What a product makes of the true depth: stereo and time-of-flight cameras with their errors.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/vector.hpp"
#include "core/sensor_rig.hpp"
#include "platform/sitl/sensors/exposures.hpp"
#include "platform/sitl/sensors/surface_lattice.hpp"

namespace roborun::sitl {

/// Numbers of a camera model besides its optics (core/sensor_model.hpp). "assumed": no source gives it.
struct DepthModel {
  /// Stereo: side of the matching window in pixels of its own images. RVC2's census windows are 5 x 5, 7 x 7 and 7 x 9
  /// (Luxonis, StereoDepth node); Intel gives none: as large, assumed.
  double window_px{7.0};
  /// Stereo: part of the half window by which what is in front grows over what is behind (foreground fattening: Scharstein
  /// and Szeliski, "A taxonomy and evaluation of dense two-frame stereo correspondence algorithms", 2002). Assumed.
  double fatten_ratio{0.5};
  /// Pixels at a step of depth that lie between both sides. Assumed for stereo (sub-pixel fit and smoothing over the step);
  /// time of flight: the pixel's own area holds both ("flying pixels": Toelgyessy et al., Sensors 21:413, 2021).
  double flying_ratio{0.25};
  /// Part of the variance of the noise that stays for `steady_s`: noise of matching hangs on the texture, not on the frame.
  /// Assumed.
  double steady_ratio{0.5};
  double steady_s{0.5};
  /// Time of flight: one sigma at no distance, and what is added times depth squared: 17 mm at 3.5 m (Azure Kinect DK, hardware
  /// specification; measured by Toelgyessy et al.).
  double noise_m{0.002}, noise_per_m{0.0012};
  /// Time of flight: depth up to which a surface that reflects 10 % returns enough light (Azure Kinect DK, NFOV unbinned: 3.86 m
  /// at 15 to 95 %). Stereo: none.
  double tenth_range_m{3.5};
  double glare_deg{8.0};           ///< No value nearer to the sun than this. Assumed.
  double sun_elevation_deg{35.0};  ///< Its azimuth is drawn from the seed.
  double patch_ratio{0.2};  ///< Size of patches without values over their depth: 6 to 11 degrees. Assumed.
  double mount_deg{
      0.2};  ///< One sigma of each axis of the error of the mount's rotation: a good calibration. Assumed.
  double mount_m{0.003};                     ///< The same of its place.
  TimingErrors timing{0.005, 0.003, 0.001};  ///< Camera on USB without a trigger. Assumed.
};

/// Turns true images into measured ones. An image is a pure function of (seed, camera, sequence, time, pose): not of which were
/// made before, nor of the thread. Allocates when it is made, never later.
///
/// Stereo, in this order: disparity of the true depth; foreground fattening; no value where the right camera does not see the
/// place (beside what is in front, and at the left border), on sky, where the disparity is less than one pixel or more than can
/// be searched, in the glare of the sun, and in patches (two thirds fixed to the surface: texture; one third to surface and
/// viewpoint: reflection); flying pixels; noise of the disparity, equal within a window, half of it steady; steps. Surfaces
/// farther than `range_m` have values as long as their disparity is a pixel: "nothing within range".
///
/// Time of flight: noise that grows with depth squared, mixed pixels at each step, no value on sky and where the surface reflects
/// too little for its distance; patches as above. Multiple paths and ambiguity are not modelled.
class DepthEffects {
 public:
  /// Precondition: spec.model is not kClean.
  DepthEffects(const CameraSpec& spec, std::uint64_t seed, std::uint32_t camera,
               const DepthModel& model = {});

  /// How far the true depth must be known, metres along the optical axis.
  [[nodiscard]] double reach_m() const noexcept { return reach_m_; }
  /// Where the camera truly is, of where its mount says.
  [[nodiscard]] Pose true_pose(const Pose& X_WC) const noexcept { return {X_WC.R_RT * R_CE_, X_WC * p_CE_}; }
  /// Replaces true depths (+infinity: nothing within reach) by measured ones. `ray_C` has x component 1.
  void apply(const Exposure& exposure, const Pose& X_WC, std::span<const Vector3> ray_C,
             std::span<float> depth_m) noexcept;

 private:
  void fatten(std::size_t first, std::size_t stride, std::size_t count, double radius,
              std::uint64_t key) noexcept;
  void mark_occluded(std::size_t row) noexcept;
  void draw_steady_noise(MonotonicTime now) noexcept;
  [[nodiscard]] bool is_hole(const Vector3& p_T, double depth_m, std::uint64_t bits,
                             std::uint64_t view) const noexcept;
  [[nodiscard]] float stereo(std::size_t u, std::size_t v, std::uint64_t bits) const noexcept;
  [[nodiscard]] float time_of_flight(std::size_t u, std::size_t v, double reflectivity,
                                     std::uint64_t bits) const noexcept;
  /// Least and greatest disparity beside a pixel at a step of depth; equal: there is none.
  struct Step {
    double low_px, high_px;
  };
  [[nodiscard]] Step step_at(std::size_t u, std::size_t v) const noexcept;

  DepthModel model_;
  StereoOptics optics_;  ///< Time of flight: only what turns depth into its inverse.
  bool stereo_;
  std::size_t width_, height_;
  double reach_m_;
  double native_px_;  ///< Pixels of the camera's own images in one of these.
  double radius_u_, radius_v_;
  std::size_t block_;  ///< Pixels a side with the same steady noise.
  double texture_ratio_, reflection_ratio_;
  double glare_cosine_;
  Vector3 sun_W_;
  Matrix3 R_CE_;
  Vector3 p_CE_;
  SurfaceLattice lattice_;
  std::uint64_t seed_;
  std::uint64_t stream_;
  std::vector<float> disparity_px_;  ///< 0: nothing.
  std::vector<float> line_px_, right_px_;
  std::vector<float> steady_;  ///< Standard normal, nearly, by block.
  std::vector<std::uint8_t> occluded_;
};

}  // namespace roborun::sitl
