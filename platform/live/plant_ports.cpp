#include "platform/live/plant_ports.hpp"

#include <algorithm>
#include <limits>

#include "core/geometry/vector.hpp"

namespace roborun::live {
namespace {

constexpr std::uint32_t kPictureSlots = 4;
constexpr std::uint32_t kSampleSlots = 1024;

roborun_port_stamp stamp_of(MonotonicTime stamp, std::uint32_t sequence, Nanos shift) noexcept {
  return {(stamp.time_since_epoch() + shift).count(), sequence, 0};
}

}  // namespace

PicturePorts::PicturePorts(const SensorRig& rig, const std::vector<std::size_t>& most_points,
                           const sensor_port::VehiclePorts& ports) {
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const CameraSpec& camera = rig.cameras[i];
    sensor_port::open_port(camera_.emplace_back(), ports.camera(i), ROBORUN_PORT_DEPTH,
                           sizeof(float) * camera.width * camera.height, kPictureSlots);
  }
  for (std::size_t i = 0; i < rig.lidars.size(); ++i) {
    sensor_port::open_port(lidar_.emplace_back(), ports.lidar(i), ROBORUN_PORT_CLOUD,
                           sizeof(roborun_port_point) * most_points.at(i), kPictureSlots);
    points_.resize(std::max(points_.size(), most_points.at(i)));
  }
}

void PicturePorts::write(std::size_t camera, const firmware_if::DepthFrame& f,
                         const firmware_if::CameraMount& mount, Nanos shift) noexcept {
  roborun_port_depth d = sensor_port::depth_header(f, stamp_of(f.stamp, f.sequence, shift));
  d.mount = sensor_port::port_mount(mount);
  (void)camera_[camera].write(d, std::as_bytes(f.depth_m));
}

void PicturePorts::write(std::size_t lidar, const firmware_if::LidarSweep& sweep,
                         const firmware_if::CameraMount& mount, Nanos shift) noexcept {
  const std::size_t count = std::min(sweep.points_L_m.size(), points_.size());
  for (std::size_t i = 0; i < count; ++i) {
    const auto& [x_m, y_m, z_m] = sweep.points_L_m[i];
    points_[i] = {x_m, y_m, z_m, 0.0F};
  }
  roborun_port_cloud c{};
  c.at = stamp_of(sweep.stamp, sweep.sequence, shift);
  c.points = static_cast<std::uint32_t>(count);
  c.range_min_m = sweep.range_min_m;
  c.range_m = sweep.range_m;
  c.mount = sensor_port::port_mount(mount);
  (void)lidar_[lidar].write(c, std::as_bytes(std::span(points_).first(count)));
}

NavigationPorts::NavigationPorts(const SensorRig& rig, const sensor_port::VehiclePorts& ports,
                                 const sensor_port::EarthPlace& origin, bool on_bus)
    : frame_(origin), origin_height_m_(origin.height_m) {
  if (!on_bus) {
    sensor_port::open_port(imu_, ports.imu(), ROBORUN_PORT_IMU, 0, kSampleSlots);
    if (rig.gnss != GnssModel::kNone)
      sensor_port::open_port(gnss_, ports.gnss(), ROBORUN_PORT_GNSS, 0, kSampleSlots);
    sensor_port::open_port(pressure_, ports.pressure(), ROBORUN_PORT_PRESSURE, 0, kSampleSlots);
  }
  if (rig.odometry != OdometryModel::kNone)
    sensor_port::open_port(odometry_, ports.odometry(), ROBORUN_PORT_ODOMETRY, 0, kSampleSlots);
  sensor_port::open_port(lines_, ports.lines(), ROBORUN_PORT_LINES, 0, kSampleSlots);
}

void NavigationPorts::write(const firmware_if::ImuSample& sample, Nanos shift) noexcept {
  roborun_port_imu s{};
  s.at = stamp_of(sample.stamp, sample.sequence, shift);
  std::copy_n(sample.angular_rate_B_radps.begin(), 3, s.angular_rate_B_radps);
  std::copy_n(sample.specific_force_B_mps2.begin(), 3, s.specific_force_B_mps2);
  (void)imu_.write(s);
}

void NavigationPorts::write(const firmware_if::GnssFix& fix, Nanos shift) noexcept {
  const sensor_port::EarthPlace place = frame_.to_earth(fix.p_WB_m);
  roborun_port_gnss s{};
  s.at = stamp_of(fix.stamp, fix.sequence, shift);
  s.latitude_deg = place.latitude_deg;
  s.longitude_deg = place.longitude_deg;
  s.height_m = place.height_m;
  std::copy_n(fix.v_WB_mps.begin(), 3, s.v_ENU_mps);
  s.heading_rad = fix.heading_rad;
  s.sigma_horizontal_m = static_cast<float>(fix.sigma_horizontal_m);
  s.sigma_vertical_m = static_cast<float>(fix.sigma_vertical_m);
  s.sigma_speed_mps = static_cast<float>(fix.sigma_speed_mps);
  s.sigma_heading_rad = static_cast<float>(fix.sigma_heading_rad);
  (void)gnss_.write(s);
}

void NavigationPorts::write(const firmware_if::BarometerSample& sample, Nanos shift) noexcept {
  roborun_port_pressure s{};
  s.at = stamp_of(sample.stamp, sample.sequence, shift);
  s.pressure_Pa = sensor_port::pressure_at(origin_height_m_ + sample.altitude_m);
  s.temperature_K = std::numeric_limits<float>::quiet_NaN();
  (void)pressure_.write(s);
}

void NavigationPorts::write(const firmware_if::OdometrySample& sample, Nanos shift) noexcept {
  const auto variance = [](double sigma) { return static_cast<float>(sigma * sigma); };
  roborun_port_odometry s{};
  s.at = stamp_of(sample.stamp, sample.sequence, shift);
  s.reset_counter = sample.reset_counter;
  std::copy_n(sample.p_OB_m.begin(), 3, s.p_OB_m);
  std::copy_n(sample.q_OB.begin(), 4, s.q_OB);
  std::copy_n(sample.v_OB_mps.begin(), 3, s.v_OB_mps);
  std::fill_n(s.pose_variance, 3, variance(sample.sigma_position_m));
  std::fill_n(s.pose_variance + 3, 3, variance(sample.sigma_attitude_rad));
  std::fill_n(s.velocity_variance, 3, variance(sample.sigma_speed_mps));
  (void)odometry_.write(s);
}

TruthPort::TruthPort(const sensor_port::VehiclePorts& ports) {
  sensor_port::open_port(port_, ports.truth(), ROBORUN_PORT_ODOMETRY, 0, kSampleSlots);
}

void TruthPort::write(MonotonicTime now, const Vector3& p_WB, const Quaternion& q_WB, Nanos shift) noexcept {
  roborun_port_odometry s{};
  s.at = stamp_of(now, ++written_, shift);
  std::copy_n(p_WB.data(), 3, s.p_OB_m);
  const std::array<double, 4> wxyz{q_WB.w(), q_WB.x(), q_WB.y(), q_WB.z()};
  std::copy_n(wxyz.begin(), 4, s.q_OB);
  (void)port_.write(s);
}

void NavigationPorts::write_lines(MonotonicTime now, std::uint32_t active, std::uint32_t gone,
                                  Nanos shift) noexcept {
  constexpr std::uint32_t kAll =
      ROBORUN_PORT_KILL_OPEN | ROBORUN_PORT_KILL_CLOSED | ROBORUN_PORT_OPERATOR | ROBORUN_PORT_ARM;
  roborun_port_lines s{};
  s.at = stamp_of(now, ++lines_written_, shift);
  s.wired = kAll & ~gone;
  s.active = active & s.wired;
  (void)lines_.write(s);
}

}  // namespace roborun::live
