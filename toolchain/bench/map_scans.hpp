/// The scans of the map benchmark: six noiseless depth cameras among pillars, a vehicle that moves 1 m a scan.
#pragma once

#include <array>
#include <vector>

#include "core/geometry/vector.hpp"
#include "platform/sitl/world/world.hpp"
#include "stages/perception/occupancy_map.hpp"

namespace roborun::bench {

/// 60 pillars of 0.8 to 2.4 m diameter, 20 m high, within 45 m of the origin, none within 2.5 m of the way along x.
[[nodiscard]] const sitl::World& pillar_world();
/// Ground or pillar.
[[nodiscard]] bool is_solid(const sitl::World& world, const Vector3& p_W);

/// Six images of one instant. Owns the pixels that frames() points to: neither copied nor moved.
class Scan {
 public:
  /// The n-th scan: the vehicle at (n, 0.2, 5) m, turned and tilted a little, so that nothing is aligned with the cells.
  Scan(const sitl::World& world, int n, int pixels, double range_m);
  Scan(const Scan&) = delete;
  Scan& operator=(const Scan&) = delete;

  [[nodiscard]] const std::vector<stages::PosedDepthFrame>& frames() const noexcept { return frames_; }
  [[nodiscard]] const Vector3& p_WB() const noexcept { return p_WB_; }
  [[nodiscard]] double range_m() const noexcept { return range_m_; }
  /// End points of all pixels, as they are (cell_m 0) or one mean a cell. Pixels without a return end 5 % beyond
  /// sqrt(3) ranges, where stock insertion with a maximum range only clears.
  [[nodiscard]] std::vector<Vector3> points_W(double cell_m) const;

 private:
  Vector3 p_WB_;
  double range_m_;
  std::array<std::vector<float>, 6> image_{};
  std::vector<stages::PosedDepthFrame> frames_;
};

}  // namespace roborun::bench
