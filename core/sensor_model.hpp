/// Which errors a sensor makes: models by name. `clean` is the ideal one with the noise of the settings; the others
/// are products, or a kind of them.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "core/depth_error.hpp"

namespace roborun {

enum class CameraModel : std::uint8_t { kClean, kD435, kD455, kOakD, kTof };
enum class LidarModel : std::uint8_t { kClean, kMid360, kRing };
/// kNone: it has no receiver.
enum class GnssModel : std::uint8_t { kClean, kM9n, kNone };
enum class ImuModel : std::uint8_t { kClean, kMems };
enum class OdometryModel : std::uint8_t { kNone, kVio };

/// In the order of the enumerators.
inline constexpr std::array<const char*, 5> kCameraModels{"clean", "d435", "d455", "oak-d", "tof"};
inline constexpr std::array<const char*, 3> kLidarModels{"clean", "mid360", "ring"};
inline constexpr std::array<const char*, 3> kGnssModels{"clean", "m9n", "none"};
inline constexpr std::array<const char*, 2> kImuModels{"clean", "mems"};
inline constexpr std::array<const char*, 2> kOdometryModels{"none", "vio"};

[[nodiscard]] constexpr const auto& names_of(CameraModel) noexcept { return kCameraModels; }
[[nodiscard]] constexpr const auto& names_of(LidarModel) noexcept { return kLidarModels; }
[[nodiscard]] constexpr const auto& names_of(GnssModel) noexcept { return kGnssModels; }
[[nodiscard]] constexpr const auto& names_of(ImuModel) noexcept { return kImuModels; }
[[nodiscard]] constexpr const auto& names_of(OdometryModel) noexcept { return kOdometryModels; }

template <class Model>
[[nodiscard]] constexpr const char* to_string(Model model) noexcept {
  return names_of(model)[static_cast<std::size_t>(model)];
}
/// None for a name that is no model.
template <class Model>
[[nodiscard]] constexpr std::optional<Model> model_of(std::string_view name) noexcept {
  for (std::size_t i = 0; i < names_of(Model{}).size(); ++i)
    if (name == names_of(Model{})[i]) return static_cast<Model>(i);
  return std::nullopt;
}

/// What bounds the depth of a stereo camera, in pixels of its own images whatever the size of those it hands out: depth is
/// focal_px baseline_m / disparity, so its error is depth^2 times that of the disparity over focal_px baseline_m.
/// Sources: Intel RealSense D400 series data sheet (337029) and "Tuning depth cameras for best performance" (848 x 480,
/// 87 degrees: 447 pixels; 126 disparities of 1/32 pixel; RMS of the sub-pixel error 0.05 to 0.1 on good texture; the
/// data sheet's 2 % at 2 m and at 4 m would be 0.2); Luxonis "Configuring stereo depth" (RVC2 at 640 x 400: 441 pixels, 95
/// disparities, 1/8 pixel).
struct StereoOptics {
  double baseline_m, focal_px;
  double subpixel_px;  ///< One sigma of the disparity.
  double step_px;      ///< Disparities are multiples of it.
  double search_px;    ///< The largest disparity: what is nearer has no depth.

  /// Variance of depth over depth^4, steps included (a step of s has s^2 / 12).
  [[nodiscard]] constexpr double variance_per_m4() const noexcept {
    const double disparity2_px2 = subpixel_px * subpixel_px + step_px * step_px / 12.0;
    return disparity2_px2 / (focal_px * focal_px * baseline_m * baseline_m);
  }
};
inline constexpr StereoOptics kD435{0.050, 447.0, 0.10, 1.0 / 32.0, 126.0};
inline constexpr StereoOptics kD455{0.095, 447.0, 0.10, 1.0 / 32.0, 126.0};
inline constexpr StereoOptics kOakD{0.075, 441.0, 0.10, 1.0 / 8.0, 95.0};
/// Null: no stereo camera with errors.
[[nodiscard]] constexpr const StereoOptics* stereo_of(CameraModel model) noexcept {
  switch (model) {
    case CameraModel::kD435:
      return &kD435;
    case CameraModel::kD455:
      return &kD455;
    case CameraModel::kOakD:
      return &kOakD;
    default:
      return nullptr;
  }
}
/// What is to be expected of a camera of this model; of `clean` that of the defaults of the settings. Of the mount: a good
/// calibration, and what the vehicle turns in the error of a stamp.
[[nodiscard]] inline DepthError depth_error(CameraModel model) noexcept {
  constexpr double kMount_m = 0.003, kMount_rad = 0.0035;
  if (const StereoOptics* optics = stereo_of(model))
    return {0.0, std::sqrt(optics->variance_per_m4()), kMount_m, kMount_rad, true};
  return model == CameraModel::kTof ? DepthError{0.002, 0.0012, kMount_m, kMount_rad, true} : DepthError{};
}

}  // namespace roborun
