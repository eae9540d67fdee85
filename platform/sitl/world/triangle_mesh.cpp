#include "platform/sitl/world/triangle_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "platform/sitl/world/ray_span.hpp"
#include "platform/sitl/world/voxel_grid.hpp"

namespace roborun::sitl {
namespace {

constexpr std::uint32_t kLeaf = 4;
/// Deeper than any tree that halves 2^32 triangles.
constexpr std::size_t kDeepestTree = 64;

Aabb box_of(const Triangle& t) noexcept {
  return {t[0].cwiseMin(t[1]).cwiseMin(t[2]), t[0].cwiseMax(t[1]).cwiseMax(t[2])};
}

double enter_m(const Aabb& box, const Vector3& o, const Vector3& d) noexcept {
  const RaySpan span = span_in(box, o, d);
  // A flat box and rounding must not lose a hit.
  return span.enter_m > span.leave_m + 1e-9 * (1.0 + span.enter_m) ? kInfinity : span.enter_m;
}

/// Moeller and Trumbore (1997). A border a little wider than the triangle: no ray slips between two of them.
double hit_m(const Triangle& t, const Vector3& o, const Vector3& d) noexcept {
  constexpr double kBorder = 1e-9;
  const Vector3 a = t[1] - t[0];
  const Vector3 b = t[2] - t[0];
  const Vector3 p = d.cross(b);
  const double determinant = a.dot(p);
  if (determinant == 0.0) return kInfinity;
  const Vector3 s = o - t[0];
  const double u = s.dot(p) / determinant;
  const Vector3 q = s.cross(a);
  const double v = d.dot(q) / determinant;
  const double at_m = b.dot(q) / determinant;
  return u >= -kBorder && v >= -kBorder && u + v <= 1.0 + kBorder && at_m >= 0.0 ? at_m : kInfinity;
}

double squared_distance_m2(const Aabb& box, const Vector3& p) noexcept {
  return (p - p.cwiseMax(box.min_W).cwiseMin(box.max_W)).squaredNorm();
}

}  // namespace

/// The region of the triangle's plane that the point is over decides: corner, edge or face.
/// Source: Ericson, Real-Time Collision Detection (2005), 5.1.5.
double squared_distance_m2(const Triangle& t, const Vector3& p) noexcept {
  const Vector3 ab = t[1] - t[0];
  const Vector3 ac = t[2] - t[0];
  const Vector3 ap = p - t[0];
  const double d1 = ab.dot(ap);
  const double d2 = ac.dot(ap);
  if (d1 <= 0.0 && d2 <= 0.0) return ap.squaredNorm();
  const Vector3 bp = p - t[1];
  const double d3 = ab.dot(bp);
  const double d4 = ac.dot(bp);
  if (d3 >= 0.0 && d4 <= d3) return bp.squaredNorm();
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return (ap - d1 / (d1 - d3) * ab).squaredNorm();
  const Vector3 cp = p - t[2];
  const double d5 = ab.dot(cp);
  const double d6 = ac.dot(cp);
  if (d6 >= 0.0 && d5 <= d6) return cp.squaredNorm();
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return (ap - d2 / (d2 - d6) * ac).squaredNorm();
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0)
    return (bp - (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (t[2] - t[1])).squaredNorm();
  const double whole = va + vb + vc;
  return (ap - vb / whole * ab - vc / whole * ac).squaredNorm();
}

TriangleMesh::TriangleMesh(std::vector<Triangle> triangles) {
  std::erase_if(triangles,
                [](const Triangle& t) { return !((t[1] - t[0]).cross(t[2] - t[0]).squaredNorm() > 0.0); });
  if (triangles.empty()) return;
  std::vector<std::uint32_t> order(triangles.size());
  std::iota(order.begin(), order.end(), 0U);
  node_.reserve(triangles.size());
  build(order, triangles);
  triangles_.reserve(order.size());
  for (const std::uint32_t i : order) triangles_.push_back(triangles[i]);
}

void TriangleMesh::build(std::vector<std::uint32_t>& order, const std::vector<Triangle>& all) {
  const auto middle_of = [&all](std::uint32_t i, int axis) {
    return all[i][0][axis] + all[i][1][axis] + all[i][2][axis];
  };
  struct Part {
    std::uint32_t first, count;
    std::uint32_t parent;  // whose second child it is
  };
  constexpr std::uint32_t kNobody = ~0U;
  std::vector<Part> waiting{{0, static_cast<std::uint32_t>(order.size()), kNobody}};
  while (!waiting.empty()) {
    const auto [first, count, parent] = waiting.back();
    waiting.pop_back();
    const auto self = static_cast<std::uint32_t>(node_.size());
    if (parent != kNobody) node_[parent].first = self;
    Aabb box = box_of(all[order[first]]);
    for (std::uint32_t i = first + 1; i < first + count; ++i) {
      const Aabb next = box_of(all[order[i]]);
      box = {box.min_W.cwiseMin(next.min_W), box.max_W.cwiseMax(next.max_W)};
    }
    node_.push_back({box, first, count});
    if (count <= kLeaf) continue;
    node_[self].count = 0;
    int axis = 0;
    (void)box.size().maxCoeff(&axis);
    const std::uint32_t half = count / 2;
    // Ties by number: the same tree on every machine.
    const auto part = std::span(order).subspan(first, count);
    std::nth_element(part.begin(), part.begin() + static_cast<std::ptrdiff_t>(half), part.end(),
                     [&](std::uint32_t x, std::uint32_t y) {
                       const double mx = middle_of(x, axis);
                       const double my = middle_of(y, axis);
                       return mx < my || (mx == my && x < y);
                     });
    // The first child is the next node: it is on top.
    waiting.push_back({first + half, count - half, self});
    waiting.push_back({first, half, kNobody});
  }
}

double TriangleMesh::hit_distance_m(const Vector3& origin_W, const Vector3& direction_W,
                                    double max_m) const noexcept {
  if (node_.empty()) return kInfinity;
  double best_m = max_m;
  bool hit = false;
  std::array<std::uint32_t, kDeepestTree> waiting;
  std::size_t depth = 0;
  waiting[depth++] = 0;
  while (depth > 0) {
    const std::uint32_t at = waiting[--depth];
    const Node& node = node_[at];
    if (enter_m(node.box, origin_W, direction_W) > best_m) continue;
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const double at_m = hit_m(triangles_[i], origin_W, direction_W);
      if (at_m > best_m) continue;
      best_m = at_m;
      hit = true;
    }
    if (node.count > 0) continue;
    // The nearer child is looked at first.
    const bool swap = enter_m(node_[at + 1].box, origin_W, direction_W) >
                      enter_m(node_[node.first].box, origin_W, direction_W);
    waiting[depth++] = swap ? at + 1 : node.first;
    waiting[depth++] = swap ? node.first : at + 1;
  }
  return hit ? best_m : kInfinity;
}

double TriangleMesh::clearance_m(const Vector3& p_W, double cap_m) const noexcept {
  if (node_.empty()) return cap_m;
  double best_m2 = cap_m * cap_m;
  std::array<std::uint32_t, kDeepestTree> waiting;
  std::size_t depth = 0;
  waiting[depth++] = 0;
  while (depth > 0) {
    const std::uint32_t at = waiting[--depth];
    const Node& node = node_[at];
    if (squared_distance_m2(node.box, p_W) >= best_m2) continue;
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i)
      best_m2 = std::min(best_m2, squared_distance_m2(triangles_[i], p_W));
    if (node.count > 0) continue;
    const bool swap =
        squared_distance_m2(node_[at + 1].box, p_W) > squared_distance_m2(node_[node.first].box, p_W);
    waiting[depth++] = swap ? at + 1 : node.first;
    waiting[depth++] = swap ? node.first : at + 1;
  }
  return std::min(cap_m, std::sqrt(best_m2));
}

}  // namespace roborun::sitl
