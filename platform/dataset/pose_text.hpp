/// Poses in text files, as public sets of recorded data have them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/geometry/vector.hpp"

namespace roborun::dataset {

struct TimedPose {
  double time_s{};
  Pose X_WS{};  ///< From the sensor's frame to the world's.
};

/// A line is a pose, in one of three forms: "time tx ty tz qx qy qz qw" (TUM), or the 12 or 16 numbers of a matrix row by row
/// (then time_s is 0). Empty lines and those that begin with # are left out. Throws InputError with file and line for other
/// counts of numbers, what is not finite, a quaternion whose length or a matrix whose turn is wrong by more than 1 %.
[[nodiscard]] std::vector<TimedPose> parse_poses(std::string_view text, const std::string& name);

/// The pose at a time: that of a line at most 1 ms away, or between two lines that are at most `kMostGap_s` apart.
class PoseTrack {
 public:
  static constexpr double kMostGap_s = 0.1;

  /// Throws InputError unless times ascend and each line has one.
  PoseTrack(std::vector<TimedPose> poses, const std::string& name);
  /// False: none.
  [[nodiscard]] bool at(double time_s, Pose& X_WS) const;

 private:
  std::vector<TimedPose> poses_;
};

}  // namespace roborun::dataset
