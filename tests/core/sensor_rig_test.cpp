#include "core/sensor_rig.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <string>

namespace roborun {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
using core::kDegree;

SensorRig one(const CameraSpec& camera) {
  SensorRig rig;
  (void)rig.cameras.push_back(camera);
  return rig;
}
CameraSpec front() {
  CameraSpec camera;
  camera.tan_half_width = rig_detail::tan_of_half_deg(87.0);
  camera.tan_half_height = rig_detail::tan_of_half_deg(58.0);
  return camera;
}

TEST(SensorModel, EachHasOneName) {
  for (std::size_t i = 0; i < kCameraModels.size(); ++i)
    EXPECT_EQ(to_string(*model_of<CameraModel>(kCameraModels[i])), kCameraModels[i]);
  EXPECT_EQ(model_of<CameraModel>("oak-d"), CameraModel::kOakD);
  EXPECT_EQ(model_of<LidarModel>("mid360"), LidarModel::kMid360);
  EXPECT_EQ(model_of<GnssModel>("m9n"), GnssModel::kM9n);
  EXPECT_EQ(model_of<ImuModel>("clean"), ImuModel{});
  EXPECT_EQ(model_of<ImuModel>("m9n"), std::nullopt);
  EXPECT_EQ(model_of<CameraModel>(""), std::nullopt);
  EXPECT_EQ(stereo_of(CameraModel::kOakD)->baseline_m, 0.075);
  EXPECT_EQ(stereo_of(CameraModel::kTof), nullptr);
  EXPECT_EQ(stereo_of(CameraModel::kClean), nullptr);
}

TEST(SensorRig, SixCamerasLookAlongTheAxesOfTheBody) {
  const std::array<std::array<double, 9>, 6> R_BC{{{1, 0, 0, 0, 1, 0, 0, 0, 1},
                                                   {0, -1, 0, 1, 0, 0, 0, 0, 1},
                                                   {-1, 0, 0, 0, -1, 0, 0, 0, 1},
                                                   {0, 1, 0, -1, 0, 0, 0, 0, 1},
                                                   {0, 0, -1, 0, 1, 0, 1, 0, 0},
                                                   {0, 0, 1, 0, 1, 0, -1, 0, 0}}};
  const SensorRig rig = six_cameras(96, 25.0);
  ASSERT_EQ(rig.cameras.size(), 6U);
  for (std::size_t i = 0; i < 6; ++i) {
    const firmware_if::CameraMount mount = camera_mount(rig.cameras[i].mount);
    EXPECT_EQ(mount.R_BC, R_BC[i]) << i;
    for (const double x : mount.R_BC) EXPECT_FALSE(x == 0.0 && std::signbit(x)) << i;
  }
  EXPECT_FALSE(first_fault(rig).has_value());
}

TEST(SensorRig, AMountTurnsAboutTheAxesOfTheBodyInOrder) {
  const auto R = [](double yaw_deg, double pitch_deg, double roll_deg) {
    const auto m = camera_mount({0, 0, 0, yaw_deg, pitch_deg, roll_deg}).R_BC;
    Matrix3 R_BC;
    for (int i = 0; i < 9; ++i) R_BC(i / 3, i % 3) = m[static_cast<std::size_t>(i)];
    return R_BC;
  };
  EXPECT_LT((R(30, 20, 10) - R(30, 0, 0) * R(0, 20, 0) * R(0, 0, 10)).norm(), 1e-12);
  EXPECT_LT((R(0, 20, 0) * Vector3(1, 0, 0)).z(), 0.0) << "a positive pitch looks down";
  EXPECT_GT((R(20, 0, 0) * Vector3(1, 0, 0)).y(), 0.0) << "a positive yaw looks left";
}

TEST(SensorRig, EveryKeyIsBounded) {
  const auto check = [](const auto& good) {
    using Spec = std::remove_cvref_t<decltype(good)>;
    for (const SensorKey<Spec>& key : keys_of(good)) {
      Spec spec = good;
      EXPECT_TRUE(assign(key, spec, key.low)) << key.key;
      EXPECT_NEAR(key.get(spec), key.low, 1e-9) << key.key;
      EXPECT_TRUE(assign(key, spec, key.high)) << key.key;
      EXPECT_NEAR(key.get(spec), key.high, 1e-9) << key.key;
      for (const double bad : {key.low - 1.0, key.high + 1.0, kNaN, -kNaN, 1e300, -1e300}) {
        const double before = key.get(spec);
        EXPECT_FALSE(assign(key, spec, bad)) << key.key << " " << bad;
        EXPECT_EQ(key.get(spec), before) << key.key;
      }
    }
  };
  check(front());
  check(LidarSpec{});
}

TEST(SensorRig, AFaultNamesItsKey) {
  const auto fault_of = [](auto&& change) -> std::string {
    SensorRig rig = six_cameras(96, 25.0);
    (void)rig.lidars.push_back({});
    change(rig);
    const auto fault = first_fault(rig);
    return fault ? std::string(fault->sensor) + std::to_string(fault->index) + "." + fault->key : "none";
  };
  EXPECT_EQ(fault_of([](SensorRig&) {}), "none");
  EXPECT_EQ(fault_of([](SensorRig& r) { r.cameras[2].tan_half_width = 0.0; }), "camera2.horizontal_fov_deg");
  EXPECT_EQ(fault_of([](SensorRig& r) { r.cameras[2].tan_half_width = kNaN; }), "camera2.horizontal_fov_deg");
  EXPECT_EQ(fault_of([](SensorRig& r) { r.cameras[5].tan_half_height = -1.0; }), "camera5.vertical_fov_deg");
  EXPECT_EQ(fault_of([](SensorRig& r) { r.cameras[0].width = 7; }), "camera0.width");
  EXPECT_EQ(fault_of([](SensorRig& r) { r.cameras[0].height = 1281; }), "camera0.height");
  EXPECT_EQ(fault_of([](SensorRig& r) { r.cameras[1].range_m = kNaN; }), "camera1.range_m");
  EXPECT_EQ(fault_of([](SensorRig& r) { r.cameras[1].mount.yaw_deg = kNaN; }), "camera1.yaw_deg");
  EXPECT_EQ(fault_of([](SensorRig& r) { r.cameras[1].range_m = 2.0, r.cameras[1].range_min_m = 2.0; }),
            "camera1.range_min_m");
  EXPECT_EQ(fault_of([](SensorRig& r) { r.lidars[0].rings = 0; }), "lidar0.rings");
  EXPECT_EQ(fault_of([](SensorRig& r) { r.lidars[0].lowest_deg = 20.0; }), "lidar0.lowest_deg");
  EXPECT_EQ(fault_of([](SensorRig& r) { r.cameras.clear(), r.lidars.clear(); }), "camera0.camera");
  SensorRig full = six_cameras(8, 10.0);
  EXPECT_TRUE(full.cameras.push_back({}) && full.cameras.push_back({}));
  EXPECT_FALSE(full.cameras.push_back({})) << "a ninth camera";
}

TEST(SensorRig, KnowsWhereItIsBlind) {
  EXPECT_EQ(widest_blind_angle_rad(six_cameras(96, 25.0)), 0.0);
  EXPECT_NEAR(widest_blind_angle_rad({}), core::kPi, 1e-9);
  // Farthest from the corners of the image, backwards: 180 degrees less atan(hypot(0.949, 0.554)).
  EXPECT_NEAR(widest_blind_angle_rad(one(front())) / kDegree, 180.0 - 47.7, 3.0);
  SensorRig lidar;
  (void)lidar.lidars.push_back({});
  EXPECT_NEAR(widest_blind_angle_rad(lidar) / kDegree, 75.0, 3.0) << "straight up";
}

TEST(SensorRig, AGapIsAGap) {
  EXPECT_TRUE(cameras_see_all_around(six_cameras(96, 25.0)));
  const auto with_fov_deg = [](double fov_deg) {
    SensorRig rig = six_cameras(96, 25.0);
    for (CameraSpec& c : rig.cameras)
      c.tan_half_width = c.tan_half_height = rig_detail::tan_of_half_deg(fov_deg);
    return rig;
  };
  EXPECT_TRUE(cameras_see_all_around(with_fov_deg(95.0)));
  EXPECT_FALSE(cameras_see_all_around(with_fov_deg(89.9))) << "a slit of a tenth of a degree";
  SensorRig five = six_cameras(96, 25.0);
  five.cameras.truncate(5);
  EXPECT_FALSE(cameras_see_all_around(five));
  EXPECT_TRUE(sees_horizon(five));
  EXPECT_FALSE(cameras_see_all_around(one(front())));
  EXPECT_FALSE(cameras_see_all_around({}));
}

TEST(SensorRig, TellsWhatAFlightHasToKnow) {
  EXPECT_FALSE(sees_horizon(one(front())));
  EXPECT_TRUE(looks_forward(one(front())));
  CameraSpec back = front();
  back.mount.yaw_deg = 180.0;
  EXPECT_FALSE(looks_forward(one(back)));
  EXPECT_FALSE(looks_forward({}));
  EXPECT_NEAR(core::atan2(level_view_ratio(one(front())), 1.0) / kDegree, 28.5, 0.6);
  CameraSpec tilted = front();
  tilted.mount.pitch_deg = 10.0;
  EXPECT_NEAR(core::atan2(level_view_ratio(one(tilted)), 1.0) / kDegree, 18.5, 0.6) << "less is seen upwards";
  EXPECT_GT(level_view_ratio(six_cameras(96, 25.0)), 50.0);
  SensorRig both = one(front());
  (void)both.lidars.push_back({});
  EXPECT_TRUE(sees_horizon(both));
  EXPECT_EQ(shortest_range_m(both), 25.0);
  both.cameras.clear();
  EXPECT_EQ(shortest_range_m(both), 70.0);
  EXPECT_EQ(shortest_range_m({}), 0.0);
  LidarSpec dense;
  dense.rings = 128;
  dense.columns = 2048;
  EXPECT_GT(cloud_pixels(dense), cloud_pixels({}));
  // Each pixel is met: upwards towards the corner of an image of 90 degrees it covers 0.9 / pixels rad.
  EXPECT_GE(0.9 / cloud_pixels({}), 2.0 * kDegree);
}

}  // namespace
}  // namespace roborun
