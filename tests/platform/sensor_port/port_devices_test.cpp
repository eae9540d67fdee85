#include "platform/sensor_port/port_devices.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <thread>

#include "tests/platform/sensor_port/one_mapping.hpp"
#include "tests/support/limits.hpp"
#include "tests/support/no_alloc_scope.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::sensor_port {
namespace {

using test::kNanF;
constexpr float kInfinityF = std::numeric_limits<float>::infinity();

roborun_port_depth image(std::uint32_t width, std::uint32_t height) {
  roborun_port_depth d{};
  d.width = width;
  d.height = height;
  d.pixel = ROBORUN_PORT_FLOAT32_M;
  d.fx = d.fy = 0.5F * static_cast<float>(width);
  d.cx = 0.5F * static_cast<float>(width) - 0.5F;
  d.cy = 0.5F * static_cast<float>(height) - 0.5F;
  d.range_min_m = 0.2F;
  d.range_m = 10.0F;
  d.mount.q_BS[0] = 1.0F;
  return d;
}

template <typename Device>
class PortDevicesTest : public ::testing::Test {
 protected:
  void start(std::uint32_t kind, std::uint32_t most_bytes) {
    path_ = test::scratch("roborun-device");
    std::remove(path_.c_str());
    ASSERT_EQ(roborun_port_open(&writer_, path_.c_str(), kind, most_bytes, 4), nullptr);
    ASSERT_EQ(sut_.open(path_, {Nanos{1000}}), "");
  }
  ~PortDevicesTest() override { roborun_port_close(&writer_); }
  /// With a stamp 1 ms later than the one before.
  template <typename Sample>
  void write(Sample sample, const void* payload = nullptr, std::size_t bytes = 0) {
    sample.at.stamp_ns = stamp_ns_ += 1'000'000;
    sample.at.sequence = ++sequence_;
    ASSERT_EQ(roborun_port_write(&writer_, &sample, payload, static_cast<std::uint32_t>(bytes)), 0);
  }
  std::string path_;
  roborun_port_writer writer_{-1, 0, nullptr};
  std::int64_t stamp_ns_{};
  std::uint32_t sequence_{};
  Device sut_;
};

using PortDepthCameraTest = PortDevicesTest<PortDepthCamera>;
using PortLidarTest = PortDevicesTest<PortLidar>;
using PortImuTest = PortDevicesTest<PortImu>;
using PortOdometryTest = PortDevicesTest<PortOdometry>;

TEST_F(PortDepthCameraTest, HandsOutMetresAndWhatIsNotKnown) {
  start(ROBORUN_PORT_DEPTH, 16 * 8 * 4);
  std::vector<float> depth_m(16 * 8, 3.0F);
  depth_m[0] = 0.0F;
  depth_m[1] = kNanF;
  depth_m[2] = kInfinityF;
  depth_m[3] = -1.0F;
  roborun_port_depth d = image(16, 8);
  d.fx = 8.0F;
  d.fy = 16.0F;
  d.mount.p_BS_m[0] = 0.25F;
  write(d, depth_m.data(), depth_m.size() * 4);
  firmware_if::DepthFrame frame;
  {
    const test::NoAllocScope scope;
    ASSERT_EQ(sut_.read(frame), Status::kOk);
    EXPECT_EQ(scope.count(), 0U);
  }
  EXPECT_EQ(frame.width, 16);
  EXPECT_EQ(frame.height, 8);
  EXPECT_EQ(frame.tan_half_width, 1.0F);
  EXPECT_EQ(frame.tan_half_height, 0.25F);
  EXPECT_EQ(frame.stamp.time_since_epoch().count(), 1'000'000 - 1000);
  EXPECT_EQ(frame.sequence, 1U);
  EXPECT_EQ(frame.range_m, 10.0F);
  EXPECT_EQ(frame.range_min_m, 0.2F);
  EXPECT_TRUE(std::isnan(frame.depth_m[0]));
  EXPECT_TRUE(std::isnan(frame.depth_m[1]));
  EXPECT_EQ(frame.depth_m[2], kInfinityF);
  EXPECT_TRUE(std::isnan(frame.depth_m[3]));
  EXPECT_EQ(frame.depth_m[4], 3.0F);
  EXPECT_EQ(sut_.mount().p_BC_m[0], 0.25);
  EXPECT_EQ(sut_.mount().R_BC, (std::array<double, 9>{1, 0, 0, 0, 1, 0, 0, 0, 1}));
  EXPECT_EQ(sut_.read(frame), Status::kNotReady);
}

TEST_F(PortDepthCameraTest, ReadsWholeNumbersByTheirUnit) {
  start(ROBORUN_PORT_DEPTH, 8 * 8 * 2);
  std::vector<std::uint16_t> raw(64, 2500);
  raw[0] = 0;
  roborun_port_depth d = image(8, 8);
  d.pixel = ROBORUN_PORT_UINT16;
  d.unit_m = 0.001F;
  write(d, raw.data(), raw.size() * 2);
  firmware_if::DepthFrame frame;
  ASSERT_EQ(sut_.read(frame), Status::kOk);
  EXPECT_TRUE(std::isnan(frame.depth_m[0]));
  EXPECT_FLOAT_EQ(frame.depth_m[1], 2.5F);
}

TEST_F(PortDepthCameraTest, TakesRowsThatBeginAnywhere) {
  constexpr std::uint32_t kWidth = 31, kHeight = 9, kLeft = 5;
  start(ROBORUN_PORT_DEPTH, kWidth * kHeight * 2);
  std::vector<std::uint16_t> raw(kWidth * kHeight);
  for (std::size_t i = 0; i < raw.size(); ++i) raw[i] = static_cast<std::uint16_t>(1 + i);
  roborun_port_depth d = image(kWidth, kHeight);
  d.pixel = ROBORUN_PORT_UINT16;
  d.unit_m = 1.0F;
  d.cx = 17.5F;  // 13 columns to its right
  d.cy = 3.5F;   // 4 rows above it
  write(d, raw.data(), raw.size() * 2);
  firmware_if::DepthFrame frame;
  ASSERT_EQ(sut_.read(frame), Status::kOk);
  ASSERT_EQ(frame.width, 26);
  ASSERT_EQ(frame.height, 8);
  for (std::uint32_t v = 0; v < frame.height; ++v)
    for (std::uint32_t u = 0; u < frame.width; ++u)
      ASSERT_EQ(frame.depth_m[v * frame.width + u], raw[v * kWidth + u + kLeft]) << u << ", " << v;
}

TEST_F(PortDepthCameraTest, TakesNoTornImage) {  // for ThreadSanitizer, too
  constexpr std::uint32_t kSide = 64, kImages = 5000;
  start(ROBORUN_PORT_DEPTH, kSide * kSide * 4);
  write(image(kSide, kSide));
  const OneMapping one(writer_, sut_.reader());
  ASSERT_TRUE(one.is_one());
  std::thread thread([this] {
    std::vector<float> depth_m(kSide * kSide);
    for (std::uint32_t n = 2; n <= kImages; ++n) {
      std::fill(depth_m.begin(), depth_m.end(), static_cast<float>(n));
      write(image(kSide, kSide), depth_m.data(), depth_m.size() * 4);
    }
  });
  firmware_if::DepthFrame frame;
  while (frame.sequence != kImages) {
    if (sut_.read(frame) != Status::kOk) continue;
    EXPECT_TRUE(std::all_of(frame.depth_m.begin(), frame.depth_m.end(),
                            [&](float m) { return m == static_cast<float>(frame.sequence); }))
        << "image " << frame.sequence;
  }
  thread.join();
  const PortCounters& counters = sut_.reader().counters();
  EXPECT_EQ(counters.read + counters.dropped, kImages);
}

TEST_F(PortDepthCameraTest, PutsTheOpticalAxisInTheMiddle) {
  start(ROBORUN_PORT_DEPTH, 32 * 16 * 4);
  std::vector<float> depth_m(32 * 16);
  for (std::size_t i = 0; i < depth_m.size(); ++i) depth_m[i] = 1.0F + static_cast<float>(i % 32);
  roborun_port_depth d = image(32, 16);
  d.cx = 11.5F;  // 12 columns to its left, 20 to its right
  write(d, depth_m.data(), depth_m.size() * 4);
  firmware_if::DepthFrame frame;
  ASSERT_EQ(sut_.read(frame), Status::kOk);
  EXPECT_EQ(frame.width, 24);
  EXPECT_EQ(frame.height, 16);
  EXPECT_EQ(frame.depth_m[0], 1.0F);
  EXPECT_EQ(frame.depth_m[23], 24.0F);
  EXPECT_EQ(frame.depth_m[24], 1.0F) << "the next row";
  EXPECT_FLOAT_EQ(frame.tan_half_width, 12.0F / 16.0F);
  d.cx = 19.5F;  // 20 to its left, 12 to its right
  write(d, depth_m.data(), depth_m.size() * 4);
  ASSERT_EQ(sut_.read(frame), Status::kOk);
  EXPECT_EQ(frame.width, 24);
  EXPECT_EQ(frame.depth_m[0], 9.0F);
}

TEST_F(PortDepthCameraTest, AnImageOfAnotherSizeIsTakenIfThereIsRoom) {
  start(ROBORUN_PORT_DEPTH, 32 * 16 * 4);
  const std::vector<float> depth_m(64 * 64, 2.0F);
  firmware_if::DepthFrame frame;
  write(image(32, 16), depth_m.data(), 32 * 16 * 4);
  ASSERT_EQ(sut_.read(frame), Status::kOk);
  write(image(16, 16), depth_m.data(), 16 * 16 * 4);
  ASSERT_EQ(sut_.read(frame), Status::kOk);
  EXPECT_EQ(frame.width, 16);
}

TEST_F(PortDepthCameraTest, RefusesWhatIsNoImage) {
  start(ROBORUN_PORT_DEPTH, 32 * 16 * 4);
  const std::vector<float> depth_m(32 * 16, 2.0F);
  const auto reads = [&](const std::function<void(roborun_port_depth&)>& spoil,
                         std::size_t bytes = 32 * 16 * 4) {
    roborun_port_depth d = image(32, 16);
    spoil(d);
    write(d, depth_m.data(), bytes);
    firmware_if::DepthFrame frame;
    return sut_.read(frame) == Status::kOk;
  };
  using D = roborun_port_depth;
  ASSERT_TRUE(reads([](D&) {}));
  std::uint64_t sizes = 0, optics = 0;
  const auto refused = [&](std::uint64_t more_sizes, std::uint64_t more_optics) {
    sizes += more_sizes;
    optics += more_optics;
    return sut_.refusals().size == sizes && sut_.refusals().optics == optics;
  };
  for (const auto& spoil : std::vector<std::function<void(D&)>>{
           [](D& d) { d.width = 33; }, [](D& d) { d.height = 0; }, [](D& d) { d.width = d.height = 0xFFFFU; },
           [](D& d) { d.width = 4; }, [](D& d) { d.pixel = 3; },
           [](D& d) { d.pixel = ROBORUN_PORT_UINT16; }}) {
    EXPECT_FALSE(reads(spoil));
    EXPECT_TRUE(refused(1, 0));
  }
  EXPECT_FALSE(reads([](D&) {}, 32 * 16 * 4 - 4));
  EXPECT_TRUE(refused(1, 0));
  for (const auto& spoil : std::vector<std::function<void(D&)>>{
           [](D& d) { d.fx = kNanF; }, [](D& d) { d.fy = 0.0F; }, [](D& d) { d.cx = kNanF; },
           [](D& d) { d.cx = 32.0F; }, [](D& d) { d.cy = 15.0F; }, [](D& d) { d.range_m = kInfinityF; },
           [](D& d) { d.range_m = 0.1F; }, [](D& d) { d.range_min_m = kNanF; },
           [](D& d) { d.mount.q_BS[0] = 2.0F; }, [](D& d) { d.mount.q_BS[1] = kNanF; },
           [](D& d) { d.mount.p_BS_m[2] = kInfinityF; }, [](D& d) { d.mount.p_BS_m[2] = 1.0F; }}) {
    EXPECT_FALSE(reads(spoil));
    EXPECT_TRUE(refused(0, 1));
  }
  EXPECT_TRUE(reads([](D&) {})) << "and goes on";
}

TEST_F(PortDepthCameraTest, AClockThatGoesBackCostsOneImage) {
  start(ROBORUN_PORT_DEPTH, 8 * 8 * 4);
  const std::vector<float> depth_m(64, 2.0F);
  firmware_if::DepthFrame frame;
  stamp_ns_ = 5'000'000'000;
  write(image(8, 8), depth_m.data(), 256);
  ASSERT_EQ(sut_.read(frame), Status::kOk);
  stamp_ns_ = 1'000'000'000;
  write(image(8, 8), depth_m.data(), 256);
  EXPECT_EQ(sut_.read(frame), Status::kNotReady);
  EXPECT_EQ(sut_.refusals().backwards, 1U);
  write(image(8, 8), depth_m.data(), 256);
  EXPECT_EQ(sut_.read(frame), Status::kOk);
  writer_.header->clock_offset_ns = 7;
  write(image(8, 8), depth_m.data(), 256);
  ASSERT_EQ(sut_.read(frame), Status::kOk);
  EXPECT_EQ(frame.stamp.time_since_epoch().count(), stamp_ns_ + 7 - 1000);
}

TEST_F(PortLidarTest, HandsOutPointsAndRefusesCountsThatAreNotTheirs) {
  start(ROBORUN_PORT_CLOUD, 10 * sizeof(roborun_port_point));
  std::vector<roborun_port_point> points(10, {1.0F, 2.0F, 3.0F, 0.01F});
  points[3].x_m = kNanF;
  roborun_port_cloud c{};
  c.points = 10;
  c.range_min_m = 0.5F;
  c.range_m = 70.0F;
  c.mount.q_BS[0] = 1.0F;
  write(c, points.data(), points.size() * sizeof points[0]);
  firmware_if::LidarSweep sweep;
  ASSERT_EQ(sut_.read(sweep), Status::kOk);
  ASSERT_EQ(sweep.points_L_m.size(), 10U);
  EXPECT_EQ(sweep.points_L_m[9], (std::array<float, 3>{1.0F, 2.0F, 3.0F}));
  EXPECT_TRUE(std::isnan(sweep.points_L_m[3][0]));
  c.points = 0x10000000U;  // times 16 is 2^32: 0 in 32 bits
  write(c, points.data(), 0);
  EXPECT_EQ(sut_.read(sweep), Status::kNotReady);
  c.points = 9;
  write(c, points.data(), points.size() * sizeof points[0]);
  EXPECT_EQ(sut_.read(sweep), Status::kNotReady);
  EXPECT_EQ(sut_.refusals().size, 2U);
}

TEST_F(PortImuTest, HandsOutAllInTheirOrder) {
  start(ROBORUN_PORT_IMU, 0);
  roborun_port_imu s{};
  for (int i = 0; i < 3; ++i) {
    s.specific_force_B_mps2[2] = i;
    write(s);
  }
  firmware_if::ImuSample sample;
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(sut_.read(sample), Status::kOk);
    EXPECT_EQ(sample.specific_force_B_mps2[2], i);
  }
  s.angular_rate_B_radps[1] = std::numeric_limits<double>::quiet_NaN();
  write(s);
  EXPECT_EQ(sut_.read(sample), Status::kNotReady);
  EXPECT_EQ(sut_.refusals().values, 1U);
}

TEST_F(PortOdometryTest, SaysTheLargestOfItsErrors) {
  start(ROBORUN_PORT_ODOMETRY, 0);
  roborun_port_odometry s{};
  s.reset_counter = 3;
  s.p_OB_m[1] = 4.0;
  s.q_OB[0] = 1.0;
  s.pose_variance[1] = 0.04F;
  s.pose_variance[5] = 0.01F;
  s.velocity_variance[2] = 0.25F;
  write(s);
  firmware_if::OdometrySample sample;
  ASSERT_EQ(sut_.read(sample), Status::kOk);
  EXPECT_EQ(sample.reset_counter, 3);
  EXPECT_EQ(sample.p_OB_m[1], 4.0);
  EXPECT_NEAR(sample.sigma_position_m, 0.2, 1e-6);
  EXPECT_NEAR(sample.sigma_attitude_rad, 0.1, 1e-6);
  EXPECT_NEAR(sample.sigma_speed_mps, 0.5, 1e-6);
  s.pose_variance[0] = -1.0F;
  write(s);
  EXPECT_EQ(sut_.read(sample), Status::kNotReady);
  s.pose_variance[0] = 0.0F;
  s.q_OB[0] = 0.0;
  write(s);
  EXPECT_EQ(sut_.read(sample), Status::kNotReady);
  EXPECT_EQ(sut_.refusals().values, 2U);
}

}  // namespace
}  // namespace roborun::sensor_port
