#include "core/sensor_rig.hpp"

#include <algorithm>

namespace roborun {
namespace {

using core::kDegree;

/// Exact at multiples of 90 degrees, and without negative zeros.
double sin_deg(double deg) noexcept {
  const double quarter = deg / 90.0;
  if (quarter == std::floor(quarter)) {
    constexpr std::array<double, 4> kSine{0.0, 1.0, 0.0, -1.0};
    return kSine[static_cast<std::size_t>(static_cast<int>(quarter) & 3)];
  }
  return core::sin(deg * kDegree);
}
double cos_deg(double deg) noexcept { return sin_deg(deg + 90.0); }

Vector3 in_sensor(const SensorMount& mount, const Vector3& direction_B) noexcept {
  using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const firmware_if::CameraMount m = camera_mount(mount);
  const Matrix3 R_BC = Eigen::Map<const RowMajor3>(m.R_BC.data());
  return R_BC.transpose() * direction_B;
}

/// The i-th of n directions that are spread evenly (Fibonacci lattice).
Vector3 spread(std::size_t i, std::size_t n) noexcept {
  constexpr double kGoldenAngle = 2.39996322972865332;
  const double z = 1.0 - (2.0 * static_cast<double>(i) + 1.0) / static_cast<double>(n);
  const double r = std::sqrt(1.0 - z * z);
  const double turn = kGoldenAngle * static_cast<double>(i);
  return {r * core::cos(turn), r * core::sin(turn), z};
}

template <class Spec>
std::optional<RigFault> fault_of(const char* sensor, std::size_t index, const Spec& spec) noexcept {
  for (const SensorKey<Spec>& key : keys_of(spec)) {
    if (!core::within(key.get(spec), key.low, key.high))
      return RigFault{sensor, index, key.key, key.low, key.high, key.text};
  }
  if (!(spec.range_min_m < spec.range_m))
    return RigFault{sensor, index, "range_min_m", 0.0, spec.range_m, "must be less than range_m"};
  return std::nullopt;
}

}  // namespace

firmware_if::CameraMount camera_mount(const SensorMount& mount) noexcept {
  const double sy = sin_deg(mount.yaw_deg), cy = cos_deg(mount.yaw_deg);
  const double sp = sin_deg(mount.pitch_deg), cp = cos_deg(mount.pitch_deg);
  const double sr = sin_deg(mount.roll_deg), cr = cos_deg(mount.roll_deg);
  // Rz(yaw) Ry(pitch) Rx(roll); adding 0 makes a negative zero a zero.
  firmware_if::CameraMount result;
  result.R_BC = {cy * cp,
                 cy * sp * sr - sy * cr,
                 cy * sp * cr + sy * sr,
                 sy * cp,
                 sy * sp * sr + cy * cr,
                 sy * sp * cr - cy * sr,
                 -sp,
                 cp * sr,
                 cp * cr};
  for (double& x : result.R_BC) x += 0.0;
  result.p_BC_m = {mount.x_m, mount.y_m, mount.z_m};
  return result;
}

std::optional<RigFault> first_fault(const SensorRig& rig) noexcept {
  for (std::size_t i = 0; i < rig.cameras.size(); ++i)
    if (const auto fault = fault_of("camera", i, rig.cameras[i])) return fault;
  for (std::size_t i = 0; i < rig.lidars.size(); ++i) {
    const LidarSpec& lidar = rig.lidars[i];
    if (const auto fault = fault_of("lidar", i, lidar)) return fault;
    if (!(lidar.lowest_deg <= lidar.highest_deg))
      return RigFault{
          "lidar", i, "lowest_deg", -90.0, lidar.highest_deg, "must not be more than highest_deg"};
  }
  if (rig.cameras.empty() && rig.lidars.empty())
    return RigFault{"camera", 0, "camera", 1.0, 8.0, "a rig has one sensor at least"};
  return std::nullopt;
}

SensorRig six_cameras(std::uint16_t pixels, double range_m) noexcept {
  SensorRig rig;
  CameraSpec camera;
  camera.width = camera.height = pixels;
  camera.range_m = range_m;
  for (const double yaw_deg : {0.0, 90.0, 180.0, 270.0}) {
    camera.mount.yaw_deg = yaw_deg;
    (void)rig.cameras.push_back(camera);
  }
  camera.mount.yaw_deg = 0.0;
  for (const double pitch_deg : {-90.0, 90.0}) {
    camera.mount.pitch_deg = pitch_deg;
    (void)rig.cameras.push_back(camera);
  }
  return rig;
}

bool sees(const CameraSpec& camera, const Vector3& direction_B) noexcept {
  const Vector3 d_C = in_sensor(camera.mount, direction_B);
  return d_C.x() > 0.0 && std::fabs(d_C.y()) <= camera.tan_half_width * d_C.x() &&
         std::fabs(d_C.z()) <= camera.tan_half_height * d_C.x();
}

bool sees(const LidarSpec& lidar, const Vector3& direction_B) noexcept {
  const Vector3 d_L = in_sensor(lidar.mount, direction_B);
  const double elevation_deg = core::atan2(d_L.z(), core::hypot2(d_L.x(), d_L.y())) / kDegree;
  return elevation_deg >= lidar.lowest_deg && elevation_deg <= lidar.highest_deg;
}

bool sees(const SensorRig& rig, const Vector3& direction_B) noexcept {
  const auto sees_it = [&direction_B](const auto& sensor) { return sees(sensor, direction_B); };
  return std::any_of(rig.cameras.begin(), rig.cameras.end(), sees_it) ||
         std::any_of(rig.lidars.begin(), rig.lidars.end(), sees_it);
}

bool cameras_see_all_around(const SensorRig& rig) noexcept {
  // The border of what all of them see together is part of the borders of their images. Where there is none, it is
  // the whole sphere.
  constexpr int kSteps = 256;
  constexpr double kOutside = 1e-6;
  using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  for (const CameraSpec& camera : rig.cameras) {
    const firmware_if::CameraMount mount = camera_mount(camera.mount);
    const Matrix3 R_BC = Eigen::Map<const RowMajor3>(mount.R_BC.data());
    for (int i = 0; i < 4 * kSteps; ++i) {
      const int step = i / 4;
      const double along = 2.0 * (step + 0.5) / kSteps - 1.0;
      const double side = (i & 1) != 0 ? 1.0 + kOutside : -1.0 - kOutside;
      const double y = (i & 2) != 0 ? along : side;
      const double z = (i & 2) != 0 ? side : along;
      const Vector3 d_B = R_BC * Vector3(1.0, y * camera.tan_half_width, z * camera.tan_half_height);
      if (std::none_of(rig.cameras.begin(), rig.cameras.end(),
                       [&](const CameraSpec& c) { return sees(c, d_B); }))
        return false;
    }
  }
  return !rig.cameras.empty();
}

bool sees_horizon(const SensorRig& rig) noexcept {
  constexpr int kSteps = 720;
  for (int i = 0; i < kSteps; ++i) {
    const double turn = 2.0 * core::kPi * (i + 0.5) / kSteps;
    if (!sees(rig, Vector3(core::cos(turn), core::sin(turn), 0.0))) return false;
  }
  return true;
}

double level_view_ratio(const SensorRig& rig) noexcept {
  constexpr int kSteps = 180;
  const auto seen_in_a_turn = [&rig](double elevation_deg) {
    const double level = cos_deg(elevation_deg), up = sin_deg(elevation_deg);
    for (int i = 0; i < kSteps; ++i) {
      const double turn = 2.0 * core::kPi * i / kSteps;
      if (sees(rig, Vector3(level * core::cos(turn), level * core::sin(turn), up))) return true;
    }
    return false;
  };
  double seen_deg = 0.0;
  while (seen_deg < 89.0 && seen_in_a_turn(seen_deg + 1.0) && seen_in_a_turn(-seen_deg - 1.0))
    seen_deg += 1.0;
  return std::max(sin_deg(seen_deg) / cos_deg(seen_deg), 0.01);
}

bool looks_forward(const SensorRig& rig) noexcept {
  constexpr std::size_t kSamples = 4000;
  constexpr double kAhead = 0.70710678118654752;  // cosine of 45 degrees
  for (std::size_t i = 0; i < kSamples; ++i) {
    const Vector3 d_B = spread(i, kSamples);
    if (d_B.x() >= kAhead && sees(rig, d_B)) return true;
  }
  return false;
}

double widest_blind_angle_rad(const SensorRig& rig) noexcept {
  constexpr std::size_t kSamples = 4000;
  std::array<bool, kSamples> seen{};
  for (std::size_t i = 0; i < kSamples; ++i) seen[i] = sees(rig, spread(i, kSamples));
  double least_cosine = 1.0;
  for (std::size_t i = 0; i < kSamples; ++i) {
    if (seen[i]) continue;
    const Vector3 d_B = spread(i, kSamples);
    double nearest = -1.0;
    // No farther than the widest one so far: then it does not matter any more.
    for (std::size_t k = 0; k < kSamples && nearest < least_cosine; ++k)
      if (seen[k]) nearest = std::max(nearest, d_B.dot(spread(k, kSamples)));
    least_cosine = std::min(least_cosine, nearest);
  }
  const double sine = std::sqrt(std::max(1.0 - least_cosine * least_cosine, 0.0));
  return core::atan2(sine, least_cosine);
}

double too_near_m(const SensorRig& rig) noexcept {
  double most_m = 0.0;
  const auto add = [&most_m](const auto& sensors) {
    for (const auto& sensor : sensors) {
      const SensorMount& at = sensor.mount;
      const double away_m = std::max({std::fabs(at.x_m), std::fabs(at.y_m), std::fabs(at.z_m)});
      if (sensor.range_min_m > 0.0) most_m = std::max(most_m, sensor.range_min_m + away_m);
    }
  };
  add(rig.cameras);
  add(rig.lidars);
  return most_m;
}

double shortest_range_m(const SensorRig& rig) noexcept {
  const auto shortest_m = [](const auto& sensors) {
    double range_m = sensors[0].range_m;
    for (const auto& sensor : sensors) range_m = std::min(range_m, sensor.range_m);
    return range_m;
  };
  if (!rig.cameras.empty()) return shortest_m(rig.cameras);
  return rig.lidars.empty() ? 0.0 : shortest_m(rig.lidars);
}

std::uint16_t cloud_pixels(const LidarSpec& lidar) noexcept {
  // Towards the corner of an image of 90 degrees a pixel covers 0.9 / n rad upwards (2 / n in the middle).
  constexpr double kSpan_rad = 0.9;
  const double ring_deg = lidar.rings > 1 ? (lidar.highest_deg - lidar.lowest_deg) / (lidar.rings - 1) : 0.0;
  const double step_rad = kDegree * std::max(ring_deg, 360.0 / lidar.columns);
  return static_cast<std::uint16_t>(std::clamp(kSpan_rad / step_rad, 8.0, 512.0));
}

}  // namespace roborun
