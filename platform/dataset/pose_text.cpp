#include "platform/dataset/pose_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "platform/input/input_error.hpp"
#include "platform/sitl/world/byte_reader.hpp"

namespace roborun::dataset {
namespace {

constexpr double kTolerance = 0.01;
constexpr double kSameTime_s = 1e-3;

[[noreturn]] void refuse(const std::string& name, std::size_t line, const std::string& what) {
  throw InputError(fmt::format("{}:{}: {}", name, line, what));
}

/// False for a quaternion that turns nothing.
bool from_quaternion(std::span<const double> n, Pose& X) {
  const Eigen::Quaterniond q(n[6], n[3], n[4], n[5]);
  if (!(std::fabs(q.norm() - 1.0) <= kTolerance)) return false;
  X = {q.normalized().toRotationMatrix(), Vector3(n[0], n[1], n[2])};
  return true;
}

/// False for a matrix whose left part is no rotation.
bool from_matrix(std::span<const double> n, Pose& X) {
  Matrix3 R;
  for (int row = 0; row < 3; ++row) {
    const std::size_t first = 4 * static_cast<std::size_t>(row);
    for (int column = 0; column < 3; ++column) R(row, column) = n[first + static_cast<std::size_t>(column)];
    X.p_RT[row] = n[first + 3];
  }
  if (!((R * R.transpose() - Matrix3::Identity()).cwiseAbs().maxCoeff() <= kTolerance) ||
      R.determinant() < 0.0)
    return false;
  X.R_RT = Eigen::Quaterniond(R).normalized().toRotationMatrix();
  return true;
}

}  // namespace

std::vector<TimedPose> parse_poses(std::string_view text, const std::string& name) {
  std::vector<TimedPose> poses;
  sitl::WordReader reader(text);
  std::string_view line;
  while (reader.next_line(line)) {
    std::array<double, 16> number{};
    std::size_t count = 0;
    for (std::string_view word = sitl::WordReader::take_word(line); !word.empty() && word.front() != '#';
         word = sitl::WordReader::take_word(line)) {
      const auto value = sitl::number_of<double>(word);
      if (!value || !std::isfinite(*value))
        refuse(name, reader.line_number(), fmt::format("'{}': must be a finite number", word));
      if (count < number.size()) number[count] = *value;
      ++count;
    }
    if (count == 0) continue;
    TimedPose pose;
    if (count == 8) {
      pose.time_s = number[0];
      if (!from_quaternion(std::span(number).subspan(1, 7), pose.X_WS))
        refuse(name, reader.line_number(), "quaternion qx qy qz qw: must have the length 1");
    } else if (count == 12 || count == 16) {
      if (!from_matrix(number, pose.X_WS))
        refuse(name, reader.line_number(), "matrix: must be a rotation beside a place, row by row");
    } else {
      refuse(name, reader.line_number(),
             fmt::format("{} numbers: must be 8 (time tx ty tz qx qy qz qw), 12 or 16 (a matrix)", count));
    }
    poses.push_back(pose);
  }
  return poses;
}

PoseTrack::PoseTrack(std::vector<TimedPose> poses, const std::string& name) : poses_(std::move(poses)) {
  for (std::size_t i = 1; i < poses_.size(); ++i) {
    if (!(poses_[i].time_s > poses_[i - 1].time_s))
      throw InputError(fmt::format("{}: pose {} at {} s after one at {} s: times must ascend", name, i + 1,
                                   poses_[i].time_s, poses_[i - 1].time_s));
  }
}

bool PoseTrack::at(double time_s, Pose& X_WS) const {
  const auto after = std::lower_bound(poses_.begin(), poses_.end(), time_s,
                                      [](const TimedPose& pose, double t) { return pose.time_s < t; });
  if (after != poses_.end() && after->time_s - time_s <= kSameTime_s) {
    X_WS = after->X_WS;
    return true;
  }
  if (after == poses_.begin()) return false;
  const TimedPose& a = *std::prev(after);
  if (time_s - a.time_s <= kSameTime_s) {
    X_WS = a.X_WS;
    return true;
  }
  if (after == poses_.end() || after->time_s - a.time_s > kMostGap_s) return false;
  const TimedPose& b = *after;
  const double share = (time_s - a.time_s) / (b.time_s - a.time_s);
  const Eigen::Quaterniond turned =
      Eigen::Quaterniond(a.X_WS.R_RT).slerp(share, Eigen::Quaterniond(b.X_WS.R_RT));
  X_WS = {turned.toRotationMatrix(), a.X_WS.p_RT + share * (b.X_WS.p_RT - a.X_WS.p_RT)};
  return true;
}

}  // namespace roborun::dataset
