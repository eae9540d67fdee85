#include "platform/flight/surface_middle.hpp"

namespace roborun::flight {

std::optional<Vector3> surface_middle_W(const Vector3& place_W,
                                        std::span<const stages::CloudPoint> points) noexcept {
  constexpr double kApart_m = 1.6;
  constexpr int kLeast = 3;
  constexpr int kAround = 4;  // of a body's points one may lie around it
  Vector3 middle_W = place_W;
  // The place may be at the edge of the surface: the second look is around its middle.
  for (int look = 0; look < 2; ++look) {
    Vector3 sum_W = Vector3::Zero();
    int within = 0, around = 0;
    for (const stages::CloudPoint& point : points) {
      const double squared_m2 = (point.p_W - middle_W).squaredNorm();
      if (squared_m2 > kApart_m * kApart_m) continue;
      if (squared_m2 > kBodyReach_m * kBodyReach_m) {
        ++around;
        continue;
      }
      sum_W += point.p_W;
      ++within;
    }
    if (within < kLeast || (look > 0 && kAround * around > within)) return std::nullopt;
    middle_W = sum_W / within;
  }
  return middle_W;
}

}  // namespace roborun::flight
