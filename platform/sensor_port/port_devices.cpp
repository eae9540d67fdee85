#include "platform/sensor_port/port_devices.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace roborun::sensor_port {
namespace {

template <typename... Numbers>
bool are_finite(Numbers... x) noexcept {
  return (std::isfinite(x) && ...);
}

template <typename Array>
bool all_finite(const Array& all) noexcept {
  return std::all_of(std::begin(all), std::end(all), [](auto x) { return std::isfinite(x); });
}

double wide(auto x) noexcept { return static_cast<double>(x); }

bool is_rotation(const auto(&q)[4]) noexcept {
  double square = 0.0;
  for (const auto x : q) square += wide(x) * wide(x);
  return std::fabs(square - 1.0) < 0.02;  // NaN is none
}

/// The rotation of a unit quaternion, row by row.
firmware_if::CameraMount mount_of(const roborun_port_mount& m) noexcept {
  const auto& q = m.q_BS;
  const double w = wide(q[0]), x = wide(q[1]), y = wide(q[2]), z = wide(q[3]);
  const double scale = 2.0 / (w * w + x * x + y * y + z * z);
  return {{1 - scale * (y * y + z * z), scale * (x * y - w * z), scale * (x * z + w * y),  //
           scale * (x * y + w * z), 1 - scale * (x * x + z * z), scale * (y * z - w * x),  //
           scale * (x * z - w * y), scale * (y * z + w * x), 1 - scale * (x * x + y * y)},
          {wide(m.p_BS_m[0]), wide(m.p_BS_m[1]), wide(m.p_BS_m[2])}};
}

bool is_mount(const roborun_port_mount& m) noexcept { return all_finite(m.p_BS_m) && is_rotation(m.q_BS); }

bool is_range(float least_m, float most_m) noexcept {
  return are_finite(least_m, most_m) && least_m >= 0.0F && most_m > least_m && most_m <= 1000.0F;
}

/// Pixels on the side of the optical axis that has fewer of them: as many are taken on the other. `centre` counts from the edge.
std::uint32_t half_of(float centre, std::uint32_t pixels) noexcept {
  const float fewer = std::min(centre, static_cast<float>(pixels) - centre);
  return fewer > 0.0F ? static_cast<std::uint32_t>(std::lround(fewer)) : 0;
}

constexpr std::uint32_t kLeastPixels = 8, kMostPixels = 1280;

/// The part of an image around its optical axis.
struct PixelWindow {
  std::uint32_t left{}, top{}, width{}, height{};
};

bool is_optics(const roborun_port_depth& d) noexcept {
  return are_finite(d.fx, d.fy, d.cx, d.cy, d.exposure_s) && d.fx > 1.0F && d.fy > 1.0F &&
         is_range(d.range_min_m, d.range_m) && d.cx > -0.5F && d.cy > -0.5F &&
         d.cx < static_cast<float>(d.width) && d.cy < static_cast<float>(d.height) &&
         (d.pixel == ROBORUN_PORT_FLOAT32_M || (std::isfinite(d.unit_m) && d.unit_m > 0.0F));
}

bool is_size(const roborun_port_depth& d, std::size_t payload_bytes) noexcept {
  const std::size_t pixel_bytes = d.pixel == ROBORUN_PORT_FLOAT32_M ? 4U
                                  : d.pixel == ROBORUN_PORT_UINT16  ? 2U
                                                                    : 0U;
  return pixel_bytes > 0 && d.width >= kLeastPixels && d.height >= kLeastPixels && d.width <= kMostPixels &&
         d.height <= kMostPixels && payload_bytes == pixel_bytes * d.width * d.height;
}

PixelWindow window_of(const roborun_port_depth& d) noexcept {
  const std::uint32_t across = std::min(half_of(d.cx + 0.5F, d.width), d.width / 2);
  const std::uint32_t down = std::min(half_of(d.cy + 0.5F, d.height), d.height / 2);
  const auto from = [](float centre, std::uint32_t half, std::uint32_t pixels) {
    const double first = std::round(wide(centre) + 0.5 - wide(half));
    return static_cast<std::uint32_t>(std::clamp(first, 0.0, static_cast<double>(pixels - 2 * half)));
  };
  return {from(d.cx, across, d.width), from(d.cy, down, d.height), 2 * across, 2 * down};
}

/// Metres out of pixels of an image of that width, row by row; 0 says nothing, whatever they are made of.
template <typename Pixel>
void take_pixels(std::span<const std::byte> image, std::uint32_t width, const PixelWindow& window,
                 float unit_m, float* out_m) noexcept {
  std::array<Pixel, kMostPixels + 2 * sizeof(std::uint64_t) / sizeof(Pixel)> row;
  for (std::uint32_t v = 0; v < window.height; ++v, out_m += window.width) {
    const std::size_t first = std::size_t{window.top + v} * width + window.left;
    const std::size_t before = copy_shared(image, first * sizeof(Pixel), window.width * sizeof(Pixel),
                                           std::as_writable_bytes(std::span(row)));
    const Pixel* raw = row.data() + before / sizeof(Pixel);
#pragma omp simd
    for (std::uint32_t u = 0; u < window.width; ++u) {
      const float depth_m = static_cast<float>(raw[u]) * unit_m;
      out_m[u] = depth_m > 0.0F ? depth_m : std::numeric_limits<float>::quiet_NaN();
    }
  }
}

}  // namespace

std::string PortDevice::open(const std::string& path, std::uint32_t kind, const PortClock& clock) {
  clock_ = clock;
  is_mounted_ = false;
  return reader_.open(path, kind);
}

std::optional<MonotonicTime> PortDevice::stamp_of(const PortSample& port, std::int64_t stamp_ns) noexcept {
  // Sums of what anybody may have written: without a sign they may wrap.
  const auto sum = static_cast<std::uint64_t>(stamp_ns) + static_cast<std::uint64_t>(port.clock_offset_ns) -
                   static_cast<std::uint64_t>(clock_.epoch.count());
  const MonotonicTime stamp{Nanos{static_cast<std::int64_t>(sum)}};
  const bool is_first = last_ == MonotonicTime::min();
  const bool forward = stamp > last_ || (may_repeat_ && stamp == last_);
  // Forward, and so below 2^64. What was overwritten between two samples that are read was no silence.
  const auto apart = static_cast<std::uint64_t>(stamp.time_since_epoch().count()) -
                     static_cast<std::uint64_t>(last_.time_since_epoch().count());
  const std::uint64_t between = reader_.counters().dropped - dropped_before_;
  dropped_before_ = reader_.counters().dropped;
  if (forward && !is_first && apart / (between + 1) > static_cast<std::uint64_t>(patience_.count()))
    ++silences_;
  last_ = stamp;
  if (forward) return stamp;
  ++refusals_.backwards;
  return std::nullopt;
}

bool PortDevice::has_mount(const roborun_port_mount& mount) noexcept {
  if (!is_mount(mount)) return false;
  const firmware_if::CameraMount there = mount_of(mount);
  if (!is_mounted_) mount_ = there;
  is_mounted_ = true;
  return there.R_BC == mount_.R_BC && there.p_BC_m == mount_.p_BC_m;
}

std::string PortDepthCamera::open(const std::string& path, const PortClock& clock) {
  std::string wrong = PortDevice::open(path, ROBORUN_PORT_DEPTH, clock);
  // The smallest pixels make the most of them.
  if (wrong.empty()) depth_m_.resize(std::min(reader_.payload_room_bytes() / 2, kMostPixels * kMostPixels));
  return wrong;
}

Status PortDepthCamera::read(firmware_if::DepthFrame& frame) noexcept {
  PortLoan loan;
  roborun_port_depth d;
  PixelWindow window;
  bool is_sized = false;
  Status status = Status::kNotReady;
  for (int i = 0; i < PortReader::kTries && status == Status::kNotReady; ++i) {
    if (const Status lent = reader_.borrow(loan); lent != Status::kOk) return lent;
    std::memcpy(&d, loan.port.sample.data(), sizeof d);
    is_sized = is_size(d, loan.port.payload.size()) && std::size_t{d.width} * d.height <= depth_m_.size();
    window = is_sized && is_optics(d) ? window_of(d) : PixelWindow{};
    if (d.pixel == ROBORUN_PORT_FLOAT32_M)
      take_pixels<float>(loan.port.payload, d.width, window, 1.0F, depth_m_.data());
    else
      take_pixels<std::uint16_t>(loan.port.payload, d.width, window, d.unit_m, depth_m_.data());
    status = reader_.give_back(loan);
  }
  if (status != Status::kOk) return status;
  const auto stamp = take(loan.port, d);
  if (!stamp) return Status::kNotReady;
  if (!is_sized) {
    ++refusals_.size;
    return Status::kNotReady;
  }
  if (window.width < kLeastPixels || window.height < kLeastPixels || !has_mount(d.mount)) {
    ++refusals_.optics;
    return Status::kNotReady;
  }
  frame.stamp = *stamp;
  frame.sequence = d.at.sequence;
  frame.width = static_cast<std::uint16_t>(window.width);
  frame.height = static_cast<std::uint16_t>(window.height);
  frame.tan_half_width = 0.5F * static_cast<float>(window.width) / d.fx;
  frame.tan_half_height = 0.5F * static_cast<float>(window.height) / d.fy;
  frame.range_m = d.range_m;
  frame.range_min_m = d.range_min_m;
  frame.depth_m = std::span<const float>(depth_m_).first(std::size_t{window.width} * window.height);
  return Status::kOk;
}

std::string PortLidar::open(const std::string& path, const PortClock& clock) {
  std::string wrong = PortDevice::open(path, ROBORUN_PORT_CLOUD, clock);
  if (wrong.empty()) points_L_m_.resize(reader_.payload_room_bytes() / sizeof(roborun_port_point));
  return wrong;
}

Status PortLidar::read(firmware_if::LidarSweep& sweep) noexcept {
  PortSample port;
  if (const Status status = reader_.newest(port); status != Status::kOk) return status;
  roborun_port_cloud c;
  const auto stamp = take(port, c);
  if (!stamp) return Status::kNotReady;
  if (c.points > points_L_m_.size() || port.payload.size() != c.points * sizeof(roborun_port_point)) {
    ++refusals_.size;
    return Status::kNotReady;
  }
  if (!is_range(c.range_min_m, c.range_m) || !has_mount(c.mount)) {
    ++refusals_.optics;
    return Status::kNotReady;
  }
  // Points that are not finite say nothing (LidarSweep), and so stay as they are.
  for (std::uint32_t i = 0; i < c.points; ++i)
    std::memcpy(points_L_m_[i].data(), port.payload.data() + i * sizeof(roborun_port_point),
                sizeof points_L_m_[i]);
  sweep.stamp = *stamp;
  sweep.sequence = c.at.sequence;
  sweep.range_min_m = c.range_min_m;
  sweep.range_m = c.range_m;
  sweep.points_L_m = std::span<const std::array<float, 3>>(points_L_m_).first(c.points);
  return Status::kOk;
}

std::string PortImu::open(const std::string& path, const PortClock& clock) {
  return PortDevice::open(path, ROBORUN_PORT_IMU, clock);
}

Status PortImu::read(firmware_if::ImuSample& sample) noexcept {
  PortSample port;
  if (const Status status = reader_.next(port); status != Status::kOk) return status;
  roborun_port_imu s;
  const auto stamp = take(port, s);
  if (!stamp) return Status::kNotReady;
  if (!all_finite(s.angular_rate_B_radps) || !all_finite(s.specific_force_B_mps2)) {
    ++refusals_.values;
    return Status::kNotReady;
  }
  sample.stamp = *stamp;
  sample.sequence = s.at.sequence;
  std::copy_n(s.angular_rate_B_radps, 3, sample.angular_rate_B_radps.begin());
  std::copy_n(s.specific_force_B_mps2, 3, sample.specific_force_B_mps2.begin());
  return Status::kOk;
}

std::string PortOdometry::open(const std::string& path, const PortClock& clock) {
  return PortDevice::open(path, ROBORUN_PORT_ODOMETRY, clock);
}

Status PortOdometry::read(firmware_if::OdometrySample& sample) noexcept {
  PortSample port;
  if (const Status status = reader_.next(port); status != Status::kOk) return status;
  roborun_port_odometry s;
  const auto stamp = take(port, s);
  if (!stamp) return Status::kNotReady;
  const auto is_variance = [](float x) { return std::isfinite(x) && x >= 0.0F; };
  if (!all_finite(s.p_OB_m) || !all_finite(s.v_OB_mps) || !is_rotation(s.q_OB) ||
      !std::all_of(std::begin(s.pose_variance), std::end(s.pose_variance), is_variance) ||
      !std::all_of(std::begin(s.velocity_variance), std::end(s.velocity_variance), is_variance)) {
    ++refusals_.values;
    return Status::kNotReady;
  }
  const auto most = [](const float* from, int count) {
    return std::sqrt(static_cast<double>(*std::max_element(from, from + count)));
  };
  sample.stamp = *stamp;
  sample.sequence = s.at.sequence;
  sample.reset_counter = static_cast<std::uint8_t>(s.reset_counter);
  std::copy_n(s.p_OB_m, 3, sample.p_OB_m.begin());
  std::copy_n(s.q_OB, 4, sample.q_OB.begin());
  std::copy_n(s.v_OB_mps, 3, sample.v_OB_mps.begin());
  sample.sigma_position_m = most(s.pose_variance, 3);
  sample.sigma_attitude_rad = most(s.pose_variance + 3, 3);
  sample.sigma_speed_mps = most(s.velocity_variance, 3);
  return Status::kOk;
}

}  // namespace roborun::sensor_port
