#include "core/geometry/fence.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/random/counter_rng.hpp"
#include "tests/support/names.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::core {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Whole numbers of 2^-10 m: the reference calculates with them, without rounding.
struct Node {
  std::int64_t x{};
  std::int64_t y{};
};
FencePoint metres(const Node& n) {
  return {static_cast<double>(n.x) / 1024.0, static_cast<double>(n.y) / 1024.0};
}
using Wide = std::int64_t;  // coordinates below 2^26: products below 2^53

Wide cross(const Node& a, const Node& b, const Node& c) {
  return Wide{b.x - a.x} * (c.y - a.y) - Wide{b.y - a.y} * (c.x - a.x);
}
bool on_edge(const Node& a, const Node& b, const Node& p) {
  return cross(a, b, p) == 0 && Wide{p.x - a.x} * (p.x - b.x) + Wide{p.y - a.y} * (p.y - b.y) <= 0;
}
/// Slow and exact: parity of the crossings of a ray to the right. On an edge: neither inside nor outside.
enum class Where { kInside, kOutside, kEdge };
Where where(const std::vector<Node>& polygon, const Node& p) {
  bool odd = false;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    Node a = polygon[i];
    Node b = polygon[(i + 1) % polygon.size()];
    if (on_edge(a, b, p)) return Where::kEdge;
    if (a.y > b.y) std::swap(a, b);
    if (a.y <= p.y && p.y < b.y && cross(a, b, p) > 0) odd = !odd;
  }
  return odd ? Where::kInside : Where::kOutside;
}
/// The edge meets the closed rectangle, by clipping its parameter (exact, as fractions).
bool clips(const Node& a, const Node& b, const Node& low, const Node& high) {
  // Largest lower and smallest upper bound of t in [0, 1], as numerator / denominator with denominator > 0.
  Wide from = 0, from_d = 1, to = 1, to_d = 1;
  const auto cut = [&](std::int64_t start, std::int64_t end, std::int64_t lower, std::int64_t upper) {
    const Wide step = end - start;
    if (step == 0) return lower <= start && start <= upper;
    Wide t0 = lower - start, t1 = upper - start, d = step;
    if (d < 0) {
      t0 = -t0, t1 = -t1, d = -d;
      std::swap(t0, t1);
    }
    if (t0 * from_d > from * d) from = t0, from_d = d;
    if (t1 * to_d < to * d) to = t1, to_d = d;
    return true;
  };
  return cut(a.x, b.x, low.x, high.x) && cut(a.y, b.y, low.y, high.y) && from * to_d <= to * from_d;
}

Node random_node(CounterRng& rng, std::int64_t range) {
  const auto span = static_cast<std::uint64_t>(2 * range + 1);
  const auto x = static_cast<std::int64_t>(rng.below(span)) - range;
  const auto y = static_cast<std::int64_t>(rng.below(span)) - range;
  return {x, y};
}

/// A random polygon that the fence accepts; small ranges make vertices and edges be hit often.
std::vector<Node> random_polygon(CounterRng& rng, std::int64_t range, FenceSide side, Fence& fence) {
  for (;;) {
    std::vector<Node> nodes;
    std::vector<FencePoint> points;
    const std::size_t count = 3 + static_cast<std::size_t>(rng.below(6));
    for (std::size_t i = 0; i < count; ++i) {
      nodes.push_back(random_node(rng, range));
      points.push_back(metres(nodes.back()));
    }
    fence = {};
    if (fence.add_polygon(side, points) == FenceFault::kNone) return nodes;
  }
}

TEST(Fence, DecidesAMillionPointsAsTheSlowExactReference) {
  CounterRng rng(31);
  std::array<int, 3> seen{};
  for (int round = 0; round < 1000; ++round) {
    const std::int64_t range = round % 2 == 0 ? 6 : 16'000 * 1024;
    const FenceSide side = round % 4 < 2 ? FenceSide::kKeepIn : FenceSide::kKeepOut;
    Fence fence;
    const std::vector<Node> polygon = random_polygon(rng, range, side, fence);
    for (int i = 0; i < 1000; ++i) {
      Node p = random_node(rng, range + range / 8 + 1);
      if (i % 10 == 0) p = polygon[static_cast<std::size_t>(rng.below(polygon.size()))];
      const Where truth = where(polygon, p);
      ++seen[static_cast<std::size_t>(truth)];
      const bool wanted = truth == (side == FenceSide::kKeepIn ? Where::kInside : Where::kOutside);
      const FencePoint m = metres(p);
      ASSERT_EQ(fence.allows(Vector3(m.x_m, m.y_m, 5.0)), wanted) << "round " << round << ", point " << i;
    }
  }
  for (const int count : seen) EXPECT_GT(count, 10000);
}

TEST(Fence, DecidesBoxesAsTheSlowExactReference) {
  CounterRng rng(32);
  int allowed = 0;
  for (int round = 0; round < 2000; ++round) {
    const std::int64_t range = round % 2 == 0 ? 8 : 500 * 1024;
    const FenceSide side = round % 4 < 2 ? FenceSide::kKeepIn : FenceSide::kKeepOut;
    Fence fence;
    const std::vector<Node> polygon = random_polygon(rng, range, side, fence);
    for (int i = 0; i < 100; ++i) {
      const Node low = random_node(rng, range);
      const std::int64_t size = range / 4 + 1;
      const Node high{low.x + static_cast<std::int64_t>(rng.below(static_cast<std::uint64_t>(size))),
                      low.y + static_cast<std::int64_t>(rng.below(static_cast<std::uint64_t>(size)))};
      bool touched = false;
      for (std::size_t k = 0; k < polygon.size(); ++k)
        touched = touched || clips(polygon[k], polygon[(k + 1) % polygon.size()], low, high);
      const bool wanted =
          !touched && where(polygon, low) == (side == FenceSide::kKeepIn ? Where::kInside : Where::kOutside);
      const FencePoint a = metres(low);
      const FencePoint b = metres(high);
      ASSERT_EQ(fence.allows(Aabb{{a.x_m, a.y_m, 1.0}, {b.x_m, b.y_m, 2.0}}), wanted) << round << ", " << i;
      allowed += wanted ? 1 : 0;
    }
  }
  EXPECT_GT(allowed, 10000);
}

/// Closed segments have a point in common: an end of one lies on the other, or they cross within both
/// (0 < t, u < 1 by Cramer's rule).
bool meet(const Node& a, const Node& b, const Node& c, const Node& d) {
  if (on_edge(a, b, c) || on_edge(a, b, d) || on_edge(c, d, a) || on_edge(c, d, b)) return true;
  const Node r{b.x - a.x, b.y - a.y}, s{d.x - c.x, d.y - c.y}, q{c.x - a.x, c.y - a.y};
  Wide det = r.x * s.y - r.y * s.x, t = q.x * s.y - q.y * s.x, u = q.x * r.y - q.y * r.x;
  if (det < 0) det = -det, t = -t, u = -u;
  return det > 0 && 0 < t && t < det && 0 < u && u < det;
}
bool is_simple(const std::vector<Node>& p) {
  const std::size_t n = p.size();
  const auto same = [](const Node& a, const Node& b) { return a.x == b.x && a.y == b.y; };
  for (std::size_t i = 0; i < n; ++i) {
    const Node &a = p[i], &b = p[(i + 1) % n];
    if (same(a, b) || on_edge(a, b, p[(i + 2) % n]) || on_edge(b, p[(i + 2) % n], a)) return false;
    for (std::size_t k = 0; k < n; ++k) {
      if (k == i || (k + 1) % n == i || (i + 1) % n == k) continue;
      if (meet(a, b, p[k], p[(k + 1) % n])) return false;
    }
  }
  return true;
}

TEST(Fence, RefusesExactlyThePolygonsThatTouchThemselves) {
  CounterRng rng(34);
  int simple = 0;
  constexpr int kRounds = 200'000;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<Node> nodes;
    std::vector<FencePoint> points;
    const std::size_t count = 3 + static_cast<std::size_t>(rng.below(4));
    for (std::size_t i = 0; i < count; ++i) {
      nodes.push_back(random_node(rng, 2));
      points.push_back({static_cast<double>(nodes.back().x), static_cast<double>(nodes.back().y)});
    }
    Fence fence;
    const bool wanted = is_simple(nodes);
    ASSERT_EQ(fence.add_polygon(FenceSide::kKeepIn, points),
              wanted ? FenceFault::kNone : FenceFault::kTouchesItself)
        << "round " << round;
    simple += wanted ? 1 : 0;
  }
  EXPECT_GT(simple, kRounds / 10);
  EXPECT_LT(simple, kRounds * 9 / 10);
}

TEST(Fence, LooksAtNoPointBehindThoseOfAPolygon) {
  const std::array<FencePoint, 4> points{{{0, 0}, {1, 0}, {0, 1}, {1, 0}}};
  Fence fence;
  EXPECT_EQ(fence.add_polygon(FenceSide::kKeepIn, std::span(points).first(3)), FenceFault::kNone);
  EXPECT_EQ(fence.areas()[0].count, 3U);
}

TEST(Fence, ReachesToItsFarthestPoint) {
  constexpr double kEnd_m = 16000.0, kBeyond_m = 16000.5;
  const auto polygon = [](double x_m, double y_m) {
    Fence fence;
    return fence.add_polygon(FenceSide::kKeepIn, std::array<FencePoint, 3>{{{0, 0}, {x_m, 0}, {0, y_m}}});
  };
  EXPECT_EQ(polygon(kEnd_m, -kEnd_m), FenceFault::kNone);
  EXPECT_EQ(polygon(kBeyond_m, 1.0), FenceFault::kNotFinite);
  EXPECT_EQ(polygon(1.0, -kBeyond_m), FenceFault::kNotFinite);
  const auto circle = [](double x_m, double y_m, double radius_m) {
    Fence fence;
    return fence.add_circle(FenceSide::kKeepIn, {x_m, y_m}, radius_m);
  };
  EXPECT_EQ(circle(kEnd_m, -kEnd_m, kEnd_m), FenceFault::kNone);
  EXPECT_EQ(circle(kBeyond_m, 0.0, 1.0), FenceFault::kNotFinite);
  EXPECT_EQ(circle(0.0, kBeyond_m, 1.0), FenceFault::kNotFinite);
  EXPECT_EQ(circle(0.0, 0.0, kBeyond_m), FenceFault::kNotFinite);
  Fence heights;
  EXPECT_EQ(heights.set_altitude(0.0, kBeyond_m), FenceFault::kNotFinite);
  EXPECT_EQ(heights.set_altitude(-kBeyond_m, 0.0), FenceFault::kNotFinite);
  EXPECT_FALSE(heights.limits_altitude());
  EXPECT_EQ(heights.set_altitude(-kEnd_m, kEnd_m), FenceFault::kNone);
}

TEST(Fence, JudgesBoxesUpToTwiceAsFar) {
  Fence fence;
  ASSERT_EQ(fence.add_circle(FenceSide::kKeepOut, {0, 0}, 0.5), FenceFault::kNone);
  const auto allows = [&fence](double x0, double y0, double x1, double y1) {
    return fence.allows(Aabb{{x0, y0, 1.0}, {x1, y1, 2.0}});
  };
  constexpr double kEnd_m = 32000.0, kBeyond_m = 32001.0;
  EXPECT_TRUE(allows(-kEnd_m, -kEnd_m, -9.0, -9.0));
  EXPECT_TRUE(allows(9.0, 9.0, kEnd_m, kEnd_m));
  EXPECT_FALSE(allows(-kBeyond_m, 5.0, -9.0, 9.0));
  EXPECT_FALSE(allows(5.0, -kBeyond_m, 9.0, -9.0));
  EXPECT_FALSE(allows(5.0, 5.0, kBeyond_m, 9.0));
  EXPECT_FALSE(allows(5.0, 5.0, 9.0, kBeyond_m));
  EXPECT_FALSE(allows(5.0, 9.0, 6.0, 5.0)) << "an empty box";
  EXPECT_FALSE(allows(0.2, 0.2, 9.0, 9.0)) << "a corner in the small circle";
  EXPECT_TRUE(allows(0.4, 0.4, 9.0, 9.0)) << "past it at 0.57 m";
}

TEST(Fence, WithoutAnAreaAllowsAnyPlaceThatIsOne) {
  Fence fence;
  EXPECT_TRUE(fence.allows_over_ground(Aabb{{-1e6, -1e6, 0.0}, {1e6, 1e6, 1.0}}));
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(fence.allows_over_ground(Aabb{{-kInfinity, 0.0, 0.0}, {1.0, 1.0, 1.0}}));
  EXPECT_FALSE(fence.allows_over_ground(Aabb{{0.0, 0.0, 0.0}, {1.0, kInfinity, 1.0}}));
  EXPECT_FALSE(fence.allows_over_ground(Aabb{{kNaN, 0.0, 0.0}, {1.0, 1.0, 1.0}}));
}

// Both axes, and a centre that is not on one of them.
TEST(Fence, CirclesAreRound) {
  const auto allows = [](FenceSide side, double x0, double y0, double x1, double y1) {
    Fence fence;
    EXPECT_EQ(fence.add_circle(side, {20.0, 10.0}, 5.0), FenceFault::kNone);
    EXPECT_EQ(fence.areas()[0].count, 1U);
    return fence.allows(Aabb{{x0, y0, 1.0}, {x1, y1, 2.0}});
  };
  for (const int turn : {0, 1, 2, 3}) {
    const double c = turn == 0 ? 1.0 : turn == 2 ? -1.0 : 0.0, s = turn == 1 ? 1.0 : turn == 3 ? -1.0 : 0.0;
    const auto box = [&](FenceSide side, double u0, double v0, double u1, double v1) {
      const double xa = c * u0 - s * v0, xb = c * u1 - s * v1, ya = s * u0 + c * v0, yb = s * u1 + c * v1;
      return allows(side, 20.0 + std::min(xa, xb), 10.0 + std::min(ya, yb), 20.0 + std::max(xa, xb),
                    10.0 + std::max(ya, yb));
    };
    EXPECT_FALSE(box(FenceSide::kKeepIn, -1.0, 3.0, 3.0, 4.0)) << turn;
    EXPECT_TRUE(box(FenceSide::kKeepIn, -1.0, 3.0, 2.9, 4.0)) << turn;
    EXPECT_FALSE(box(FenceSide::kKeepOut, 3.0, 4.0, 9.0, 9.0)) << turn;
    EXPECT_TRUE(box(FenceSide::kKeepOut, 3.1, 4.0, 9.0, 9.0)) << turn;
    EXPECT_FALSE(box(FenceSide::kKeepOut, -9.0, 4.9, 9.0, 9.0)) << turn;
    EXPECT_TRUE(box(FenceSide::kKeepOut, -9.0, 5.1, 9.0, 9.0)) << turn;
  }
}

TEST(Fence, CirclesKeepInAndOut) {
  Fence in;
  ASSERT_EQ(in.add_circle(FenceSide::kKeepIn, {10.0, 0.0}, 5.0), FenceFault::kNone);
  EXPECT_TRUE(in.allows(Vector3(14.9, 0.0, 0.0)));
  EXPECT_FALSE(in.allows(Vector3(15.0, 0.0, 0.0))) << "the line itself is forbidden";
  EXPECT_FALSE(in.allows(Aabb{{9.0, 3.0, 0.0}, {13.5, 4.0, 1.0}}))
      << "one corner at (3.5, 4) from the centre";
  EXPECT_TRUE(in.allows(Aabb{{9.0, 3.0, 0.0}, {12.9, 4.0, 1.0}}));
  Fence out;
  ASSERT_EQ(out.add_circle(FenceSide::kKeepOut, {10.0, 0.0}, 5.0), FenceFault::kNone);
  EXPECT_FALSE(out.allows(Vector3(15.0, 0.0, 0.0)));
  EXPECT_TRUE(out.allows(Vector3(15.1, 0.0, 0.0)));
  EXPECT_FALSE(out.allows(Aabb{{0.0, -10.0, 0.0}, {20.0, 10.0, 1.0}})) << "around the whole circle";
  EXPECT_TRUE(out.allows(Aabb{{13.6, 3.6, 0.0}, {20.0, 10.0, 1.0}})) << "past it at 5.09 m";
}

TEST(Fence, HeightsHoldForWholeBoxes) {
  Fence fence;
  ASSERT_EQ(fence.set_altitude(2.0, 10.0), FenceFault::kNone);
  EXPECT_FALSE(fence.empty());
  EXPECT_TRUE(fence.allows(Aabb{{0, 0, 2.1}, {1, 1, 9.9}}));
  EXPECT_FALSE(fence.allows(Aabb{{0, 0, 2.0}, {1, 1, 3.0}}));
  EXPECT_FALSE(fence.allows(Aabb{{0, 0, 9.0}, {1, 1, 10.0}}));
  EXPECT_TRUE(fence.allows_over_ground(Aabb{{0, 0, 0.0}, {1, 1, 3.0}}));
}

TEST(Fence, AnAreaMoreOnlyTakesSpaceAway) {
  CounterRng rng(33);
  Fence fence;
  const std::array<FencePoint, 4> yard{{{-50, -50}, {50, -50}, {50, 50}, {-50, 50}}};
  ASSERT_EQ(fence.add_polygon(FenceSide::kKeepIn, yard), FenceFault::kNone);
  for (int area = 0; area < 10; ++area) {
    const Fence before = fence;
    ASSERT_EQ(fence.add_circle(area % 2 == 0 ? FenceSide::kKeepOut : FenceSide::kKeepIn,
                               {rng.uniform(-20, 20), rng.uniform(-20, 20)}, area % 2 == 0 ? 5.0 : 60.0),
              FenceFault::kNone);
    for (int i = 0; i < 2000; ++i) {
      const double x_m = rng.uniform(-60, 60);
      const double y_m = rng.uniform(-60, 60);
      if (fence.allows(Vector3(x_m, y_m, 0.0))) {
        ASSERT_TRUE(before.allows(Vector3(x_m, y_m, 0.0)));
      }
    }
  }
}

TEST(Fence, RefusesBadAreasByNameAndStaysAsItWas) {
  using P = std::vector<FencePoint>;
  const auto add = [](const P& points) {
    Fence fence;
    const FenceFault fault = fence.add_polygon(FenceSide::kKeepIn, points);
    EXPECT_EQ(fence.empty(), fault != FenceFault::kNone);
    return fault;
  };
  EXPECT_EQ(add({}), FenceFault::kTooFewPoints);
  EXPECT_EQ(add({{0, 0}}), FenceFault::kTooFewPoints);
  EXPECT_EQ(add({{0, 0}, {1, 0}}), FenceFault::kTooFewPoints);
  EXPECT_EQ(add({{0, 0}, {1, 0}, {0, 1}}), FenceFault::kNone);
  EXPECT_EQ(add({{0, 0}, {1, 0}, {0, kNaN}}), FenceFault::kNotFinite);
  EXPECT_EQ(add({{0, 0}, {1e9, 0}, {0, 1}}), FenceFault::kNotFinite);
  EXPECT_EQ(add({{0, 0}, {2, 2}, {2, 0}, {0, 2}}), FenceFault::kTouchesItself) << "a bow tie";
  EXPECT_EQ(add({{0, 0}, {1, 0}, {2, 0}}), FenceFault::kTouchesItself) << "no area";
  EXPECT_EQ(add({{0, 0}, {0, 0}, {1, 0}, {0, 1}}), FenceFault::kTouchesItself) << "a point twice";
  EXPECT_EQ(add({{0, 0}, {4, 0}, {4, 4}, {2, 0}, {0, 4}}), FenceFault::kTouchesItself) << "a tip on an edge";
  EXPECT_EQ(add({{0, 0}, {2, 0}, {4, 0}, {4, 4}, {0, 4}}), FenceFault::kNone) << "a point on a straight side";
  P most;
  for (std::size_t i = 0; i < Fence::kMaxPoints; ++i) {
    const double x_m = static_cast<double>(i) - 15.5;
    most.push_back({x_m, x_m * x_m});  // a parabola
  }
  EXPECT_EQ(add(most), FenceFault::kNone);
  EXPECT_EQ(add(P(Fence::kMaxPoints + 1, {0, 0})), FenceFault::kTooManyPoints);
  Fence fence;
  EXPECT_EQ(fence.add_circle(FenceSide::kKeepIn, {0, 0}, 0.0), FenceFault::kRadius);
  EXPECT_EQ(fence.add_circle(FenceSide::kKeepIn, {0, 0}, kNaN), FenceFault::kNotFinite);
  EXPECT_EQ(fence.set_altitude(5.0, 5.0), FenceFault::kAltitude);
  EXPECT_EQ(fence.set_altitude(kNaN, 5.0), FenceFault::kNotFinite);
  EXPECT_TRUE(fence.empty());
  for (std::size_t i = 0; i < Fence::kMaxAreas; ++i)
    EXPECT_EQ(fence.add_circle(FenceSide::kKeepIn, {0, 0}, 9.0), FenceFault::kNone);
  EXPECT_EQ(fence.add_circle(FenceSide::kKeepIn, {0, 0}, 9.0), FenceFault::kTooManyAreas);
  EXPECT_EQ(fence.add_polygon(FenceSide::kKeepIn, P{{0, 0}, {1, 0}, {0, 1}}), FenceFault::kTooManyAreas);
  EXPECT_EQ(fence.areas().size(), Fence::kMaxAreas);
}

TEST(Fence, FaultsSayWhatWouldBeRight) {
  test::expect_names<FenceFault>(
      {"nothing is wrong", "must be finite numbers of at most 16000 m", "must have at least three points",
       "must have at most 32 points", "must not touch or cross itself, and no two points may be equal",
       "must be above 0", "the upper limit must be above the lower one", "must be at most 16 areas"});
}

TEST(Fence, NaNAndTheFarAwayAreNeverPermittedAndNothingAllocates) {
  Fence fence;
  ASSERT_EQ(fence.add_circle(FenceSide::kKeepOut, {0, 0}, 1.0), FenceFault::kNone);
  const test::NoAllocScope scope;
  EXPECT_FALSE(fence.allows(Vector3(kNaN, 5.0, 5.0)));
  EXPECT_FALSE(fence.allows(Vector3(5.0, 5.0, kNaN)));
  EXPECT_FALSE(fence.allows(Vector3(1e6, 5.0, 5.0)));
  EXPECT_FALSE(fence.allows(Aabb{{5, 5, 5}, {4, 5, 5}})) << "an empty box";
  EXPECT_EQ(scope.count(), 0U);
}

}  // namespace
}  // namespace roborun::core
