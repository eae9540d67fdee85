#include "platform/flight/near_watch.hpp"

#include <algorithm>

#include "core/geometry/camera_pose.hpp"
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
constexpr std::size_t kAtOnce = 32'768;  // pixels a minor frame
constexpr Nanos kAgo{10'000'000};        // where it is: the newest state may be of this very frame
constexpr double kAlong = 0.5;           // cosine of 60 degrees

}  // namespace

NearWatch::NearWatch(const Config& config, std::span<firmware_if::DepthCamera* const> cameras) noexcept
    : config_(config) {
  for (firmware_if::DepthCamera* camera : cameras) (void)cameras_.push_back(camera);
}

bool NearWatch::way_W(const Input& in, Way& way) const noexcept {
  const double begin_s = seconds(in.now - in.committed.start_time), end_s = in.committed.duration_s();
  if (in.committed.at_s(begin_s).v_W.norm() < kStands_mps) return false;
  // As FlightControl::brake(): along the path, at a rate that falls.
  double at_s = begin_s, rate = 1.0;
  int walks = 0;
  for (; walks < kMostWalks && rate > 0.0 && at_s < end_s; ++walks) {
    if (walks * kWalk_s >= kReacts_s)
      rate -= kWalk_s * config_.braking_mps2 / std::max(in.committed.at_s(at_s).v_W.norm(), 1.0);
    at_s += kWalk_s * std::max(rate, 0.0);
  }
  for (double room_m = kRoom_m; walks < kMostWalks && room_m > 0.0 && at_s < end_s; ++walks) {
    room_m -= kWalk_s * in.committed.at_s(at_s).v_W.norm();
    at_s += kWalk_s;
  }
  for (std::size_t i = 0; i < way.size(); ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(way.size() - 1);
    way[i] = in.committed.at_s(begin_s + share * (at_s - begin_s)).p_W;
  }
  return true;
}

bool NearWatch::take_image(const Input& in) noexcept {
  camera_ = (camera_ + 1) % cameras_.size();
  if (((in.refused >> camera_) & 1U) != 0 || in.now - read_[camera_] < kEvery) return false;
  firmware_if::DepthCamera& camera = *cameras_[camera_];
  Way way;
  Pose X_WB;
  if (!way_W(in, way) || in.past.pose_at(in.now - kAgo, X_WB) != Status::kOk) return false;
  const Vector3 end_C = core::camera_pose(X_WB, camera.mount()).inverse_times(way.back());
  if (end_C.x() < kAlong * end_C.norm()) return false;
  read_[camera_] = in.now;
  firmware_if::DepthFrame frame;
  if (camera.read(frame) != Status::kOk || in.past.pose_at(frame.stamp, X_WB) != Status::kOk) return false;
  stages::PosedDepthFrame posed;
  posed.frame = frame;
  posed.X_WC = core::camera_pose(X_WB, camera.mount());
  if (stages::check_shape(posed) != Status::kOk) return false;
  for (std::size_t i = 0; i < way.size(); ++i) {
    const Vector3 p_C = posed.X_WC.inverse_times(way[i]);
    for (int axis = 0; axis < 3; ++axis)
      swept_.point_C[i][static_cast<std::size_t>(axis)] = static_cast<float>(p_C[axis]);
  }
  const DepthError& error = config_.error[camera_];
  swept_.points = way.size();
  swept_.radius_m = static_cast<float>(config_.radius_m);
  swept_.constant_m = static_cast<float>(kSigmasOff * (error.constant_m + error.place_m));
  swept_.quadratic_per_m = static_cast<float>(kSigmasOff * error.quadratic_per_m);
  frame_ = frame;
  row_ = in_the_way_ = 0;
  committed_number_ = in.committed_number;
  return true;
}

bool NearWatch::must_brake(const Input& in) noexcept {
  if (in.committed_number != committed_number_) row_ = frame_.height;
  if (std::max(in.now, in.due) - in.looked < kOften || cameras_.size() == 0) return false;
  if (row_ >= frame_.height && !take_image(in)) return false;
  const std::size_t rows = std::max<std::size_t>(kAtOnce / frame_.width, 1);
  const std::size_t end = std::min<std::size_t>(row_ + rows, frame_.height);
  in_the_way_ += stages::count_swept(frame_, row_, end, swept_);
  row_ = in_the_way_ < kEnough ? end : frame_.height;
  return in_the_way_ >= kEnough;
}

}  // namespace roborun::flight
