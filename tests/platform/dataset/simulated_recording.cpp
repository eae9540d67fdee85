#include "tests/platform/dataset/simulated_recording.hpp"

#include <fmt/format.h>
#include <png.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "core/geometry/math.hpp"
#include "platform/sitl/sensors/depth_camera.hpp"

namespace roborun::test {
namespace {

sitl::WorldDescription empty_world(double half_m, double top_m) {
  sitl::WorldDescription d;
  d.bounds_W = {Vector3(-half_m, -half_m, 0.0), Vector3(half_m, half_m, top_m)};
  d.start_W = d.goal_W = Vector3(0.0, 0.0, 1.5);
  return d;
}

/// Of the body (x forward, y left, z up), which is the camera.
Pose pose_at(const SimulatedRecording& how, double time_s) {
  const double angle_rad = 0.5 * time_s / how.circle_m;
  const double yaw_rad = angle_rad + 0.35 * core::kPi;
  const Matrix3 R = (Eigen::AngleAxisd(yaw_rad, Vector3::UnitZ()) *
                     Eigen::AngleAxisd(0.15, Vector3::UnitY()) * Eigen::AngleAxisd(0.05, Vector3::UnitX()))
                        .toRotationMatrix();
  return {R, Vector3(how.circle_m * std::cos(angle_rad), how.circle_m * std::sin(angle_rad), how.height_m)};
}

}  // namespace

sitl::World room() {
  sitl::WorldDescription d = empty_world(20.0, 20.0);
  const auto box = [&d](double x0, double y0, double z0, double x1, double y1, double z1) {
    d.boxes.push_back({Vector3(x0, y0, z0), Vector3(x1, y1, z1)});
  };
  box(-5.3, -4.3, 0.0, -5.0, 4.3, 3.0);
  box(5.0, -4.3, 0.0, 5.3, 4.3, 3.0);
  box(-5.0, -4.3, 0.0, 5.0, -4.0, 3.0);
  box(-5.0, 4.0, 0.0, 5.0, 4.3, 3.0);
  box(-5.3, -4.3, 3.0, 5.3, 4.3, 3.3);
  box(4.5, -2.0, 0.0, 5.0, 1.0, 2.1);
  box(-4.2, 3.4, 0.0, -1.0, 4.0, 1.8);
  box(-0.6, -0.4, 0.7, 0.6, 0.4, 0.75);
  box(-3.5, -3.9, 0.0, -2.0, -3.0, 0.9);
  d.pillars.push_back({3.2, 2.7, 0.15, 0.0, 3.0});
  d.pillars.push_back({-3.4, 0.4, 0.05, 0.0, 3.0});
  return sitl::World(std::move(d));
}

sitl::World yard() {
  sitl::WorldDescription d = empty_world(60.0, 30.0);
  for (int i = 0; i < 40; ++i) {
    const double angle_rad = 2.399963 * i, far_m = 5.0 + 0.6 * i;
    d.pillars.push_back({far_m * std::cos(angle_rad), far_m * std::sin(angle_rad), 0.5, 0.0, 12.0});
  }
  return sitl::World(std::move(d));
}

void write_png(const std::string& path, std::uint32_t width, std::uint32_t height, int bits,
               const std::vector<std::uint16_t>& value) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) std::abort();
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, file);
  png_set_compression_level(png, 1);
  png_set_IHDR(png, info, width, height, bits, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  std::vector<png_byte> row;
  for (std::uint32_t v = 0; v < height; ++v) {
    row.clear();
    for (std::uint32_t u = 0; u < width; ++u) {
      const std::uint16_t m = value[std::size_t{v} * width + u];
      if (bits == 16) row.push_back(static_cast<png_byte>(m >> 8));
      row.push_back(static_cast<png_byte>(m & 0xFF));
    }
    png_write_row(png, row.data());
  }
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  if (std::fclose(file) != 0) std::abort();
}

void write_recording(const std::string& folder, const sitl::World& world, const SimulatedRecording& how) {
  std::filesystem::create_directories(folder + "/depth");
  CameraSpec spec;
  spec.width = how.width;
  spec.height = how.height;
  spec.tan_half_width = 0.6;
  spec.tan_half_height = 0.6 * how.height / how.width;
  spec.range_m = how.range_m;
  spec.rate_Hz = how.rate_Hz;
  spec.latency_s = 0.0;
  spec.model = how.model;
  sitl::DepthNoise noise;
  noise.frame_dropout_ratio = 0.0;
  sitl::SimulatedDepthCamera camera(world, spec, {}, noise, 7, 0);
  std::ofstream list(folder + "/depth.txt"), truth(folder + "/groundtruth.txt"),
      optics(folder + "/camera.txt");
  list << "# time file\n";
  truth << "# time tx ty tz qx qy qz qw\n";
  const double focal_px = 0.5 * how.width / spec.tan_half_width;
  optics << fmt::format("{} {} {} {} {}\n", focal_px, focal_px, 0.5 * how.width - 0.5, 0.5 * how.height - 0.5,
                        how.per_m);
  // Our camera looks along x, y to the left: theirs along z, x to the right.
  Matrix3 R_CS;
  R_CS.row(0) = Vector3::UnitZ();
  R_CS.row(1) = -Vector3::UnitX();
  R_CS.row(2) = -Vector3::UnitY();
  constexpr double kBegin_s = 100.0;
  for (int i = 0; i < how.frames; ++i) {
    const double time_s = i / how.rate_Hz;
    camera.expose(MonotonicTime{} + from_seconds(kBegin_s + time_s), pose_at(how, time_s));
    camera.expose(MonotonicTime{} + from_seconds(kBegin_s + time_s + 0.9 / how.rate_Hz),
                  pose_at(how, time_s));
    firmware_if::DepthFrame frame;
    if (camera.read(frame) != Status::kOk) continue;
    std::vector<std::uint16_t> value;
    for (const float m : frame.depth_m) {
      const double steps = std::round(static_cast<double>(m) * how.per_m);
      // Nothing within the range: what a file says of it is the largest number. No information: 0.
      value.push_back(steps > 0.0 ? static_cast<std::uint16_t>(std::fmin(steps, 65535.0)) : std::uint16_t{0});
    }
    const std::string name = fmt::format("depth/{:05d}.png", i);
    write_png((std::filesystem::path(folder) / name).string(), how.width, how.height, 16, value);
    const Pose X = pose_at(how, time_s);
    const Eigen::Quaterniond q(Matrix3(X.R_RT * R_CS));
    list << fmt::format("{:.6f} {}\n", kBegin_s + time_s, name);
    truth << fmt::format("{:.6f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n", kBegin_s + time_s,
                         X.p_RT.x(), X.p_RT.y(), X.p_RT.z(), q.x(), q.y(), q.z(), q.w());
  }
}

}  // namespace roborun::test
