#include "core/trajectory.hpp"

namespace roborun {

Trajectory Trajectory::hold(const Vector3& p_W, MonotonicTime start) noexcept {
  Trajectory result;
  result.start_time = start;
  result.hold_W = p_W;
  return result;
}

double Trajectory::duration_s() const noexcept {
  double total_s = 0.0;
  for (std::size_t i = 0; i < segment_count; ++i) total_s += segment[i].duration_s;
  return total_s;
}

Vector3 Trajectory::end_W() const noexcept { return segment_count == 0 ? hold_W : at_s(duration_s()).p_W; }

TrajectoryPoint Trajectory::at(MonotonicTime time) const noexcept { return at_s(seconds(time - start_time)); }

TrajectoryPoint Trajectory::at_s(double time_s) const noexcept {
  TrajectoryPoint point;
  if (segment_count == 0) {
    point.p_W = hold_W;
    return point;
  }
  // Written so that NaN falls through to the start.
  double local_s = time_s > 0.0 ? time_s : 0.0;
  std::size_t index = 0;
  while (index + 1 < segment_count && local_s > segment[index].duration_s) {
    local_s -= segment[index].duration_s;
    ++index;
  }
  const PolynomialSegment& s = segment[index];
  const bool outside = !(time_s >= 0.0) || local_s >= s.duration_s;
  if (local_s > s.duration_s) local_s = s.duration_s;

  for (std::size_t k = PolynomialSegment::kCoefficients; k-- > 0;) {
    point.j_W = point.j_W * local_s + 3.0 * point.a_W;
    point.a_W = point.a_W * local_s + 2.0 * point.v_W;
    point.v_W = point.v_W * local_s + point.p_W;
    point.p_W = point.p_W * local_s + s.coefficient[k];
  }
  if (outside && (index + 1 == segment_count || !(time_s >= 0.0))) {
    point.v_W.setZero();
    point.a_W.setZero();
    point.j_W.setZero();
  }
  return point;
}

}  // namespace roborun
