#include "platform/feed/dds/ros_samples.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "platform/feed/dds/sensor_feed.hpp"

namespace roborun::feed {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::string kind(const std::optional<Refused>& refused) { return refused ? refused->kind : "taken"; }
char* text(std::string& of) { return of.data(); }

/// A message and what its sequences point to.
struct Image {
  std::string encoding{"32FC1"}, frame{"camera"};
  std::vector<std::uint8_t> data;
  RosImage message{};
  RosOptics optics{8, 8, 10.0F, 11.0F, 3.5F, 3.0F};

  explicit Image(std::uint32_t step = 36) : data(std::size_t{step} * 8, 0xEE) {
    for (std::uint32_t v = 0; v < 8; ++v)
      for (std::uint32_t u = 0; u < 8; ++u) {
        const auto value = static_cast<float>(10 * v + u);
        std::memcpy(data.data() + v * step + 4 * u, &value, 4);
      }
    message.width = message.height = 8;
    message.step = step;
    set();
  }
  void set() {
    message.header.frame_id = text(frame);
    message.encoding = text(encoding);
    message.data = {static_cast<std::uint32_t>(data.size()), static_cast<std::uint32_t>(data.size()),
                    data.data(), false};
  }
  std::optional<Refused> take() {
    set();
    return depth_of(message, optics, room, depth, pixels);
  }
  std::vector<std::byte> room;
  roborun_port_depth depth{};
  std::span<const std::byte> pixels;
};

TEST(RosSamples, AnImageLosesItsPaddingAndNothingElse) {
  for (const std::uint32_t step : {32U, 36U}) {
    Image sut(step);
    ASSERT_EQ(kind(sut.take()), "taken");
    ASSERT_EQ(sut.pixels.size(), 256U);
    for (std::size_t i = 0; i < 64; ++i) {
      float value = -1.0F;
      std::memcpy(&value, sut.pixels.data() + 4 * i, 4);
      ASSERT_EQ(value, static_cast<float>(10 * (i / 8) + i % 8));
    }
    EXPECT_EQ(sut.depth.pixel, std::uint32_t{ROBORUN_PORT_FLOAT32_M});
    EXPECT_EQ(sut.depth.fy, 11.0F);
    EXPECT_EQ(sut.depth.cy, 3.0F);
  }
}

TEST(RosSamples, AnImageThatLiesIsRefused) {
  const auto with = [](auto&& change) {
    Image sut;
    change(sut);
    return kind(sut.take());
  };
  EXPECT_EQ(with([](Image& i) { i.encoding = "mono16"; }), "encoding");
  EXPECT_EQ(with([](Image& i) { i.message.is_bigendian = 1; }), "encoding");
  EXPECT_EQ(with([](Image& i) { i.message.width = 9; }), "size");
  EXPECT_EQ(with([](Image& i) { i.message.height = i.optics.height = 7; }), "size")
      << "a port takes 8 at least";
  EXPECT_EQ(with([](Image& i) { i.message.width = i.optics.width = 4'000'000'000U; }), "size");
  EXPECT_EQ(with([](Image& i) { i.message.step = 31; }), "step");
  EXPECT_EQ(with([](Image& i) { i.message.step = 4'294'967'295U; }), "data");
  EXPECT_EQ(with([](Image& i) { i.data.resize(287); }), "data") << "8 rows of 36 are 288";
  EXPECT_EQ(with([](Image& i) { i.data.clear(); }), "data");
}

RosCameraInfo info() {
  RosCameraInfo m{};
  m.width = 640;
  m.height = 480;
  m.k[0] = 380.0;
  m.k[4] = 381.0;
  m.k[2] = 320.5;
  m.k[5] = 240.5;
  return m;
}

TEST(RosSamples, OpticsAreThoseOfARectifiedCamera) {
  RosOptics optics;
  ASSERT_EQ(kind(optics_of(info(), optics)), "taken");
  EXPECT_EQ(optics.fx, 380.0F);
  EXPECT_EQ(optics.cy, 240.5F);
  const auto with = [](auto&& change) {
    RosCameraInfo m = info();
    change(m);
    RosOptics out;
    return kind(optics_of(m, out));
  };
  EXPECT_EQ(with([](RosCameraInfo& m) { m.k[0] = kNaN; }), "intrinsics");
  EXPECT_EQ(with([](RosCameraInfo& m) { m.k[8] = kNaN; }), "intrinsics");
  EXPECT_EQ(with([](RosCameraInfo& m) { m.k[0] = 0.0; }), "intrinsics") << "an uncalibrated camera";
  EXPECT_EQ(with([](RosCameraInfo& m) { m.k[2] = 640.0; }), "intrinsics");
  EXPECT_EQ(with([](RosCameraInfo& m) { m.k[5] = -1.0; }), "intrinsics");
  EXPECT_EQ(with([](RosCameraInfo& m) { m.binning_x = 2; }), "binning");
  EXPECT_EQ(with([](RosCameraInfo& m) { m.roi.x_offset = 8; }), "binning");
  EXPECT_EQ(with([](RosCameraInfo& m) { m.roi.height = 100; }), "binning");
  EXPECT_EQ(with([](RosCameraInfo& m) { m.roi.width = 640; }), "taken");
  for (const auto& [value, wanted] :
       {std::pair{0.0005, "taken"}, {0.002, "distortion"}, {-0.1, "distortion"}, {kNaN, "distortion"}})
    EXPECT_EQ(with([value = value](RosCameraInfo& m) {
                static double d = 0.0;
                d = value;
                m.d = {1, 1, &d, false};
              }),
              wanted)
        << value;
}

/// Three points in two rows, the last one missing in the second.
struct Cloud {
  std::string frame{"lidar"}, x{"x"}, y{"y"}, z{"z"}, time;
  std::vector<sensor_msgs_msg_dds__PointField_> fields;
  std::vector<std::uint8_t> data;
  RosCloud message{};
  std::vector<roborun_port_point> points;
  double late_s{-1.0};
  std::uint32_t time_offset{12};

  explicit Cloud(std::string time_name = {}, std::uint8_t time_type = 7) : time(std::move(time_name)) {
    message.height = 2;
    message.width = 2;
    message.point_step = 24;
    message.row_step = 50;
    message.header.stamp = {1000, 500'000'000};
    data.assign(2 * 50, 0xEE);
    for (std::uint32_t i = 0; i < 4; ++i) {
      std::uint8_t* const at = data.data() + i / 2 * 50 + i % 2 * 24;
      for (std::uint32_t axis = 0; axis < 3; ++axis) {
        const auto value = static_cast<float>(10 * i + axis);
        std::memcpy(at + 4 * axis, &value, 4);
      }
      if (time_type == 7) put(at + 12, 0.01F * static_cast<float>(i));
      if (time_type == 6) put(at + 12, 10'000'000U * i);
      if (time_type == 8) put(at + 12, 1000.5 + 0.01 * i);
    }
    for (auto& [name, offset, type] :
         {std::tuple{&x, 0U, 7}, {&y, 4U, 7}, {&z, 8U, 7}, {&time, 12U, int{time_type}}})
      if (!name->empty()) fields.push_back({name->data(), offset, static_cast<std::uint8_t>(type), 1});
  }
  template <typename T>
  static void put(std::uint8_t* at, T value) {
    std::memcpy(at, &value, sizeof value);
  }
  std::optional<Refused> take(std::size_t most = 4) {
    message.header.frame_id = frame.data();
    message.fields = {static_cast<std::uint32_t>(fields.size()), static_cast<std::uint32_t>(fields.size()),
                      fields.data(), false};
    message.data = {static_cast<std::uint32_t>(data.size()), static_cast<std::uint32_t>(data.size()),
                    data.data(), false};
    return cloud_of(message, most, points, late_s);
  }
};

TEST(RosSamples, ACloudKeepsItsPointsAndTheirTimes) {
  for (const auto& [name, type] : {std::pair{"", std::uint8_t{0}}, {"time", 7}, {"t", 6}, {"timestamp", 8}}) {
    Cloud sut(name, type);
    ASSERT_EQ(kind(sut.take()), "taken") << name;
    ASSERT_EQ(sut.points.size(), 4U);
    const bool timed = type != 0;
    EXPECT_NEAR(sut.late_s, timed ? 0.03 : 0.0, 1e-6) << name << ": the last point is the newest";
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_EQ(sut.points[i].y_m, static_cast<float>(10 * i + 1));
      EXPECT_NEAR(static_cast<double>(sut.points[i].before_s),
                  timed ? 0.03 - 0.01 * static_cast<double>(i) : 0.0, 1e-6);
    }
  }
}

TEST(RosSamples, ACloudThatLiesIsRefused) {
  const auto with = [](auto&& change) {
    Cloud sut("time", 7);
    change(sut);
    return kind(sut.take());
  };
  EXPECT_EQ(with([](Cloud& c) { c.fields.erase(c.fields.begin()); }), "fields");
  EXPECT_EQ(with([](Cloud& c) { c.fields[1].datatype = 8; }), "fields");
  EXPECT_EQ(with([](Cloud& c) { c.fields[2].offset = 21; }), "fields") << "4 bytes from 21 are more than 24";
  EXPECT_EQ(with([](Cloud& c) { c.fields[2].offset = 4'294'967'295U; }), "fields");
  EXPECT_EQ(with([](Cloud& c) { c.message.point_step = 2; }), "fields");
  EXPECT_EQ(with([](Cloud& c) { c.fields[3].offset = 23; }), "taken") << "times that are not there: none";
  EXPECT_EQ(with([](Cloud& c) { c.message.width = 3; }), "size");
  EXPECT_EQ(with([](Cloud& c) { c.message.width = c.message.height = 4'294'967'295U; }), "size");
  EXPECT_EQ(with([](Cloud& c) { c.message.row_step = 47; }), "data");
  EXPECT_EQ(with([](Cloud& c) { c.message.row_step = 4'294'967'295U; }), "data");
  EXPECT_EQ(with([](Cloud& c) { c.data.resize(97); }), "data") << "50 + 48 are 98";
  EXPECT_EQ(with([](Cloud& c) { c.data.resize(98); }), "taken");
  EXPECT_EQ(with([](Cloud& c) { c.message.is_bigendian = true; }), "encoding");
  EXPECT_EQ(with([](Cloud& c) { c.frame = "depth_optical_frame"; }), "frame");
  EXPECT_EQ(with([](Cloud& c) { Cloud::put(c.data.data() + 12, 1.5F); }), "times");
  EXPECT_EQ(with([](Cloud& c) { Cloud::put(c.data.data() + 12, static_cast<float>(kNaN)); }), "times");
  EXPECT_EQ(with([](Cloud& c) { c.message.width = c.message.height = 0; }), "taken") << "nothing was seen";
}

struct Odometry {
  std::string frame{"odom"}, child{"base_link"};
  RosOdometry message{};
  roborun_port_odometry out{};

  Odometry() {
    message.pose.pose = {{1.0, 2.0, 3.0}, {0.0, 0.0, std::sqrt(0.5), std::sqrt(0.5)}};
    message.twist.twist.linear = {2.0, 0.0, 0.5};
    for (std::size_t i = 0; i < 6; ++i) message.pose.covariance[7 * i] = 0.01 * static_cast<double>(i + 1);
    for (std::size_t i = 0; i < 3; ++i) message.twist.covariance[7 * i] = 0.1;
  }
  std::optional<Refused> take() {
    message.header.frame_id = frame.data();
    message.child_frame_id = child.data();
    return odometry_of(message, out);
  }
};

TEST(RosSamples, OdometrysSpeedIsTurnedIntoTheFrameOfItsPose) {
  Odometry sut;
  ASSERT_EQ(kind(sut.take()), "taken");
  EXPECT_NEAR(sut.out.v_OB_mps[0], 0.0, 1e-12);
  EXPECT_NEAR(sut.out.v_OB_mps[1], 2.0, 1e-12) << "forward is to the left, where it came from";
  EXPECT_NEAR(sut.out.v_OB_mps[2], 0.5, 1e-12);
  EXPECT_EQ(sut.out.p_OB_m[2], 3.0);
  EXPECT_NEAR(sut.out.q_OB[0], std::sqrt(0.5), 1e-12);
  EXPECT_FLOAT_EQ(sut.out.pose_variance[5], 0.06F);
  EXPECT_FLOAT_EQ(sut.out.velocity_variance[2], 0.1F);
}

TEST(RosSamples, OdometryOfUnknownSpeedWeighsNothingThere) {
  Odometry sut;
  for (double& c : sut.message.twist.covariance) c = 0.0;
  ASSERT_EQ(kind(sut.take()), "taken");
  for (const float variance : sut.out.velocity_variance) EXPECT_GE(variance, 1e6F);
  EXPECT_FLOAT_EQ(sut.out.pose_variance[5], 0.06F);
}

TEST(RosSamples, OdometryThatIsNoneIsRefused) {
  const auto with = [](auto&& change) {
    Odometry sut;
    change(sut);
    return kind(sut.take());
  };
  EXPECT_EQ(with([](Odometry& o) { o.message.pose.pose.position.x = kNaN; }), "values");
  EXPECT_EQ(with([](Odometry& o) { o.message.pose.pose.orientation = {0, 0, 0, 0}; }), "values");
  EXPECT_EQ(with([](Odometry& o) { o.message.twist.twist.linear.z = kNaN; }), "values");
  EXPECT_EQ(with([](Odometry& o) { o.message.pose.covariance[7] = -0.1; }), "covariance");
  EXPECT_EQ(with([](Odometry& o) { o.message.twist.covariance[0] = kNaN; }), "covariance");
  EXPECT_EQ(with([](Odometry& o) {
              for (double& c : o.message.pose.covariance) c = 0.0;
            }),
            "covariance");
  EXPECT_EQ(with([](Odometry& o) { o.child = "camera_optical"; }), "frame");
}

TEST(RosSamples, AnImuNeedsBothHalvesInTheBodysAxes) {
  std::string frame = "imu_link";
  RosImu m{};
  roborun_port_imu out{};
  m.header.frame_id = frame.data();
  m.angular_velocity = {0.1, 0.2, 0.3};
  m.linear_acceleration = {0.0, 0.0, 9.8};
  ASSERT_EQ(kind(imu_of(m, out)), "taken");
  EXPECT_EQ(out.angular_rate_B_radps[2], 0.3);
  EXPECT_EQ(out.specific_force_B_mps2[2], 9.8);
  m.linear_acceleration_covariance[0] = -1.0;
  EXPECT_EQ(kind(imu_of(m, out)), "halves");
  m.linear_acceleration_covariance[0] = 0.0;
  m.linear_acceleration.x = kNaN;
  EXPECT_EQ(kind(imu_of(m, out)), "values");
  frame = "camera_imu_optical_frame";
  m.header.frame_id = frame.data();
  EXPECT_EQ(kind(imu_of(m, out)), "frame");
}

TEST(RosClock, TakesStampsOfThisMachineAndNoOthers) {
  RosClock sut;
  ClockPair now{std::chrono::seconds(1'700'000'000), std::chrono::seconds(500)};
  std::int64_t stamp_ns = 0;
  ASSERT_EQ(kind(sut.take(1'699'999'999, 900'000'000, now, stamp_ns)), "taken");
  EXPECT_EQ(stamp_ns, 499'900'000'000);
  EXPECT_EQ(kind(sut.take(1'699'999'999, 490'000'000, now, stamp_ns)), "stamp") << "0.51 s old";
  EXPECT_EQ(kind(sut.take(1'700'000'000, 9'000'000, now, stamp_ns)), "taken");
  EXPECT_EQ(kind(sut.take(1'700'000'000, 11'000'000, now, stamp_ns)), "stamp") << "from the future";
  EXPECT_EQ(kind(sut.take(12, 0, now, stamp_ns)), "stamp") << "simulated time";
  EXPECT_EQ(kind(sut.take(1'700'000'000, 1'000'000'000, now, stamp_ns)), "stamp");
  EXPECT_EQ(kind(sut.take(std::numeric_limits<std::int32_t>::min(), 0, now, stamp_ns)), "stamp");
}

TEST(RosClock, RefusesWhatComesWhileTheWallClockJumps) {
  RosClock sut;
  ClockPair now{std::chrono::seconds(1'700'000'000), std::chrono::seconds(500)};
  std::int64_t stamp_ns = 0;
  ASSERT_EQ(kind(sut.take(1'700'000'000, 0, now, stamp_ns)), "taken");
  now.wall += std::chrono::milliseconds(105);
  now.monotonic += std::chrono::milliseconds(100);  // slewed by 5 ms: no jump
  ASSERT_EQ(kind(sut.take(1'700'000'000, 105'000'000, now, stamp_ns)), "taken");
  now.wall += std::chrono::milliseconds(200);  // set by 0.1 s
  now.monotonic += std::chrono::milliseconds(100);
  const auto jump = sut.take(1'700'000'000, 300'000'000, now, stamp_ns);
  ASSERT_EQ(kind(jump), "clock");
  EXPECT_NE(jump->text.find("+0.100 s"), std::string::npos) << jump->text;
  now.wall += std::chrono::milliseconds(199);
  now.monotonic += std::chrono::milliseconds(199);
  EXPECT_EQ(kind(sut.take(1'700'000'000, 500'000'000, now, stamp_ns)), "clock");
  now.wall += std::chrono::milliseconds(1);
  now.monotonic += std::chrono::milliseconds(1);
  ASSERT_EQ(kind(sut.take(1'700'000'000, 505'000'000, now, stamp_ns)), "taken");
  EXPECT_EQ(stamp_ns, now.monotonic.count());
}

TEST(OneSender, HearsAnotherOneOnlyOnceTheFirstIsSilent) {
  OneSender sut;
  const auto at = [](int ms) { return Nanos{std::chrono::milliseconds(ms)}; };
  EXPECT_EQ(sut.hear(1, at(0)), OneSender::Is::kNew);
  EXPECT_EQ(sut.hear(1, at(100)), OneSender::Is::kKnown);
  EXPECT_EQ(sut.hear(2, at(599)), OneSender::Is::kAnother);
  EXPECT_EQ(sut.hear(2, at(600)), OneSender::Is::kNew);
  EXPECT_EQ(sut.hear(1, at(601)), OneSender::Is::kAnother);
  EXPECT_EQ(sut.hear(2, at(5000)), OneSender::Is::kKnown) << "its own silence changes nothing";
}

}  // namespace
}  // namespace roborun::feed
