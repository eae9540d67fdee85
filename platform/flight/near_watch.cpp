#include "platform/flight/near_watch.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/camera_pose.hpp"
#include "platform/flight/flight_control.hpp"
#include "stages/perception/frame_guard.hpp"

namespace roborun::flight {
namespace {

constexpr double kReacts_s = 0.1;  // exposure to motors
constexpr double kRoom_m = 0.3;    // before what is met
constexpr double kStands_mps = 0.2;
constexpr double kWalk_s = 0.01;
constexpr int kMostWalks = 1000;
constexpr double kSigmasOff = 2.0;
constexpr std::size_t kEnough = 3;       // pixels
constexpr std::size_t kAtOnce = 16'384;  // pixels a minor frame
constexpr Nanos kAgo{10'000'000};        // where it is: the newest state may be of this very frame
constexpr double kAlongCos = 0.5, kAlongSin = 0.8660254037844386;  // of 60 degrees

}  // namespace

NearWatch::NearWatch(const Config& config, std::span<firmware_if::DepthCamera* const> cameras) noexcept
    : config_(config) {
  for (firmware_if::DepthCamera* camera : cameras) (void)cameras_.push_back(camera);
}

bool NearWatch::way_W(const Input& in, Way& way) const noexcept {
  const double begin_s = seconds(in.now - in.committed.start_time), end_s = in.committed.duration_s();
  if (in.committed.at_s(begin_s).v_W.norm() < kStands_mps) return false;
  // As FlightControl::brake(): along the path, at a rate that falls; then on for the room.
  double at_s = begin_s + kReacts_s, rate = 1.0, room_m = kRoom_m;
  for (int walks = 0; walks < kMostWalks && room_m > 0.0 && at_s < end_s; ++walks) {
    const double speed_mps = in.committed.at_s(at_s).v_W.norm();
    rate -= lost_rate(config_.braking_mps2, speed_mps, kWalk_s);
    if (rate <= 0.0) room_m -= kWalk_s * speed_mps;
    at_s += kWalk_s * (rate > 0.0 ? rate : 1.0);
  }
  const double step_s = (at_s - begin_s) / static_cast<double>(way.size() - 1);
  double next_s = begin_s;
  for (Vector3& p_W : way) {
    p_W = in.committed.at_s(next_s).p_W;
    next_s += step_s;
  }
  return true;
}

void NearWatch::take_image(const Input& in) noexcept {
  camera_ = (camera_ + 1) % cameras_.size();
  if (((in.refused >> camera_) & 1U) != 0 || in.now - read_[camera_] < kEvery) return;
  firmware_if::DepthCamera& camera = *cameras_[camera_];
  Way way;
  Pose X_WB;
  if (!way_W(in, way) || in.past.pose_at(in.now - kAgo, X_WB) != Status::kOk) return;
  const Vector3 end_C = core::camera_pose(X_WB, camera.mount()).inverse_times(way.back());
  // 60 degrees beside the way at most, and what the body is wide at its end: of a slow vehicle what it would touch is at the edge of
  // what looks along the way, or beyond it.
  const double end_m = end_C.norm(), radius_m = config_.radius_m;
  const double edge_m = std::sqrt(end_m * end_m + radius_m * radius_m);
  if (end_C.x() * edge_m < (kAlongCos * end_m - kAlongSin * radius_m) * end_m) return;
  read_[camera_] = in.now;
  firmware_if::DepthFrame frame;
  if (camera.read(frame) != Status::kOk || in.past.pose_at(frame.stamp, X_WB) != Status::kOk) return;
  stages::PosedDepthFrame posed;
  posed.frame = frame;
  posed.X_WC = core::camera_pose(X_WB, camera.mount());
  if (stages::check_shape(posed) != Status::kOk) return;
  swept_.points = 0;
  for (const Vector3& p_W : way) {
    const Vector3 p_C = posed.X_WC.inverse_times(p_W);
    swept_.point_C[swept_.points++] = {static_cast<float>(p_C.x()), static_cast<float>(p_C.y()),
                                       static_cast<float>(p_C.z())};
  }
  const DepthError& error = config_.error[camera_];
  swept_.radius_m = static_cast<float>(config_.radius_m);
  swept_.constant_m = static_cast<float>(kSigmasOff * (error.constant_m + error.place_m));
  swept_.quadratic_per_m = static_cast<float>(kSigmasOff * error.quadratic_per_m);
  frame_ = frame;
  row_ = in_the_way_ = 0;
  committed_number_ = in.committed_number;
}

bool NearWatch::must_brake(const Input& in) noexcept {
  const bool is_idle = std::max(in.now, in.due) - in.looked < kOften || cameras_.size() == 0;
  if (is_idle || in.committed_number != committed_number_) row_ = frame_.height;
  if (is_idle) return false;
  if (row_ >= frame_.height) {
    take_image(in);  // is enough for one frame
    return false;
  }
  const std::size_t rows = kAtOnce / frame_.width;  // at least twelve: check_shape()
  const std::size_t end = std::min<std::size_t>(row_ + rows, frame_.height);
  in_the_way_ += stages::count_swept(frame_, row_, end, swept_);
  row_ = end;
  return in_the_way_ >= kEnough;
}

}  // namespace roborun::flight
