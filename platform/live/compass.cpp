#include "platform/live/compass.hpp"

#include <cmath>

#include "core/geometry/math.hpp"

namespace roborun::live {
namespace {

// Of the model of the earth's field and of a calibrated magnetometer together.
constexpr double kSigma_rad = 0.07;
// Near the magnetic poles: below it a few milligauss of the vehicle itself are degrees.
constexpr double kLeastLevel_gauss = 0.08;
constexpr double kMostDisturbed = 0.5;

}  // namespace

void Compass::stand_in(const Vector3& earth_W_gauss) noexcept {
  north_rad_ = core::atan2(earth_W_gauss.y(), earth_W_gauss.x());
  level_gauss_ = std::hypot(earth_W_gauss.x(), earth_W_gauss.y());
  up_gauss_ = earth_W_gauss.z();
}

const char* Compass::read(const Vector3& field_B_gauss, const Vector3& up_B,
                          Heading& heading) const noexcept {
  if (!field_B_gauss.allFinite()) return "is not finite";
  if (level_gauss_ < kLeastLevel_gauss) return "is of no use here, so near to a magnetic pole";
  const double up_gauss = field_B_gauss.dot(up_B);
  const Vector3 level_B = field_B_gauss - up_gauss * up_B;
  const Vector3 ahead_B = Vector3::UnitX() - up_B.x() * up_B;
  const double disturbed = std::hypot(up_gauss - up_gauss_, level_B.norm() - level_gauss_) / level_gauss_;
  if (!(disturbed <= kMostDisturbed))
    return "is not the earth's field here: calibrate it, and look for steel, magnets and cables near it";
  // From the forward axis to the field, counter-clockwise.
  const double field_rad = core::atan2(up_B.cross(ahead_B).dot(level_B), ahead_B.dot(level_B));
  heading = {core::wrap_angle(north_rad_ - field_rad), std::hypot(kSigma_rad, disturbed)};
  return nullptr;
}

}  // namespace roborun::live
