#include "platform/live/compass.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/geometry/math.hpp"
#include "platform/live/earth_field.hpp"
#include "tests/support/limits.hpp"

namespace roborun::live {
namespace {

class CompassTest : public ::testing::Test {
 protected:
  CompassTest() { sut.stand_in(earth_W); }
  /// How the vehicle lies, and what the earth's field is in its axes.
  [[nodiscard]] static Matrix3 turned(double yaw_rad, double pitch_rad, double roll_rad) {
    return (Eigen::AngleAxisd(yaw_rad, Vector3::UnitZ()) * Eigen::AngleAxisd(pitch_rad, Vector3::UnitY()) *
            Eigen::AngleAxisd(roll_rad, Vector3::UnitX()))
        .toRotationMatrix();
  }
  Vector3 earth_W = earth_field_gauss(47.4, 8.5);
  Compass sut;
  Compass::Heading heading;
};

TEST_F(CompassTest, FindsEveryHeadingHoweverItLeans) {
  for (const double yaw_rad : {-3.1, -1.6, -0.4, 0.0, 0.7, 1.57, 2.9})
    for (const double pitch_rad : {-0.5, 0.0, 0.3})
      for (const double roll_rad : {-0.4, 0.0, 0.6}) {
        const Matrix3 R_WB = turned(yaw_rad, pitch_rad, roll_rad);
        const Vector3 up_B = R_WB.transpose() * Vector3::UnitZ();
        ASSERT_EQ(sut.read(R_WB.transpose() * earth_W, up_B, heading), nullptr);
        EXPECT_NEAR(core::wrap_angle(heading.rad - yaw_rad), 0.0, 1e-9) << yaw_rad << pitch_rad << roll_rad;
        EXPECT_NEAR(heading.sigma_rad, 0.07, 1e-6);
      }
}

TEST_F(CompassTest, KnowsWhereMagneticNorthIs) {
  // Boston: 14 degrees west of true north. The vehicle looks to magnetic north: the field has no part to its left.
  const Vector3 boston_W = earth_field_gauss(42.36, -71.06);
  sut.stand_in(boston_W);
  const double level = std::hypot(boston_W.x(), boston_W.y());
  ASSERT_EQ(sut.read({level, 0.0, boston_W.z()}, Vector3::UnitZ(), heading), nullptr);
  EXPECT_NEAR(heading.rad, (90.0 + 14.0) * core::kDegree, 3.0 * core::kDegree);
}

TEST_F(CompassTest, ADisturbanceWidensTheErrorAndThenIsRefused) {
  const double level = std::hypot(earth_W.x(), earth_W.y());
  const Vector3 field = turned(0.4, 0.0, 0.0).transpose() * earth_W;
  ASSERT_EQ(sut.read(field + Vector3(0.0, 0.0, 0.2 * level), Vector3::UnitZ(), heading), nullptr);
  EXPECT_NEAR(heading.sigma_rad, std::hypot(0.07, 0.2), 1e-9);
  EXPECT_EQ(sut.read(field + Vector3(0.0, 0.0, 0.49 * level), Vector3::UnitZ(), heading), nullptr);
  for (const Vector3& wrong :
       {Vector3(field + Vector3(0.0, 0.0, 0.51 * level)), Vector3(2.0 * field), Vector3(Vector3::Zero())})
    EXPECT_NE(std::string(sut.read(wrong, Vector3::UnitZ(), heading)).find("not the earth's field"),
              std::string::npos);
}

TEST_F(CompassTest, RefusesWhatCannotBe) {
  EXPECT_STREQ(sut.read({test::kNan, 0.2, -0.4}, Vector3::UnitZ(), heading), "is not finite");
  sut.stand_in(earth_field_gauss(86.0, 160.0));
  EXPECT_NE(std::string(sut.read({0.0, 0.0, -0.57}, Vector3::UnitZ(), heading)).find("magnetic pole"),
            std::string::npos);
}

}  // namespace
}  // namespace roborun::live
