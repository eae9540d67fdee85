#include "stages/perception/sight_camera.hpp"

#include <algorithm>
#include <cmath>

namespace roborun::stages {

void SightCamera::prepare(const PosedDepthFrame& posed, const DepthPyramid& image) noexcept {
  const Matrix3 R = posed.X_WC.R_RT.transpose();
  const auto across = static_cast<double>(posed.frame.tan_half_width);
  const auto along = static_cast<double>(posed.frame.tan_half_height);
  p_WC = posed.X_WC.p_RT;
  const auto sum_abs = [&R](double of_x, int row, double of_row) {
    double sum = 0.0;
    for (int i = 0; i < 3; ++i) sum += std::fabs(of_x * R(0, i) + of_row * R(row, i));
    return static_cast<float>(sum);
  };
  for (int i = 0; i < 9; ++i) R_CW[static_cast<std::size_t>(i)] = static_cast<float>(R(i / 3, i % 3));
  for (std::size_t i = 0; i < 8; ++i) {
    const Vector3 offset_W((i & 1U) != 0 ? 1.0 : -1.0, (i & 2U) != 0 ? 1.0 : -1.0,
                           (i & 4U) != 0 ? 1.0 : -1.0);
    const Vector3 offset_C = R * offset_W;
    for (std::size_t row = 0; row < 3; ++row)
      child[row][i] = static_cast<float>(offset_C[static_cast<Eigen::Index>(row)]);
  }
  extent = sum_abs(0.0, 0, 1.0);
  support = {sum_abs(across, 1, -1.0), sum_abs(across, 1, 1.0), sum_abs(along, 2, -1.0),
             sum_abs(along, 2, 1.0)};
  tan_half_width = posed.frame.tan_half_width;
  tan_half_height = posed.frame.tan_half_height;
  range_m = posed.frame.range_m;
  columns_per_tan = static_cast<float>(0.5 * posed.frame.width / across);
  rows_per_tan = static_cast<float>(0.5 * posed.frame.height / along);
  last_column = static_cast<float>(posed.frame.width - 1);
  last_row = static_cast<float>(posed.frame.height - 1);
  margin_m = static_cast<float>(kLeast_m + kSigmas * (posed.error.constant_m + posed.error.place_m));
  margin_quadratic_per_m =
      static_cast<float>(std::max(kSigmas * posed.error.quadratic_per_m, kLeastQuadratic_per_m));
  widening = static_cast<float>(kSigmasAside * posed.error.angle_rad);
  widening_m = static_cast<float>(kSigmasAside * posed.error.place_m);
  pyramid = &image;
}

}  // namespace roborun::stages
