/// A small analytic scene for the tests of perception: a floor, walls and pillars made of boxes, seen by one
/// camera or six.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "stages/perception/occupancy_map.hpp"

namespace roborun::test {

struct Scene {
  std::vector<Aabb> solid;
  std::vector<std::vector<float>> image = std::vector<std::vector<float>>(6);

  [[nodiscard]] bool occupied(const Vector3& p) const {
    for (const Aabb& b : solid) {
      if (b.contains(p)) return true;
    }
    return false;
  }
  [[nodiscard]] double hit_m(const Vector3& o, const Vector3& d) const {
    double best = std::numeric_limits<double>::infinity();
    for (const Aabb& b : solid) {
      double enter = 0.0, leave = best;
      for (int i = 0; i < 3; ++i) {
        if (d[i] == 0.0) {
          if (o[i] < b.min_W[i] || o[i] > b.max_W[i]) leave = -1.0;
          continue;
        }
        const double t0 = (b.min_W[i] - o[i]) / d[i], t1 = (b.max_W[i] - o[i]) / d[i];
        enter = std::max(enter, std::min(t0, t1));
        leave = std::min(leave, std::max(t0, t1));
      }
      if (enter <= leave) best = std::min(best, enter);
    }
    return best;
  }
  /// Images of the six cameras at p_W, body axes along the world's; square if `rows` is 0. The spans live
  /// until the next call.
  [[nodiscard]] std::vector<stages::PosedDepthFrame> look(const Vector3& p_W, int pixels = 64,
                                                          float range_m = 20.0F, int rows = 0) {
    if (rows == 0) rows = pixels;
    const std::array<std::array<double, 9>, 6> mount{{{1, 0, 0, 0, 1, 0, 0, 0, 1},
                                                      {0, -1, 0, 1, 0, 0, 0, 0, 1},
                                                      {-1, 0, 0, 0, -1, 0, 0, 0, 1},
                                                      {0, 1, 0, -1, 0, 0, 0, 0, 1},
                                                      {0, 0, -1, 0, 1, 0, 1, 0, 0},
                                                      {0, 0, 1, 0, 1, 0, -1, 0, 0}}};
    std::vector<stages::PosedDepthFrame> frames(6);
    for (std::size_t c = 0; c < 6; ++c) {
      for (int i = 0; i < 9; ++i) frames[c].X_WC.R_RT(i / 3, i % 3) = mount[c][static_cast<std::size_t>(i)];
      frames[c].X_WC.p_RT = p_W;
      image[c].clear();
      for (int v = 0; v < rows; ++v) {
        for (int u = 0; u < pixels; ++u) {
          const Vector3 ray(1.0, 1.0 - (u + 0.5) * 2.0 / pixels, 1.0 - (v + 0.5) * 2.0 / rows);
          const double depth = hit_m(p_W, frames[c].X_WC.R_RT * ray);
          image[c].push_back(depth < static_cast<double>(range_m) ? static_cast<float>(depth)
                                                                  : std::numeric_limits<float>::infinity());
        }
      }
      frames[c].frame.width = static_cast<std::uint16_t>(pixels);
      frames[c].frame.height = static_cast<std::uint16_t>(rows);
      frames[c].frame.tan_half_width = frames[c].frame.tan_half_height = 1.0F;
      frames[c].frame.range_m = range_m;
      frames[c].frame.depth_m = image[c];
    }
    return frames;
  }
};

}  // namespace roborun::test
