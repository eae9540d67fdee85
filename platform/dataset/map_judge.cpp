#include "platform/dataset/map_judge.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace roborun::dataset {
namespace {

constexpr double kSigmas = 3.0;
constexpr double kFarthest = std::numeric_limits<double>::infinity();

double ratio(std::uint64_t part, std::uint64_t whole) noexcept {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole)
                   : std::numeric_limits<double>::quiet_NaN();
}

/// A frame with its numbers in double.
class Image {
 public:
  explicit Image(const stages::PosedDepthFrame& posed)
      : posed_(posed),
        frame_(posed.frame),
        across_(static_cast<double>(frame_.tan_half_width)),
        along_(static_cast<double>(frame_.tan_half_height)),
        range_m_(static_cast<double>(frame_.range_m)) {}

  /// NaN: no information.
  [[nodiscard]] double depth_m(int u, int v) const {
    const float m = frame_.depth_m[static_cast<std::size_t>(v) * frame_.width + static_cast<std::size_t>(u)];
    return m > frame_.range_min_m ? static_cast<double>(m) : std::numeric_limits<double>::quiet_NaN();
  }
  [[nodiscard]] Vector3 end_W(int u, int v, double depth_m) const {
    return posed_.X_WC * (depth_m * Vector3(1.0, across_ * (1.0 - (2.0 * u + 1.0) / frame_.width),
                                            along_ * (1.0 - (2.0 * v + 1.0) / frame_.height)));
  }
  [[nodiscard]] int width() const { return frame_.width; }
  [[nodiscard]] int height() const { return frame_.height; }
  [[nodiscard]] double range_m() const { return range_m_; }
  [[nodiscard]] Aabb reach_W() const {
    Aabb box{posed_.X_WC.p_RT, posed_.X_WC.p_RT};
    for (const double y : {-across_, across_})
      for (const double z : {-along_, along_}) {
        const Vector3 corner_W = posed_.X_WC * (range_m_ * Vector3(1.0, y, z));
        box = {box.min_W.cwiseMin(corner_W), box.max_W.cwiseMax(corner_W)};
      }
    return box;
  }

  enum class Says { kNothing, kShown, kPassed };
  [[nodiscard]] Says of_cell(const Vector3& center_W, double cell_m) const {
    double near_m = kFarthest, far_m = -kFarthest, left = kFarthest, right = -kFarthest, top = kFarthest,
           bottom = -kFarthest, farthest_m = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3 aside =
          cell_m * Vector3((corner & 1) - 0.5, ((corner >> 1) & 1) - 0.5, (corner >> 2) - 0.5);
      const Vector3 p_C = posed_.X_WC.inverse_times(center_W + aside);
      if (!(p_C.x() > 0.0)) return Says::kNothing;
      near_m = std::min(near_m, p_C.x());
      far_m = std::max(far_m, p_C.x());
      farthest_m = std::max(farthest_m, posed_.is_cloud ? p_C.norm() : p_C.x());
      const double u = 0.5 * width() * (1.0 - p_C.y() / (across_ * p_C.x()));
      const double v = 0.5 * height() * (1.0 - p_C.z() / (along_ * p_C.x()));
      left = std::min(left, u);
      right = std::max(right, u);
      top = std::min(top, v);
      bottom = std::max(bottom, v);
    }
    if (!(left >= 0.0 && right < width() && top >= 0.0 && bottom < height() && farthest_m < range_m_))
      return Says::kNothing;
    const double margin_m = kSigmas * posed_.error.at_m(far_m);
    bool passed = true;
    for (int v = static_cast<int>(top); v <= static_cast<int>(bottom); ++v)
      for (int u = static_cast<int>(left); u <= static_cast<int>(right); ++u) {
        const double m = depth_m(u, v);
        if (m >= near_m - margin_m && m <= far_m + margin_m) return Says::kShown;
        passed = passed && m > far_m + margin_m;
      }
    return passed ? Says::kPassed : Says::kNothing;
  }

 private:
  const stages::PosedDepthFrame& posed_;
  const firmware_if::DepthFrame& frame_;
  double across_, along_, range_m_;
};

void judge_surfaces(const stages::MapView& view, const Image& image, Agreement& agreement) {
  std::uint64_t lookups = 0;
  for (int v = 0; v < image.height(); ++v)
    for (int u = 0; u < image.width(); ++u) {
      const double m = image.depth_m(u, v);
      if (!(m < image.range_m())) continue;
      const stages::CellState state = view.at(image.end_W(u, v, m), lookups);
      ++agreement.surface_pixels;
      agreement.in_free += state == stages::CellState::kFree ? 1U : 0U;
      agreement.in_no_occupied += state != stages::CellState::kOccupied ? 1U : 0U;
    }
}

void judge_block(const stages::CellBlock& cells, const Vector3& corner_W, double cell_m, const Image& image,
                 Agreement& agreement) {
  for (std::size_t row = 0; row < cells.occupied.size(); ++row)
    for (int x = 0; x < stages::kBlockCells; ++x) {
      if (((cells.occupied[row] >> x) & 1) == 0) continue;
      const std::size_t y = row % stages::kBlockCells, z = row / stages::kBlockCells;
      const Vector3 index(x, static_cast<double>(y), static_cast<double>(z));
      const Image::Says says = image.of_cell(corner_W + cell_m * (index + Vector3::Constant(0.5)), cell_m);
      agreement.occupied_shown += says != Image::Says::kNothing ? 1U : 0U;
      agreement.occupied_passed += says == Image::Says::kPassed ? 1U : 0U;
    }
}

}  // namespace

double Agreement::false_free_ratio() const noexcept { return ratio(in_free, surface_pixels); }
double Agreement::missed_ratio() const noexcept { return ratio(in_no_occupied, surface_pixels); }
double Agreement::false_occupied_ratio() const noexcept { return ratio(occupied_passed, occupied_shown); }

void judge(const stages::MapView& view, std::span<const stages::PosedDepthFrame> frames,
           Agreement& agreement) {
  const double cell_m = view.finest_m(), block_m = stages::block_m(cell_m);
  std::uint64_t lookups = 0;
  for (const stages::PosedDepthFrame& posed : frames) {
    const Image image(posed);
    judge_surfaces(view, image, agreement);
    const Aabb reach_W = image.reach_W();
    const Vector3 low = (reach_W.min_W / block_m).array().floor(),
                  high = (reach_W.max_W / block_m).array().floor();
    stages::CellBlock cells;
    for (double z = low.z(); z <= high.z(); z += 1.0)
      for (double y = low.y(); y <= high.y(); y += 1.0)
        for (double x = low.x(); x <= high.x(); x += 1.0) {
          const Vector3 corner_W = block_m * Vector3(x, y, z);
          if (view.read(corner_W, cell_m, cells, lookups) == stages::BlockContent::kMixed)
            judge_block(cells, corner_W, cell_m, image, agreement);
        }
  }
}

}  // namespace roborun::dataset
