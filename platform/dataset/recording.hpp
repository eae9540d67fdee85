/// A folder of recorded depth images or clouds with poses, as frames for the map.
///
/// | the folder holds | poses |
/// |---|---|
/// | depth.txt, lines "time file" of images (TUM RGB-D) | groundtruth.txt, of the camera: PoseTrack at the image's time |
/// | NNN.png, or depth/NNN.png | poses.txt, of the camera: one line for each image |
/// | NNN.pcd, or NNN.las | poses.txt, of the sensor: one line for each cloud |
///
/// Files are taken in the order of the last number in their names. Images: PNG, 16 bits, depth along the optical axis; 0: no
/// value. Their camera looks along z, x to the right, y down, without distortion. Clouds: points in the sensor's frame, metres.
/// Poses: pose_text.hpp; z of the world up.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/depth_error.hpp"
#include "core/geometry/vector.hpp"
#include "core/memory/arena.hpp"
#include "stages/perception/cloud_images.hpp"
#include "stages/perception/occupancy_map.hpp"

namespace roborun::dataset {

/// Pixels; pixel (0, 0) has its middle there. `per_m` values of an image are a metre.
struct DepthOptics {
  double fx{}, fy{}, cx{}, cy{}, per_m{};
};

struct RecordingOptions {
  std::optional<DepthOptics> optics{};  ///< None: the five numbers of camera.txt, "fx fy cx cy per_m".
  double range_m{10.0};                 ///< What is farther says that nothing was met up to there. (0, 300]
  DepthError error{};                   ///< Of images.
};

/// Pixels a side, a power of two, of the images of a cloud: twice as many as long as three quarters of the finer pixels have points,
/// of those whose coarser ones have; 8 to 512. O(points).
[[nodiscard]] std::uint16_t cloud_image_pixels(std::span<const std::array<float, 3>> points_L);

class Recording {
 public:
  /// Reads the names and the poses. Throws InputError with one line.
  Recording(const std::string& folder, const RecordingOptions& options);

  [[nodiscard]] std::size_t size() const noexcept { return frames_.size(); }
  /// Images whose time no pose has.
  [[nodiscard]] std::size_t left_out() const noexcept { return left_out_; }
  /// A box around all that the frames may show.
  [[nodiscard]] Aabb reach_W() const noexcept;
  /// One image, or six of a cloud; valid until the next load(). Throws InputError with one line.
  [[nodiscard]] std::span<const stages::PosedDepthFrame> load(std::size_t i);
  [[nodiscard]] bool has_clouds() const noexcept { return clouds_; }

 private:
  struct Frame {
    std::string file;
    Pose X_WS{};
  };
  /// Of clouds of one density.
  struct Images {
    explicit Images(std::uint16_t pixels);
    std::vector<std::byte> block;
    core::Arena arena;
    stages::CloudImages images;
  };
  void find_associated(const std::string& folder);
  void find_numbered(const std::string& folder);
  [[nodiscard]] std::span<const stages::PosedDepthFrame> load_image(const Frame& frame, MonotonicTime stamp);
  [[nodiscard]] std::span<const stages::PosedDepthFrame> load_cloud(const Frame& frame, MonotonicTime stamp);

  RecordingOptions options_;
  DepthOptics optics_{};
  bool clouds_{false};
  std::vector<Frame> frames_;
  std::size_t left_out_{0};
  std::size_t width_{0}, height_{0};  ///< Of all images.
  std::vector<float> depth_m_;
  stages::PosedDepthFrame posed_{};
  std::map<std::uint16_t, std::unique_ptr<Images>> images_;
};

}  // namespace roborun::dataset
