/// Where the vehicle may be: areas to stay in, areas to stay out of, and two heights.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "core/geometry/vector.hpp"
#include "core/memory/static_vector.hpp"

namespace roborun::core {

struct FencePoint {
  double x_m{};
  double y_m{};
};

enum class FenceSide : std::uint8_t { kKeepIn, kKeepOut };

/// Why an area was refused.
enum class FenceFault : std::uint8_t {
  kNone,
  kNotFinite,     ///< NaN or beyond 16,000 m.
  kTooFewPoints,  ///< Fewer than three.
  kTooManyPoints,
  kTouchesItself,  ///< Two edges cross or touch, two points are equal, or an edge folds back.
  kRadius,         ///< Not above 0.
  kAltitude,       ///< The upper limit is not above the lower one.
  kTooManyAreas,
};
/// What would be right, for one line of text.
[[nodiscard]] const char* to_string(FenceFault fault) noexcept;

/// Vertical walls over polygons and circles, a floor and a ceiling. Permitted is what lies strictly inside of
/// every area to stay in, strictly outside of every area to stay out of, and strictly between the heights: an
/// area more only takes space away, and the line itself is forbidden. Decisions on polygons are exact (no
/// rounding) for coordinates that are multiples of 2^-10 m. An area that is refused changes nothing.
class Fence {
 public:
  static constexpr std::size_t kMaxAreas = 16;
  static constexpr std::size_t kMaxPoints = 32;
  struct Area {
    FenceSide side{FenceSide::kKeepIn};
    double radius_m{0.0};  ///< Above 0: a circle around point 0.
    std::size_t count{0};
    std::array<FencePoint, kMaxPoints> point{};
  };

  /// Points in either direction, the last one is joined to the first. O(points^2), for start-up.
  [[nodiscard]] FenceFault add_polygon(FenceSide side, std::span<const FencePoint> points) noexcept;
  [[nodiscard]] FenceFault add_circle(FenceSide side, const FencePoint& center, double radius_m) noexcept;
  [[nodiscard]] FenceFault set_altitude(double lowest_m, double highest_m) noexcept;

  [[nodiscard]] bool empty() const noexcept { return areas_.empty() && !limits_altitude(); }
  /// What was added so far, in this order.
  [[nodiscard]] std::span<const Area> areas() const noexcept { return {areas_.begin(), areas_.size()}; }
  [[nodiscard]] bool limits_altitude() const noexcept {
    return lowest_m_ != -kNoLimit || highest_m_ != kNoLimit;
  }
  [[nodiscard]] double lowest_m() const noexcept { return lowest_m_; }
  [[nodiscard]] double highest_m() const noexcept { return highest_m_; }
  /// False for NaN. RT-safe, as the next two: O(points), no allocation.
  [[nodiscard]] bool allows(const Vector3& p_W) const noexcept { return allows(Aabb{p_W, p_W}); }
  /// True if every point of the closed box is permitted; false for an empty or non-finite box.
  [[nodiscard]] bool allows(const Aabb& box_W) const noexcept {
    return box_W.min_W.z() > lowest_m_ && box_W.max_W.z() < highest_m_ && allows_over_ground(box_W);
  }
  /// The same without the heights.
  [[nodiscard]] bool allows_over_ground(const Aabb& box_W) const noexcept;

 private:
  static constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  struct Rectangle {
    double x0_m{}, x1_m{}, y0_m{}, y1_m{};
  };
  [[nodiscard]] static bool circle_allows(const Area& area, const Rectangle& r) noexcept;
  [[nodiscard]] static bool polygon_allows(const Area& area, const Rectangle& r) noexcept;

  StaticVector<Area, kMaxAreas> areas_{};
  double lowest_m_{-kNoLimit};
  double highest_m_{kNoLimit};
};

}  // namespace roborun::core
