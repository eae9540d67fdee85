#include "platform/flight/landing_site.hpp"

#include "core/geometry/math.hpp"

namespace roborun::flight {

std::optional<Vector3> landing_site_W(const stages::MapView& view, const core::Fence& fence,
                                      const Vector3& p_W, double ground_m, double radius_m) noexcept {
  constexpr int kRings = 6;
  constexpr int kDirections = 12;
  constexpr double kRing_m = 1.5;
  std::uint64_t lookups = 0;
  for (int ring = 0; ring <= kRings; ++ring) {
    for (int i = 0; i < (ring == 0 ? 1 : kDirections); ++i) {
      const core::SinCos angle = core::sin_cos(2.0 * core::kPi * i / kDirections);
      const Vector3 site_W = p_W + kRing_m * ring * Vector3(angle.cos, angle.sin, 0.0);
      const Aabb column_W{{site_W.x() - radius_m, site_W.y() - radius_m, ground_m + kCheckedAbove_m},
                          site_W + Vector3::Constant(radius_m)};
      if (fence.allows_over_ground(column_W) && view.is_free(column_W, lookups)) return site_W;
    }
  }
  return std::nullopt;
}

}  // namespace roborun::flight
