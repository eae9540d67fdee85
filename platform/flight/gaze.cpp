#include "platform/flight/gaze.hpp"

#include <algorithm>

#include "core/geometry/math.hpp"

namespace roborun::flight {
namespace {

constexpr double kMoves_mps = 0.3;   // slower than that a direction means little
constexpr double kBeside_m = 0.3;    // the same of a place
constexpr double kAside_rad = 0.25;  // what is ahead stays in the view of a narrow camera (62 degrees), too

}  // namespace

void Gaze::turn_on() noexcept { yaw_rad_ = core::wrap_angle(yaw_rad_ + period_s_ * config_.yaw_rate_radps); }

void Gaze::turn_to(double target_rad) noexcept {
  const double most_rad = period_s_ * config_.yaw_rate_radps;
  const double left_rad = core::wrap_angle(target_rad - yaw_rad_);
  yaw_rad_ = core::wrap_angle(yaw_rad_ + std::clamp(left_rad, -most_rad, most_rad));
}

double Gaze::step(const Input& in) noexcept {
  if (!config_.follows) return yaw_rad_;
  const MonotonicTime ends = in.committed.ends();
  if (!ready_) {
    const bool turned = turned_rad_ >= 2.0 * core::kPi;
    if (!turned) {
      turn_on();
      turned_rad_ += period_s_ * config_.yaw_rate_radps;
    }
    ready_ = turned && in.now >= ends;
    still_since_ = in.now;
    return yaw_rad_;
  }
  const Vector3 v_W = in.committed.at(in.now + from_seconds(config_.lead_s)).v_W;
  const bool moves = core::hypot2(v_W.x(), v_W.y()) > kMoves_mps;
  if (moves || in.committed_number != number_ || in.now < ends) still_since_ = in.now;
  number_ = in.committed_number;
  const bool stuck = in.now - still_since_ >= from_seconds(config_.stuck_s);
  const Vector3 look_W = in.target ? Vector3(in.target->at_W - in.committed.at(in.now).p_W) : Vector3::Zero();
  const bool looks = !stuck && core::hypot2(look_W.x(), look_W.y()) > kBeside_m;
  const double look_rad = core::atan2(look_W.y(), look_W.x());
  const double flies_rad = core::atan2(v_W.y(), v_W.x());
  if (looks && !(moves && in.target->aside)) {
    turn_to(look_rad);
  } else if (moves) {
    const double aside_rad =
        looks ? std::clamp(core::wrap_angle(look_rad - flies_rad), -kAside_rad, kAside_rad) : 0.0;
    turn_to(core::wrap_angle(flies_rad + aside_rad));
  } else if (stuck) {
    turn_on();
  }
  return yaw_rad_;
}

}  // namespace roborun::flight
