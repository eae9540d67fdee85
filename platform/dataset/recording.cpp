#include "platform/dataset/recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <limits>
#include <utility>

#include "platform/dataset/depth_png.hpp"
#include "platform/dataset/pose_text.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/text_file.hpp"
#include "platform/sitl/world/byte_reader.hpp"
#include "platform/sitl/world/cloud_file.hpp"
#include "platform/sitl/world/file_bytes.hpp"
#include "stages/perception/frame_guard.hpp"

namespace roborun::dataset {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostPng_bytes = std::size_t{16} << 20U;
constexpr std::size_t kMostCloud_bytes = std::size_t{1} << 30U;
constexpr std::size_t kMostFrames = 1'000'000;
constexpr Nanos kStep{33'000'000};  // of the stamps: frames come in order, more is not asked

std::string joined(const std::string& folder, const std::string& name) {
  return (fs::path(folder) / name).string();
}

bool exists(const std::string& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

/// The last number in a name; names without one come first.
std::uint64_t number_in(const std::string& stem) {
  const auto is_digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  const auto last = std::find_if(stem.rbegin(), stem.rend(), is_digit);
  const auto first = std::find_if_not(last, stem.rend(), is_digit);
  return sitl::number_of<std::uint64_t>(std::string_view(first.base(), last.base())).value_or(0);
}

/// The files of a folder that end so, in order.
std::vector<std::string> files_of(const std::string& folder, const std::string& extension) {
  std::vector<std::pair<std::uint64_t, std::string>> found;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    if (at->path().extension() == extension)
      found.emplace_back(number_in(at->path().stem().string()), at->path().string());
    if (found.size() > kMostFrames)
      throw InputError(fmt::format("{}: more than {} files *{}", folder, kMostFrames, extension));
  }
  std::sort(found.begin(), found.end());
  std::vector<std::string> files;
  files.reserve(found.size());
  for (auto& [number, file] : found) files.push_back(std::move(file));
  return files;
}

std::vector<TimedPose> load_poses(const std::string& path) {
  std::vector<TimedPose> poses =
      parse_poses(input::read_text(path, "a text file of poses", std::size_t{1} << 30U), path);
  if (poses.empty()) throw InputError(fmt::format("{}: no pose: must have at least one line", path));
  return poses;
}

DepthOptics load_optics(const std::string& path) {
  const std::string text = input::read_text(
      path, "a text file with 'fx fy cx cy per_m', or --intrinsics and --depth-scale given", 1 << 16);
  sitl::WordReader reader{std::string_view(text)};
  std::array<double, 5> n{};
  for (double& value : n) {
    const std::string_view word = reader.next_word();
    const auto number = sitl::number_of<double>(word);
    if (!number || !std::isfinite(*number) || !(*number > 0.0))
      throw InputError(fmt::format("{}: '{}': must be five numbers above 0: fx fy cx cy per_m", path, word));
    value = *number;
  }
  return {n[0], n[1], n[2], n[3], n[4]};
}

/// From the optical frame (x right, y down, z forward) to ours.
Pose camera_pose(const Pose& X_WS) {
  Matrix3 R_SC;
  R_SC.col(0) = Vector3::UnitZ();
  R_SC.col(1) = -Vector3::UnitX();
  R_SC.col(2) = -Vector3::UnitY();
  return {X_WS.R_RT * R_SC, X_WS.p_RT};
}

/// The pixels [first, first + count) of a row or column: as many on both sides of the principal point, to half a pixel.
struct Cut {
  std::size_t first, count;
};
Cut cut_about(double principal, std::size_t pixels) {
  const double middle =
      std::clamp(std::round(2.0 * (principal + 0.5)) / 2.0, 0.0, static_cast<double>(pixels));
  const double half = std::min(middle, static_cast<double>(pixels) - middle);
  return {static_cast<std::size_t>(middle - half), static_cast<std::size_t>(2.0 * half)};
}

}  // namespace

std::uint16_t cloud_image_pixels(std::span<const std::array<float, 3>> points_L) {
  constexpr std::uint32_t kLeast = 8, kMost = 512;
  // Where each point stands in images of the finest pixels, as one number: face, row, column.
  std::vector<std::uint32_t> at;
  for (const auto& p : points_L) {
    const std::array<float, 3> size{std::fabs(p[0]), std::fabs(p[1]), std::fabs(p[2])};
    const auto axis = static_cast<std::size_t>(std::max_element(size.begin(), size.end()) - size.begin());
    if (!(size[axis] > 0.0F) || !std::isfinite(size[0] + size[1] + size[2])) continue;
    const auto pixel = [&](std::size_t other) {
      return std::min(static_cast<std::uint32_t>(0.5F * (1.0F + p[other] / size[axis]) * kMost), kMost - 1);
    };
    const std::uint32_t face = 2 * static_cast<std::uint32_t>(axis) + (p[axis] > 0.0F ? 1U : 0U);
    at.push_back((face * kMost + pixel((axis + 1) % 3)) * kMost + pixel((axis + 2) % 3));
  }
  const auto met = [&at](std::uint32_t side) {
    std::vector<bool> pixel(std::size_t{6} * side * side);
    std::size_t count = 0;
    for (const std::uint32_t p : at) {
      const std::uint32_t step = kMost / side, face = p / (kMost * kMost);
      const std::size_t i = (std::size_t{face} * side + p / kMost % kMost / step) * side + p % kMost / step;
      count += pixel[i] ? 0U : 1U;
      pixel[i] = true;
    }
    return count;
  };
  std::uint32_t side = kLeast;
  std::size_t coarse = met(side);
  while (side < kMost) {
    const std::size_t fine = met(2 * side);
    if (fine == 0 || fine < 3 * coarse) break;
    side *= 2;
    coarse = fine;
  }
  return static_cast<std::uint16_t>(side);
}

Recording::Images::Images(std::uint16_t pixels)
    : block(stages::CloudImages::arena_bytes({pixels})), arena(block), images({pixels}, arena) {}

Recording::Recording(const std::string& folder, const RecordingOptions& options) : options_(options) {
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored)) throw InputError(fmt::format("{}: must be a folder", folder));
  if (exists(joined(folder, "depth.txt"))) {
    find_associated(folder);
  } else {
    find_numbered(folder);
  }
  if (!clouds_) optics_ = options_.optics ? *options_.optics : load_optics(joined(folder, "camera.txt"));
}

void Recording::find_associated(const std::string& folder) {
  const std::string list = joined(folder, "depth.txt"), truth = joined(folder, "groundtruth.txt");
  const std::string text = input::read_text(list, "a text file of images");
  const PoseTrack track(load_poses(truth), truth);
  sitl::WordReader reader{std::string_view(text)};
  std::string_view line;
  double last_s = -std::numeric_limits<double>::infinity();
  while (reader.next_line(line)) {
    const std::string_view word = sitl::WordReader::take_word(line);
    if (word.empty() || word.front() == '#') continue;
    const auto time_s = sitl::number_of<double>(word);
    const std::string_view file = sitl::WordReader::take_word(line);
    if (!time_s || !std::isfinite(*time_s) || file.empty())
      throw InputError(fmt::format("{}:{}: must be a time and a file", list, reader.line_number()));
    if (!(*time_s > last_s))
      throw InputError(fmt::format("{}:{}: {} s after {} s: times must ascend", list, reader.line_number(),
                                   *time_s, last_s));
    last_s = *time_s;
    Frame frame{joined(folder, std::string(file)), {}};
    if (track.at(*time_s, frame.X_WS)) {
      frames_.push_back(std::move(frame));
    } else {
      ++left_out_;
    }
  }
  if (frames_.empty() && left_out_ == 0)
    throw InputError(fmt::format("{}: no image: must have at least one line", list));
  if (frames_.empty())
    throw InputError(
        fmt::format("{}: none of its times is that of a pose in {}: must be within 1 ms of one, or between "
                    "two at most {} s apart",
                    list, truth, PoseTrack::kMostGap_s));
}

void Recording::find_numbered(const std::string& folder) {
  std::vector<std::string> files;
  for (const char* extension : {".png", ".pcd", ".las"}) {
    std::vector<std::string> found = files_of(folder, extension);
    const bool images = std::string_view(extension) == ".png";
    if (found.empty() && images) found = files_of(joined(folder, "depth"), extension);
    if (found.empty()) continue;
    if (!files.empty())
      throw InputError(
          fmt::format("{}: {} and {}: must hold files of one kind", folder, files.front(), found.front()));
    files = std::move(found);
    clouds_ = !images;
  }
  if (files.empty())
    throw InputError(
        fmt::format("{}: no frames: must hold depth.txt and groundtruth.txt, or poses.txt beside "
                    "NNN.png, depth/NNN.png, NNN.pcd or NNN.las",
                    folder));
  const std::string path = joined(folder, "poses.txt");
  const std::vector<TimedPose> poses = load_poses(path);
  if (poses.size() != files.size())
    throw InputError(fmt::format("{}: {} poses for {} files: must have a line for each", path, poses.size(),
                                 files.size()));
  for (std::size_t i = 0; i < files.size(); ++i) frames_.push_back({std::move(files[i]), poses[i].X_WS});
}

Aabb Recording::reach_W() const noexcept {
  // A camera sees sqrt(1 + tan^2 + tan^2) ranges far in the corners of its images.
  double reach_m = std::sqrt(3.0) * options_.range_m;
  if (!clouds_ && width_ > 0)
    reach_m =
        options_.range_m *
        std::sqrt(1.0 + static_cast<double>(posed_.frame.tan_half_width * posed_.frame.tan_half_width +
                                            posed_.frame.tan_half_height * posed_.frame.tan_half_height));
  Aabb box{frames_.front().X_WS.p_RT, frames_.front().X_WS.p_RT};
  for (const Frame& frame : frames_)
    box = {box.min_W.cwiseMin(frame.X_WS.p_RT), box.max_W.cwiseMax(frame.X_WS.p_RT)};
  return {box.min_W - Vector3::Constant(reach_m), box.max_W + Vector3::Constant(reach_m)};
}

std::span<const stages::PosedDepthFrame> Recording::load(std::size_t i) {
  const Frame& frame = frames_[i];
  const MonotonicTime stamp = MonotonicTime{} + static_cast<std::int64_t>(i + 1) * kStep;
  return clouds_ ? load_cloud(frame, stamp) : load_image(frame, stamp);
}

std::span<const stages::PosedDepthFrame> Recording::load_image(const Frame& frame, MonotonicTime stamp) {
  const DepthPng png =
      parse_depth_png(sitl::read_bytes(frame.file, kMostPng_bytes, "a PNG file"), frame.file);
  if (width_ == 0) {
    width_ = png.width;
    height_ = png.height;
  }
  if (png.width != width_ || png.height != height_)
    throw InputError(fmt::format("{}: {} x {} pixels: must be {} x {}, as {}", frame.file, png.width,
                                 png.height, width_, height_, frames_.front().file));
  const Cut columns = cut_about(optics_.cx, width_), rows = cut_about(optics_.cy, height_);
  depth_m_.resize(columns.count * rows.count);
  const auto scale = static_cast<float>(1.0 / optics_.per_m);
  for (std::size_t v = 0; v < rows.count; ++v) {
    const std::uint16_t* from = png.value.data() + (rows.first + v) * width_ + columns.first;
    float* const to = depth_m_.data() + v * columns.count;
    for (std::size_t u = 0; u < columns.count; ++u)
      to[u] = from[u] == 0 ? std::numeric_limits<float>::quiet_NaN() : scale * static_cast<float>(from[u]);
  }
  posed_.frame = {stamp,
                  0,
                  static_cast<std::uint16_t>(columns.count),
                  static_cast<std::uint16_t>(rows.count),
                  static_cast<float>(0.5 * static_cast<double>(columns.count) / optics_.fx),
                  static_cast<float>(0.5 * static_cast<double>(rows.count) / optics_.fy),
                  static_cast<float>(options_.range_m),
                  0.0F,
                  depth_m_};
  posed_.X_WC = camera_pose(frame.X_WS);
  posed_.error = options_.error;
  if (stages::check_shape(posed_) != Status::kOk)
    throw InputError(fmt::format(
        "{}: {} x {} pixels with fx {} fy {} cx {} cy {}: a view must be at most 126 degrees wide "
        "and 8 pixels or more about its principal point",
        frame.file, width_, height_, optics_.fx, optics_.fy, optics_.cx, optics_.cy));
  return {&posed_, 1};
}

std::span<const stages::PosedDepthFrame> Recording::load_cloud(const Frame& frame, MonotonicTime stamp) {
  const std::vector<unsigned char> bytes = sitl::read_bytes(frame.file, kMostCloud_bytes, "a cloud");
  const sitl::Geometry cloud =
      frame.file.ends_with(".pcd") ? sitl::parse_pcd(bytes, frame.file) : sitl::parse_las(bytes, frame.file);
  std::vector<std::array<float, 3>> points_L;
  points_L.reserve(cloud.points.size());
  for (const Vector3& p : cloud.points)
    points_L.push_back({static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())});
  const std::uint16_t pixels = cloud_image_pixels(points_L);
  auto& made = images_[pixels];
  if (made == nullptr) made = std::make_unique<Images>(pixels);
  if (made->images.make({points_L, stamp, static_cast<float>(options_.range_m), frame.X_WS}) != Status::kOk)
    throw InputError(fmt::format("{}: no point: must have one besides the sensor's place", frame.file));
  return made->images.frames();
}

}  // namespace roborun::dataset
