#include "stages/perception/swept_ball.hpp"

#include <array>
#include <cmath>

namespace roborun::stages {
namespace {

constexpr double kInside_m = 1e-6;  // a box that ends on the border of a cell does not touch the next one

/// From the straight piece to the box: never more than the true distance, and at most a 4,096th of the piece less.
double least_distance_m(const Aabb& box_W, const Vector3& a_W, const Vector3& way) noexcept {
  constexpr int kHalvings = 12;
  const auto offset = [&](double share) -> Vector3 {
    const Vector3 p_W = a_W + share * way;
    return p_W - p_W.cwiseMax(box_W.min_W).cwiseMin(box_W.max_W);
  };
  const double length_m = way.norm();
  if (!(length_m > 0.0)) return offset(0.0).norm();
  // The distance to a box is convex along a line: it falls until it rises.
  if (offset(0.0).dot(way) >= 0.0) return offset(0.0).norm();
  if (offset(1.0).dot(way) <= 0.0) return offset(1.0).norm();
  double low = 0.0, high = 1.0;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (offset(middle).dot(way) < 0.0 ? low : high) = middle;
  }
  return offset(low).norm() - (high - low) * length_m;
}

/// Cells of the view, `last` included.
struct Cells {
  Vector3 first, last;  ///< Whole numbers.
  [[nodiscard]] Aabb box_W(double cell_m) const noexcept {
    return {cell_m * first, cell_m * (last + Vector3::Ones())};
  }
};

}  // namespace

bool is_swept_free(const MapView& view, const Vector3& a_W, const Vector3& b_W, double radius_m,
                   std::uint64_t& lookups) noexcept {
  if (!is_finite(a_W) || !is_finite(b_W)) return false;
  const Vector3 r = Vector3::Constant(radius_m);
  const Aabb swept{a_W.cwiseMin(b_W) - r, a_W.cwiseMax(b_W) + r};
  if (view.is_free(swept, lookups)) return true;
  if (!(radius_m > 0.0) || !std::isfinite(radius_m)) return false;
  // Most of what is not free is so right here.
  constexpr double kInscribed = 0.577;  // the half edge of the cube in a ball of radius 1
  if (!view.is_free(Aabb::around(a_W, kInscribed * radius_m), lookups)) return false;
  if (a_W != b_W && !view.is_free(Aabb::around(b_W, kInscribed * radius_m), lookups)) return false;

  const double cell_m = view.cell_m();
  const Vector3 inside = Vector3::Constant(kInside_m);
  const auto index = [cell_m](double m) { return std::floor(m / cell_m); };
  constexpr std::size_t kDepth = 32;  // halvings of 1,024 cells in three directions
  std::array<Cells, kDepth> open;
  open[0] = {(swept.min_W + inside).unaryExpr(index), (swept.max_W - inside).unaryExpr(index)};
  std::size_t count = 1;
  for (int boxes = 0; count > 0; ++boxes) {
    Cells& cells = open[count - 1];
    const Aabb box_W = cells.box_W(cell_m);
    if (least_distance_m(box_W, a_W, b_W - a_W) >= radius_m ||
        view.is_free({box_W.min_W + inside, box_W.max_W - inside}, lookups)) {
      --count;
      continue;
    }
    int longest = 0;
    const Vector3 more = cells.last - cells.first;
    const double edge = more.maxCoeff(&longest);
    if (edge < 0.5 || boxes >= kMostBoxes || count == kDepth) return false;
    Cells upper = cells;
    upper.first[longest] += std::ceil(0.5 * edge);
    cells.last[longest] = upper.first[longest] - 1.0;
    open[count++] = upper;
  }
  return true;
}

}  // namespace roborun::stages
