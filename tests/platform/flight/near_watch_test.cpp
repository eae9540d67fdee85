/// What the flight lane sees between two decisions.
#include "platform/flight/near_watch.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <vector>

namespace roborun::flight {
namespace {

constexpr Nanos kFrame{2'500'000};

/// Has an image every 50 ms: a level wire, so many metres ahead of where the vehicle begins.
class WireCamera final : public firmware_if::DepthCamera {
 public:
  explicit WireCamera(std::uint16_t pixels, bool looks_back = false) : pixels_(pixels) {
    depth_m_.resize(std::size_t{pixels} * pixels);
    if (looks_back) mount_.R_BC = {-1, 0, 0, 0, -1, 0, 0, 0, 1};
  }
  [[nodiscard]] Status read(firmware_if::DepthFrame& frame) noexcept override {
    ++reads;
    if (!has_image_) return Status::kNotReady;
    has_image_ = false;
    frame = {};
    frame.stamp = stamp_;
    frame.width = frame.height = pixels_;
    frame.tan_half_width = frame.tan_half_height = 1.0F;
    frame.range_m = 10.0F;
    frame.depth_m = depth_m_;
    return Status::kOk;
  }
  [[nodiscard]] const firmware_if::CameraMount& mount() const noexcept override { return mount_; }
  /// The wire fills the row in the middle.
  void expose(MonotonicTime stamp, double wire_m) {
    std::fill(depth_m_.begin(), depth_m_.end(), std::numeric_limits<float>::infinity());
    std::fill_n(depth_m_.begin() + pixels_ / 2 * pixels_, pixels_, static_cast<float>(wire_m));
    stamp_ = stamp;
    has_image_ = true;
  }
  int reads{0};

 private:
  std::uint16_t pixels_;
  std::vector<float> depth_m_;
  firmware_if::CameraMount mount_{};
  MonotonicTime stamp_{};
  bool has_image_{false};
};

/// Straight ahead at 1.2 m/s.
class Near : public ::testing::Test {
 protected:
  static constexpr double kSpeed_mps = 1.2;
  static constexpr double kBraking_mps2 = 2.5;

  Near() {
    flown_.segment_count = 1;
    flown_.segment[0].duration_s = 20.0;
    flown_.segment[0].coefficient[0] = Vector3(0, 0, 3);
    flown_.segment[0].coefficient[1] = Vector3(kSpeed_mps, 0, 0);
  }
  static NearWatch::Config config() {
    NearWatch::Config config;
    config.radius_m = 0.7;
    config.braking_mps2 = kBraking_mps2;
    return config;
  }
  /// Where the vehicle is when it has to brake for a wire at `wire_m`; nothing: never, in 10 s.
  std::optional<double> brakes_at_m(double wire_m, Nanos decision = Nanos{3'000'000'000}) {
    std::vector<firmware_if::DepthCamera*> cameras;
    for (WireCamera& camera : camera_) cameras.push_back(&camera);
    NearWatch watch(config(), cameras);
    stages::PastStates past(Nanos{500'000'000});
    for (std::int64_t i = 1; i <= 4000; ++i) {
      const MonotonicTime now{i * kFrame};
      const TrajectoryPoint at = flown_.at(now);
      past.add({now, at.p_W, at.v_W, Quaternion::Identity()});
      if (i % 20 == 0)
        for (WireCamera& camera : camera_) camera.expose(now, wire_m - at.p_W.x());
      const MonotonicTime looked{now.time_since_epoch() / decision * decision};
      if (watch.must_brake({now, looked, looked + decision, refused_, flown_, number_, past}))
        return at.p_W.x();
    }
    return std::nullopt;
  }
  std::vector<WireCamera> camera_{WireCamera(96)};
  Trajectory flown_;
  std::uint32_t refused_{0};
  std::uint64_t number_{1};
};

TEST_F(Near, BrakesWhereItMust) {
  const auto at_m = brakes_at_m(6.0);
  ASSERT_TRUE(at_m);
  const double stop_m = kSpeed_mps * kSpeed_mps / (2.0 * kBraking_mps2);
  EXPECT_LT(*at_m + 0.1 * kSpeed_mps + stop_m, 6.0 - 0.7) << "it would be touched";
  EXPECT_GT(*at_m + 0.1 * kSpeed_mps + stop_m, 6.0 - 0.7 - 0.3 - 0.01) << "decisions see it, too";
}

TEST_F(Near, LeavesItToDecisionsThatLookOften) {
  EXPECT_FALSE(brakes_at_m(6.0, Nanos{100'000'000}));
  EXPECT_EQ(camera_[0].reads, 0);
  EXPECT_TRUE(brakes_at_m(6.0, NearWatch::kOften));
}

TEST_F(Near, DoesNotBrakeForWhatIsNotInTheWay) {
  EXPECT_FALSE(brakes_at_m(40.0));
  camera_[0].reads = 0;
  flown_ = Trajectory::hold(Vector3(0, 0, 3), MonotonicTime{});
  EXPECT_FALSE(brakes_at_m(0.5)) << "it stands";
  EXPECT_EQ(camera_[0].reads, 0);
}

TEST_F(Near, LooksWhereItFlies) {
  camera_ = {WireCamera(96, true), WireCamera(96)};
  EXPECT_TRUE(brakes_at_m(6.0));
  EXPECT_EQ(camera_[0].reads, 0) << "it looks back";
  EXPECT_GT(camera_[1].reads, 10);
  EXPECT_LT(camera_[1].reads, 60) << "ten images a second";
}

TEST_F(Near, DoesNotBelieveACameraThatDecisionsRefuse) {
  refused_ = 1;
  EXPECT_FALSE(brakes_at_m(6.0));
}

TEST_F(Near, LooksAtALargeImageInPieces) {
  camera_ = {WireCamera(640)};
  const auto large_m = brakes_at_m(6.0);
  camera_ = {WireCamera(96)};
  const auto small_m = brakes_at_m(6.0);
  ASSERT_TRUE(large_m && small_m);
  EXPECT_GT(*large_m, *small_m) << "half of 410,000 pixels are seven frames";
  EXPECT_LT(*large_m, *small_m + 13 * 0.0025 * kSpeed_mps);
}

}  // namespace
}  // namespace roborun::flight
