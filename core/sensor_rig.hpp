/// The sensors that look at space: what each of them sees, and from where on the vehicle. One table per kind of
/// sensor names, bounds and explains every number: it drives the reader of files, the check, and the reference.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/geometry/math.hpp"
#include "core/geometry/vector.hpp"
#include "core/memory/static_vector.hpp"
#include "core/range.hpp"
#include "core/sensor_model.hpp"
#include "firmware_if/depth_camera.hpp"

namespace roborun {

/// Where a sensor sits on the body (FLU): its place, then its axes turned about z, y and x of the body, in this
/// order (REP 103: a positive pitch looks down). Multiples of 90 degrees give exact zeros and ones.
struct SensorMount {
  double x_m{}, y_m{}, z_m{};
  double yaw_deg{}, pitch_deg{}, roll_deg{};
};
[[nodiscard]] firmware_if::CameraMount camera_mount(const SensorMount& mount) noexcept;

inline constexpr double kMostInvalid = 0.6;

/// A depth camera. Defaults: one of the six of the paper's vehicle (FACTS: range 25 m).
struct CameraSpec {
  std::uint16_t width{96};  ///< Pixels.
  std::uint16_t height{96};
  double tan_half_width{1.0};  ///< Of the horizontal field of view; files give the whole angle in degrees.
  double tan_half_height{1.0};
  double range_min_m{0.0};
  double range_m{25.0};
  double rate_Hz{20.0};
  double latency_s{0.030};  ///< Exposure, transfer and depth computation.
  SensorMount mount{};
  CameraModel model{};
  /// [0, kMostInvalid]. Share of pixels without a value on surfaces that it could measure, in patches; not of `clean`. Assumed: real
  /// ones have 5 to 30 % by texture, sun and reflection.
  double invalid_ratio{0.1};
};

/// A LiDAR that turns, or one with a pattern of its own. Defaults: 16 rings of 2 degrees.
struct LidarSpec {
  std::uint16_t rings{16};
  std::uint16_t columns{900};  ///< Per turn.
  double lowest_deg{-15.0};    ///< Elevation of the lowest ring.
  double highest_deg{15.0};
  double range_min_m{0.3};
  double range_m{70.0};
  double rate_Hz{10.0};
  double latency_s{0.020};
  SensorMount mount{};
  LidarModel model{};
};

inline constexpr std::size_t kMostCameras = 8;
inline constexpr std::size_t kMostLidars = 2;

struct SensorRig {
  core::StaticVector<CameraSpec, kMostCameras> cameras{};
  core::StaticVector<LidarSpec, kMostLidars> lidars{};
  ImuModel imu{};
  GnssModel gnss{};
  OdometryModel odometry{};
};

/// One number of a sensor in a file.
template <class Spec>
struct SensorKey {
  const char* key;  ///< With its unit.
  double (*get)(const Spec&);
  void (*set)(Spec&, double);  ///< Of a value within the bounds.
  double low, high;            ///< Both allowed.
  const char* text;
};

namespace rig_detail {

inline double tan_of_half_deg(double whole_deg) noexcept {
  const double half = 0.5 * whole_deg * core::kDegree;
  // Half of a right angle is exact: six such cameras touch each other.
  return whole_deg == 90.0 ? 1.0 : core::sin(half) / core::cos(half);
}
inline double whole_deg_of(double tan_half) noexcept {
  return tan_half == 1.0 ? 90.0 : 2.0 * core::atan2(tan_half, 1.0) / core::kDegree;
}

/// A key for a member that stands in the file as it is.
template <class Spec, auto kMember>
constexpr SensorKey<Spec> plain(const char* key, double low, double high, const char* text) {
  using Value = std::remove_cvref_t<decltype(Spec{}.*kMember)>;
  return {key,
          [](const Spec& s) { return static_cast<double>(s.*kMember); },
          [](Spec& s, double value) { s.*kMember = static_cast<Value>(value); },
          low,
          high,
          text};
}
template <class Spec, auto kMember>
constexpr SensorKey<Spec> of_mount(const char* key, double bound, const char* text) {
  return {key,
          [](const Spec& s) { return s.mount.*kMember; },
          [](Spec& s, double value) { s.mount.*kMember = value; },
          -bound,
          bound,
          text};
}
template <class Spec, auto kMember>
constexpr SensorKey<Spec> angle(const char* key, const char* text) {
  return {key,
          [](const Spec& s) { return whole_deg_of(s.*kMember); },
          [](Spec& s, double value) { s.*kMember = tan_of_half_deg(value); },
          5.0,
          126.0,
          text};
}

}  // namespace rig_detail

// clang-format off
inline constexpr std::array<SensorKey<CameraSpec>, 14> kCameraKeys = [] {
  using C = CameraSpec;
  using M = SensorMount;
  namespace d = rig_detail;
  return std::array<SensorKey<C>, 14>{{
    d::plain<C, &C::width>("width", 8, 1280, "pixels of a row, a whole number"),
    d::plain<C, &C::height>("height", 8, 1280, "pixels of a column, a whole number"),
    d::angle<C, &C::tan_half_width>("horizontal_fov_deg", "from the left to the right edge of the image"),
    d::angle<C, &C::tan_half_height>("vertical_fov_deg", "from the upper to the lower edge of the image"),
    d::plain<C, &C::range_min_m>("range_min_m", 0.0, 20.0, "depth up to which the camera measures nothing"),
    d::plain<C, &C::range_m>("range_m", 1.0, 200.0, "depth beyond which the camera sees nothing; more than range_min_m"),
    d::plain<C, &C::rate_Hz>("rate_Hz", 1.0, 100.0, "images per second"),
    d::plain<C, &C::latency_s>("latency_s", 0.0, 0.4, "from exposure to the depth image"),
    d::of_mount<C, &M::x_m>("x_m", 5.0, "of the camera from the middle of the vehicle, forward"),
    d::of_mount<C, &M::y_m>("y_m", 5.0, "the same to the left"),
    d::of_mount<C, &M::z_m>("z_m", 5.0, "the same upwards"),
    d::of_mount<C, &M::yaw_deg>("yaw_deg", 360.0, "turned to the left"),
    d::of_mount<C, &M::pitch_deg>("pitch_deg", 90.0, "turned downwards"),
    d::of_mount<C, &M::roll_deg>("roll_deg", 360.0, "turned about the optical axis, to the right"),
  }};
}();
inline constexpr std::array<SensorKey<LidarSpec>, 14> kLidarKeys = [] {
  using L = LidarSpec;
  using M = SensorMount;
  namespace d = rig_detail;
  return std::array<SensorKey<L>, 14>{{
    d::plain<L, &L::rings>("rings", 1, 256, "a whole number"),
    d::plain<L, &L::columns>("columns", 16, 4096, "directions of each ring in one turn, a whole number"),
    d::plain<L, &L::lowest_deg>("lowest_deg", -90.0, 90.0, "elevation of the lowest ring"),
    d::plain<L, &L::highest_deg>("highest_deg", -90.0, 90.0, "elevation of the highest ring; not less than lowest_deg"),
    d::plain<L, &L::range_min_m>("range_min_m", 0.0, 20.0, "distance up to which it measures nothing"),
    d::plain<L, &L::range_m>("range_m", 1.0, 200.0, "distance beyond which it sees nothing; more than range_min_m"),
    d::plain<L, &L::rate_Hz>("rate_Hz", 1.0, 100.0, "turns per second"),
    d::plain<L, &L::latency_s>("latency_s", 0.0, 0.4, "from the middle of a turn to its points"),
    d::of_mount<L, &M::x_m>("x_m", 5.0, "of the sensor from the middle of the vehicle, forward"),
    d::of_mount<L, &M::y_m>("y_m", 5.0, "the same to the left"),
    d::of_mount<L, &M::z_m>("z_m", 5.0, "the same upwards"),
    d::of_mount<L, &M::yaw_deg>("yaw_deg", 360.0, "turned to the left"),
    d::of_mount<L, &M::pitch_deg>("pitch_deg", 90.0, "turned downwards"),
    d::of_mount<L, &M::roll_deg>("roll_deg", 360.0, "turned about its forward axis, to the right"),
  }};
}();
// clang-format on

[[nodiscard]] constexpr std::span<const SensorKey<CameraSpec>> keys_of(const CameraSpec&) {
  return kCameraKeys;
}
[[nodiscard]] constexpr std::span<const SensorKey<LidarSpec>> keys_of(const LidarSpec&) { return kLidarKeys; }

/// Sets one number of a sensor; false, and nothing set, if it is not within its bounds (NaN never is).
template <class Spec>
[[nodiscard]] bool assign(const SensorKey<Spec>& key, Spec& spec, double value) noexcept {
  if (!core::within(value, key.low, key.high)) return false;
  key.set(spec, value);
  return true;
}

/// What is wrong with a rig.
struct RigFault {
  const char* sensor;  ///< "camera" or "lidar".
  std::size_t index;
  const char* key;
  double low, high;
  const char* text;
};
/// The first number that is not within its bounds, or none. A rig has one sensor at least.
[[nodiscard]] std::optional<RigFault> first_fault(const SensorRig& rig) noexcept;

/// Forward, left, back, right, up, down, 90 degrees each: together they see the whole sphere.
[[nodiscard]] SensorRig six_cameras(std::uint16_t pixels, double range_m) noexcept;

/// Whether a direction in the body frame is within the view of a sensor; where it sits does not count.
[[nodiscard]] bool sees(const CameraSpec& camera, const Vector3& direction_B) noexcept;
[[nodiscard]] bool sees(const LidarSpec& lidar, const Vector3& direction_B) noexcept;
[[nodiscard]] bool sees(const SensorRig& rig, const Vector3& direction_B) noexcept;

/// Whether the cameras leave no gap between them: just outside each edge of each image another camera sees. Gaps
/// that meet an edge in less than 0.4 degrees may be missed.
[[nodiscard]] bool cameras_see_all_around(const SensorRig& rig) noexcept;
/// Whether every horizontal direction is seen, in steps of half a degree.
[[nodiscard]] bool sees_horizon(const SensorRig& rig) noexcept;
/// Tangent of the largest elevation up to which, upwards and downwards, everything is seen in one turn of the
/// vehicle on the spot; in steps of a degree, at least 0.01.
[[nodiscard]] double level_view_ratio(const SensorRig& rig) noexcept;
/// Whether anything is seen within 45 degrees of forward.
[[nodiscard]] bool looks_forward(const SensorRig& rig) noexcept;
/// The largest angle between a direction and the nearest one that is seen, from 4,000 samples: true to 2 degrees.
/// 180 degrees if nothing is seen. 16 million products in the worst case: for start-up.
[[nodiscard]] double widest_blind_angle_rad(const SensorRig& rig) noexcept;

/// Half of the cube around the vehicle's middle in which its sensors, all of them, may measure nothing because it is too
/// near; 0: they measure from 0 m on.
[[nodiscard]] double too_near_m(const SensorRig& rig) noexcept;
/// The shortest range of the cameras, of the LiDARs where there is no camera; 0 without sensors.
[[nodiscard]] double shortest_range_m(const SensorRig& rig) noexcept;
/// Pixels a side of the images that its cloud becomes, 90 degrees each: each pixel is met by a ray.
[[nodiscard]] std::uint16_t cloud_pixels(const LidarSpec& lidar) noexcept;

}  // namespace roborun
