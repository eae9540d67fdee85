/// What the flight lane sees between two decisions.
#include "platform/flight/near_watch.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "core/geometry/math.hpp"

namespace roborun::flight {
namespace {

constexpr Nanos kFrame{2'500'000};

/// Shows a level wire across the way.
class WireCamera final : public firmware_if::DepthCamera {
 public:
  explicit WireCamera(std::uint16_t pixels, double turned_deg = 0.0) : pixels_(pixels) {
    depth_m_.resize(std::size_t{pixels} * pixels);
    const core::SinCos turn = core::sin_cos(turned_deg * core::kDegree);
    mount_.R_BC = {turn.cos, -turn.sin, 0, turn.sin, turn.cos, 0, 0, 0, 1};
  }
  [[nodiscard]] Status read(firmware_if::DepthFrame& frame) noexcept override {
    ++reads;
    if (!has_image_) return Status::kNotReady;
    has_image_ = false;
    ++images;
    frame = {};
    frame.stamp = stamp_ - age;
    frame.width = frame.height = pixels_;
    frame.tan_half_width = frame.tan_half_height = 1.0F;
    frame.range_m = 10.0F;
    frame.depth_m = std::span<const float>(depth_m_).first(depth_m_.size() - pixels_lost);
    return Status::kOk;
  }
  [[nodiscard]] const firmware_if::CameraMount& mount() const noexcept override { return mount_; }
  /// The wire fills a row, or `shown` pixels in its middle.
  void expose(MonotonicTime stamp, double wire_m, double above_m) {
    std::fill(depth_m_.begin(), depth_m_.end(), std::numeric_limits<float>::infinity());
    const double row = 0.5 * (1.0 - above_m / wire_m) * pixels_;
    if (wire_m > 0.0 && row > 0.0 && row < pixels_)
      std::fill_n(depth_m_.begin() + static_cast<std::ptrdiff_t>(row) * pixels_ + (pixels_ - shown()) / 2,
                  shown(), static_cast<float>(wire_m));
    stamp_ = stamp;
    has_image_ = true;
  }
  int reads{0}, images{0};
  std::optional<int> few;
  Nanos age{};                ///< The stamp is so much older than the image.
  std::size_t pixels_lost{};  ///< Of the image's memory.

 private:
  [[nodiscard]] int shown() const { return few.value_or(pixels_); }
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

  Near() { fly(kSpeed_mps); }
  void fly(double speed_mps, double acceleration_mps2 = 0.0, double for_s = 20.0) {
    flown_ = {};
    flown_.segment_count = 1;
    flown_.segment[0].duration_s = for_s;
    flown_.segment[0].coefficient[0] = Vector3(0, 0, 3);
    flown_.segment[0].coefficient[1] = Vector3(speed_mps, 0, 0);
    flown_.segment[0].coefficient[2] = Vector3(0.5 * acceleration_mps2, 0, 0);
  }
  /// When it brakes for a wire at `wire_m`; nothing: never, in 10 s.
  std::optional<double> brakes_at_s(double wire_m, Nanos decision = Nanos{3'000'000'000}) {
    std::vector<firmware_if::DepthCamera*> cameras;
    for (WireCamera& camera : camera_) cameras.push_back(&camera);
    NearWatch watch(config_, cameras);
    stages::PastStates past(Nanos{500'000'000});
    for (std::int64_t i = 1; i <= 4000; ++i) {
      const MonotonicTime now{i * kFrame};
      const TrajectoryPoint at = flown_.at(now);
      past.add({now, at.p_W, at.v_W, Quaternion::Identity()});
      if (i % 20 == 0)
        for (WireCamera& camera : camera_) camera.expose(now, wire_m - at.p_W.x(), above_m_);
      const MonotonicTime looked{now.time_since_epoch() / decision * decision};
      number_ += changes_often_ && i % 2 == 0 ? 1 : 0;
      if (watch.must_brake({now, looked, looked + decision, refused_, flown_, number_, past}))
        return seconds(now.time_since_epoch());
    }
    return std::nullopt;
  }
  std::optional<double> brakes_at_m(double wire_m, Nanos decision = Nanos{3'000'000'000}) {
    const auto at_s = brakes_at_s(wire_m, decision);
    return at_s ? std::optional(flown_.at_s(*at_s).p_W.x()) : std::nullopt;
  }
  /// Where it stands if it brakes then, after 0.1 s.
  [[nodiscard]] double stop_m(double at_s) const {
    constexpr double kStep_s = 1e-4;
    at_s += 0.1;
    for (double rate = 1.0; rate > 0.0; at_s += kStep_s * rate)
      rate -= kStep_s * kBraking_mps2 / std::max(flown_.at_s(at_s).v_W.norm(), 1.0);
    return flown_.at_s(at_s).p_W.x();
  }
  /// Least and most room between where it stands and where it would touch, for wires here and there between two images.
  std::pair<double, double> room_m() {
    double least_m = 1e9, most_m = -1e9;
    for (int i = 0; i < 50; ++i) {
      const double wire_m = 8.0 + 0.01 * i;
      const auto at_s = brakes_at_s(wire_m);
      const double m = wire_m - config_.radius_m - (at_s ? stop_m(*at_s) : 1e9);
      least_m = std::min(least_m, m);
      most_m = std::max(most_m, m);
    }
    return {least_m, most_m};
  }
  NearWatch::Config config_ = [] {
    NearWatch::Config config;
    config.radius_m = 0.7;
    config.braking_mps2 = kBraking_mps2;
    config.error.fill({.constant_m = 0.0, .quadratic_per_m = 0.0});
    return config;
  }();
  std::vector<WireCamera> camera_{WireCamera(96)};
  Trajectory flown_;
  double above_m_{0.001};
  std::uint32_t refused_{0};
  std::uint64_t number_{1};
  bool changes_often_{false};
};

TEST_F(Near, BrakesWhereItMust) {
  const auto at_m = brakes_at_m(6.0);
  ASSERT_TRUE(at_m);
  EXPECT_LT(*at_m + 0.1 * kSpeed_mps + kSpeed_mps * kSpeed_mps / (2.0 * kBraking_mps2), 6.0 - 0.7);
}

TEST_F(Near, StandsThirtyCentimetresBeforeLessWhatIsFlownBetweenTwoImages) {
  for (const double speed_mps : {0.9, 1.2, 3.0}) {
    fly(speed_mps);
    const auto [least_m, most_m] = room_m();
    EXPECT_NEAR(most_m, 0.3, 0.02 * speed_mps + 0.01) << speed_mps;
    EXPECT_NEAR(least_m, 0.3 - 0.1 * speed_mps, 0.02 * speed_mps + 0.01) << speed_mps;
  }
}

TEST_F(Near, KnowsThatThePathStillGainsSpeed) {
  fly(0.5, 0.5);
  const auto [least_m, most_m] = room_m();
  EXPECT_NEAR(most_m, 0.3, 0.1);
  EXPECT_GT(least_m, -0.05) << "2.9 m/s there";
}

TEST_F(Near, KnowsThatThePathEnds) {
  fly(kSpeed_mps, 0.0, 4.5);  // 5.4 m
  EXPECT_FALSE(brakes_at_m(6.2));
  EXPECT_TRUE(brakes_at_m(6.0));
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
  fly(0.15);
  EXPECT_FALSE(brakes_at_m(0.8)) << "it hardly moves";
  EXPECT_EQ(camera_[0].reads, 0);
  fly(0.25);
  EXPECT_TRUE(brakes_at_m(2.0));
}

TEST_F(Near, LooksWhereItFlies) {
  camera_ = {WireCamera(96, 180.0), WireCamera(96, 80.0), WireCamera(96, 50.0), WireCamera(96)};
  fly(4.0);
  EXPECT_TRUE(brakes_at_m(20.0));
  EXPECT_EQ(camera_[0].reads, 0) << "it looks back";
  EXPECT_EQ(camera_[1].reads, 0) << "what it shows is beside a way of 4 m";
  for (const std::size_t i : {2U, 3U}) {
    EXPECT_GT(camera_[i].reads, 10);
    EXPECT_LT(camera_[i].reads, 60) << "ten images a second";
  }
}

TEST_F(Near, OfASlowVehicleWhatLooksAsideSeesWhatItWouldTouch) {
  camera_ = {WireCamera(96, 180.0), WireCamera(96, 90.0), WireCamera(96)};
  fly(0.6);
  EXPECT_TRUE(brakes_at_m(3.0));
  EXPECT_EQ(camera_[0].reads, 0) << "it looks back";
  EXPECT_GT(camera_[1].reads, 10) << "its way is shorter than the body is wide";
}

TEST_F(Near, DoesNotBelieveACameraThatDecisionsRefuse) {
  camera_ = {WireCamera(96), WireCamera(96), WireCamera(96)};
  refused_ = 7;
  EXPECT_FALSE(brakes_at_m(6.0));
  refused_ = 3;
  EXPECT_TRUE(brakes_at_m(6.0));
}

TEST_F(Near, NeedsThreePixels) {
  camera_[0].few = 2;
  EXPECT_FALSE(brakes_at_m(6.0));
  camera_[0].few = 3;
  EXPECT_TRUE(brakes_at_m(6.0));
  camera_ = {WireCamera(640)};  // in pieces
  camera_[0].few = 2;
  EXPECT_FALSE(brakes_at_m(6.0));
}

TEST_F(Near, KnowsHowWrongADepthMayBe) {
  above_m_ = 0.6;  // in view as long as it is 0.6 m ahead
  EXPECT_TRUE(brakes_at_m(6.0));
  config_.error[0] = {.constant_m = 0.02, .quadratic_per_m = 0.0, .place_m = 0.02};
  EXPECT_TRUE(brakes_at_m(6.0)) << "0.62 m are left of 0.7";
  config_.error[0].place_m = 0.035;
  EXPECT_FALSE(brakes_at_m(6.0)) << "0.59 m are";
  config_.error[0] = {.constant_m = 0.0, .quadratic_per_m = 0.08};
  EXPECT_TRUE(brakes_at_m(6.0)) << "0.62 m";
  config_.error[0].quadratic_per_m = 0.2;
  EXPECT_FALSE(brakes_at_m(6.0)) << "0.56 m at most";
}

TEST_F(Near, LooksAtALargeImageInPieces) {
  camera_ = {WireCamera(640)};
  const auto large_m = brakes_at_m(6.0);
  camera_ = {WireCamera(96)};
  const auto small_m = brakes_at_m(6.0);
  ASSERT_TRUE(large_m && small_m);
  EXPECT_NEAR(*large_m, *small_m + 12 * 0.0025 * kSpeed_mps, 0.004) << "half of 410,000 pixels are 13 frames";
}

TEST_F(Near, AnImageSaysNothingOfAPathThatWasCommittedLater) {
  changes_often_ = true;
  EXPECT_TRUE(brakes_at_m(6.0)) << "of one piece";
  camera_ = {WireCamera(640)};
  EXPECT_FALSE(brakes_at_m(6.0));
}

TEST_F(Near, LeavesAnImageThatItBeganBeforeDecisionsLookedOften) {
  for (const bool is_interrupted : {false, true}) {
    WireCamera camera(640);
    std::vector<firmware_if::DepthCamera*> cameras{&camera};
    NearWatch watch(config_, cameras);
    stages::PastStates past(Nanos{500'000'000});
    bool brakes = false;
    int since = 0;
    for (std::int64_t i = 1; i <= 100; ++i) {
      const MonotonicTime now{i * kFrame};
      const TrajectoryPoint at = flown_.at(now);
      past.add({now, at.p_W, at.v_W, Quaternion::Identity()});
      if (i == 4) camera.expose(now, 1.0, above_m_);
      since += camera.images;
      const bool looks_often = is_interrupted && since == 5;
      const MonotonicTime looked = looks_often ? now : now - Nanos{1'000'000'000};
      brakes = watch.must_brake({now, looked, looked + Nanos{50'000'000}, 0, flown_, 1, past}) || brakes;
    }
    EXPECT_GT(since, 20);
    EXPECT_EQ(brakes, !is_interrupted);
  }
}

TEST_F(Near, TakesNoImageThatIsOldOrOfAnotherSize) {
  camera_[0].age = Nanos{600'000'000};
  EXPECT_FALSE(brakes_at_m(6.0)) << "nobody knows where it was taken";
  camera_[0].age = {};
  camera_[0].pixels_lost = 96;
  EXPECT_FALSE(brakes_at_m(6.0));
  camera_.clear();
  EXPECT_FALSE(brakes_at_m(6.0)) << "there is none";
}

}  // namespace
}  // namespace roborun::flight
