#include "platform/feed/dds/ros_samples.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <string_view>

#include "core/geometry/vector.hpp"

namespace roborun::feed {
namespace {

constexpr std::uint32_t kLeastSide = 8, kMostSide = 1280;  // what a port takes
/// Of a coefficient of distortion: less moves the corner of an image by less than a pixel.
constexpr double kMostDistortion = 1e-3;
constexpr double kMostSweep_s = 1.0;
constexpr double kUnknownSpeed_m2ps2 = 1e6;  // of no weight beside anything

/// What somebody else wrote, short and printable.
std::string quoted(const char* text) {
  constexpr std::size_t kMost = 40;
  std::string out = "'";
  for (const char* c = text; *c != '\0' && out.size() <= kMost; ++c)
    out += *c >= ' ' && *c < '\x7F' ? *c : '?';
  return out + "'";
}

template <typename Numbers>
bool all_finite(const Numbers& numbers) {
  return std::all_of(std::begin(numbers), std::end(numbers), [](double x) { return std::isfinite(x); });
}

bool is_optical(const char* frame_id) {
  return std::string_view(frame_id).find("optical") != std::string_view::npos;
}

Refused in_optical_frame(const char* frame_id) {
  return {"frame", fmt::format("it is in the frame {}: must be in axes forward, left, up", quoted(frame_id))};
}

struct Field {
  std::size_t offset{};
  std::uint8_t type{};  ///< 0: there is none.
};
constexpr std::uint8_t kUint32 = 6, kFloat32 = 7, kFloat64 = 8;

/// A field that lies within a point; type 0: there is none of this name and type.
Field field_of(const RosCloud& cloud, std::string_view name, std::uint8_t type) {
  for (std::uint32_t i = 0; i < cloud.fields._length; ++i) {
    const auto& field = cloud.fields._buffer[i];
    const std::size_t bytes = type == kFloat64 ? 8 : 4;
    if (field.name == name && field.datatype == type && field.count <= 1 && cloud.point_step >= bytes &&
        field.offset <= cloud.point_step - bytes)
      return {field.offset, type};
  }
  return {};
}

template <typename T>
T number_at(const std::uint8_t* from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

/// How long after the message's stamp a point was measured.
double after_s(const std::uint8_t* point, const Field& time, double stamp_s) {
  switch (time.type) {
    case kUint32:
      return 1e-9 * number_at<std::uint32_t>(point + time.offset);
    case kFloat32:
      return static_cast<double>(number_at<float>(point + time.offset));
    case kFloat64:
      return number_at<double>(point + time.offset) - stamp_s;
    default:
      return 0.0;
  }
}

Field time_of(const RosCloud& cloud) {
  for (const auto& [name, type] : {std::pair{"t", kUint32}, {"time", kFloat32}, {"timestamp", kFloat64}})
    if (const Field field = field_of(cloud, name, type); field.type != 0) return field;
  return {};
}

}  // namespace

std::optional<Refused> optics_of(const RosCameraInfo& info, RosOptics& optics) {
  if (!all_finite(info.k) || info.k[0] <= 1.0 || info.k[4] <= 1.0 || info.k[2] <= -0.5 || info.k[5] <= -0.5 ||
      info.k[2] >= info.width || info.k[5] >= info.height || info.k[0] > 1e5 || info.k[4] > 1e5)
    return Refused{"intrinsics",
                   fmt::format("k has fx {:.1f}, fy {:.1f}, cx {:.1f}, cy {:.1f} of {} x {} pixels: "
                               "impossible",
                               info.k[0], info.k[4], info.k[2], info.k[5], info.width, info.height)};
  const std::span<const double> distortion(info.d._buffer, info.d._length);
  if (!std::all_of(distortion.begin(), distortion.end(),
                   [](double d) { return std::fabs(d) <= kMostDistortion; }))
    return Refused{"distortion", "its images are distorted (d is not zero): must be a rectified topic"};
  const auto& roi = info.roi;
  if (info.binning_x > 1 || info.binning_y > 1 || roi.x_offset != 0 || roi.y_offset != 0 ||
      (roi.width != 0 && roi.width != info.width) || (roi.height != 0 && roi.height != info.height))
    return Refused{"binning", "binning or a region of interest: must be whole images"};
  optics = {info.width,
            info.height,
            static_cast<float>(info.k[0]),
            static_cast<float>(info.k[4]),
            static_cast<float>(info.k[2]),
            static_cast<float>(info.k[5])};
  return std::nullopt;
}

std::optional<Refused> depth_of(const RosImage& image, const RosOptics& optics, std::vector<std::byte>& room,
                                roborun_port_depth& depth, std::span<const std::byte>& pixels) {
  const std::string_view encoding = image.encoding;
  const std::size_t pixel_bytes = encoding == "16UC1" ? 2 : encoding == "32FC1" ? 4 : 0;
  if (pixel_bytes == 0)
    return Refused{"encoding", fmt::format("encoding {}: must be 16UC1 or 32FC1", quoted(image.encoding))};
  if (image.is_bigendian != 0)
    return Refused{"encoding", "its numbers are big-endian: must be little-endian"};
  if (image.width != optics.width || image.height != optics.height)
    return Refused{"size", fmt::format("{} x {} pixels, but its CameraInfo says {} x {}", image.width,
                                       image.height, optics.width, optics.height)};
  if (image.width < kLeastSide || image.width > kMostSide || image.height < kLeastSide ||
      image.height > kMostSide)
    return Refused{"size", fmt::format("{} x {} pixels: must be {} to {} each", image.width, image.height,
                                       kLeastSide, kMostSide)};
  const std::size_t row_bytes = pixel_bytes * image.width;
  if (image.step < row_bytes)
    return Refused{"step",
                   fmt::format("step {}: {} pixels need {} bytes", image.step, image.width, row_bytes)};
  if (image.data._length < std::uint64_t{image.step} * image.height)
    return Refused{"data", fmt::format("{} bytes: {} rows of {} are {}", image.data._length, image.height,
                                       image.step, std::uint64_t{image.step} * image.height)};
  const auto data = std::as_bytes(std::span(image.data._buffer, image.data._length));
  pixels = data.first(row_bytes * image.height);
  if (image.step > row_bytes) {
    room.resize(row_bytes * image.height);
    for (std::size_t v = 0; v < image.height; ++v)
      std::memcpy(room.data() + v * row_bytes, data.data() + v * image.step, row_bytes);
    pixels = room;
  }
  depth.width = image.width;
  depth.height = image.height;
  depth.pixel = pixel_bytes == 2 ? ROBORUN_PORT_UINT16 : ROBORUN_PORT_FLOAT32_M;
  depth.unit_m = 0.001F;
  depth.fx = optics.fx;
  depth.fy = optics.fy;
  depth.cx = optics.cx;
  depth.cy = optics.cy;
  return std::nullopt;
}

std::optional<Refused> cloud_of(const RosCloud& cloud, std::size_t most_points,
                                std::vector<roborun_port_point>& points, double& late_s) {
  if (cloud.is_bigendian) return Refused{"encoding", "its numbers are big-endian: must be little-endian"};
  if (is_optical(cloud.header.frame_id)) return in_optical_frame(cloud.header.frame_id);
  const Field x = field_of(cloud, "x", kFloat32), y = field_of(cloud, "y", kFloat32),
              z = field_of(cloud, "z", kFloat32);
  if (x.type == 0 || y.type == 0 || z.type == 0)
    return Refused{"fields", "must have fields x, y and z of type float32 within a point"};
  const std::uint64_t count = std::uint64_t{cloud.width} * cloud.height;
  if (count > most_points)
    return Refused{
        "size", fmt::format("{} points: must be {} at most, as the vehicle file says", count, most_points)};
  const std::uint64_t row_bytes = std::uint64_t{cloud.width} * cloud.point_step;
  if (cloud.height > 0 &&
      (cloud.row_step < row_bytes ||
       cloud.data._length < (cloud.height - 1) * std::uint64_t{cloud.row_step} + row_bytes))
    return Refused{
        "data", fmt::format("{} bytes with a row step of {}: {} x {} points of {} need more",
                            cloud.data._length, cloud.row_step, cloud.width, cloud.height, cloud.point_step)};
  const Field time = time_of(cloud);
  const double stamp_s = cloud.header.stamp.sec + 1e-9 * cloud.header.stamp.nanosec;
  points.clear();
  late_s = 0.0;
  if (count == 0) return std::nullopt;  // whatever it says of rows
  double latest_s = -kMostSweep_s;
  for (std::uint32_t row = 0; row < cloud.height; ++row)
    for (std::uint32_t column = 0; column < cloud.width; ++column) {
      const std::uint8_t* const at =
          cloud.data._buffer + std::size_t{row} * cloud.row_step + std::size_t{column} * cloud.point_step;
      const double t_s = after_s(at, time, stamp_s);
      if (!(std::fabs(t_s) <= kMostSweep_s))
        return Refused{"times", fmt::format("a point {:g} s from its stamp: must be within {:.0f} s", t_s,
                                            kMostSweep_s)};
      latest_s = std::max(latest_s, t_s);
      points.push_back({number_at<float>(at + x.offset), number_at<float>(at + y.offset),
                        number_at<float>(at + z.offset), static_cast<float>(t_s)});
    }
  late_s = points.empty() ? 0.0 : latest_s;
  for (roborun_port_point& point : points) point.before_s = static_cast<float>(late_s) - point.before_s;
  return std::nullopt;
}

std::optional<Refused> imu_of(const RosImu& message, roborun_port_imu& imu) {
  if (is_optical(message.header.frame_id)) return in_optical_frame(message.header.frame_id);
  if (message.angular_velocity_covariance[0] == -1.0 || message.linear_acceleration_covariance[0] == -1.0)
    return Refused{"halves",
                   "it has no rates or no acceleration (covariance -1): must have both in one message"};
  const auto& w = message.angular_velocity;
  const auto& f = message.linear_acceleration;
  const std::array<double, 3> rate{w.x, w.y, w.z}, force{f.x, f.y, f.z};
  if (!all_finite(rate) || !all_finite(force))
    return Refused{"values", "rates or accelerations are not finite"};
  std::copy(rate.begin(), rate.end(), imu.angular_rate_B_radps);
  std::copy(force.begin(), force.end(), imu.specific_force_B_mps2);
  return std::nullopt;
}

std::optional<Refused> odometry_of(const RosOdometry& message, roborun_port_odometry& odometry) {
  if (is_optical(message.child_frame_id)) return in_optical_frame(message.child_frame_id);
  const auto& p = message.pose.pose.position;
  const auto& q = message.pose.pose.orientation;
  const auto& v = message.twist.twist.linear;
  const std::array<double, 10> values{p.x, p.y, p.z, q.w, q.x, q.y, q.z, v.x, v.y, v.z};
  if (!all_finite(values)) return Refused{"values", "position, orientation or speed are not finite"};
  Quaternion q_OB(q.w, q.x, q.y, q.z);
  if (std::fabs(q_OB.norm() - 1.0) > 0.01) return Refused{"values", "its orientation is no rotation"};
  std::array<double, 9> variance{};
  for (std::size_t i = 0; i < 6; ++i) variance.at(i) = message.pose.covariance[7 * i];
  for (std::size_t i = 0; i < 3; ++i) variance.at(6 + i) = message.twist.covariance[7 * i];
  if (!std::all_of(variance.begin(), variance.end(), [](double x) { return x >= 0.0 && x < 1e12; }))
    return Refused{"covariance", "a variance is negative or not finite"};
  if (std::all_of(variance.begin(), variance.begin() + 6, [](double x) { return x == 0.0; }))
    return Refused{"covariance", "the covariance of its pose is all zero, which says unknown"};
  if (std::all_of(variance.begin() + 6, variance.end(), [](double x) { return x == 0.0; }))
    std::fill(variance.begin() + 6, variance.end(), kUnknownSpeed_m2ps2);
  q_OB.normalize();
  const Vector3 v_O = q_OB * Vector3(v.x, v.y, v.z);
  std::copy_n(values.begin(), 3, odometry.p_OB_m);
  const std::array<double, 4> wxyz{q_OB.w(), q_OB.x(), q_OB.y(), q_OB.z()};
  std::copy(wxyz.begin(), wxyz.end(), odometry.q_OB);
  std::copy_n(v_O.data(), 3, odometry.v_OB_mps);
  const auto narrow = [](double x) { return static_cast<float>(x); };
  std::transform(variance.begin(), variance.begin() + 6, odometry.pose_variance, narrow);
  std::transform(variance.begin() + 6, variance.end(), odometry.velocity_variance, narrow);
  return std::nullopt;
}

}  // namespace roborun::feed
