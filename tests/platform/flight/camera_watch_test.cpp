/// Cameras that were turned by a bump, and those that were not; what the estimate adds to an image's error.
#include "platform/flight/camera_watch.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/geometry/math.hpp"
#include "core/random/counter_rng.hpp"
#include "platform/flight/decision_program.hpp"
#include "tests/support/box_view.hpp"

namespace roborun::flight {
namespace {

constexpr std::uint16_t kSide = 32;

/// Looks down an axis from the middle of a hall of 20 x 16 x 6 m, with pillars and crates, or with one wide block.
class Hall {
 public:
  explicit Hall(bool has_block = false) {
    view_.free_W = Aabb{Vector3(-10, -8, 0), Vector3(10, 8, 6)};
    if (has_block) {
      view_.occupied.push_back(Aabb{Vector3(0, 1.6, 0), Vector3(6, 8, 6)});
      return;
    }
    for (const Vector3& at_W :
         {Vector3(5, 2, 0), Vector3(6, -2.5, 0), Vector3(3.5, -4, 0), Vector3(8, 4.5, 0)})
      view_.occupied.push_back(Aabb{at_W, at_W + Vector3(0.6, 0.6, 6)});
    view_.occupied.push_back(Aabb{Vector3(4, -0.8, 0), Vector3(5, 0.4, 1.2)});
  }
  [[nodiscard]] const stages::MapView& view() const { return view_; }

  /// As a camera sees it that is believed to look along x, and truly is turned so; degrees, to the left and upwards.
  [[nodiscard]] stages::PosedDepthFrame image(double left_deg, double up_deg, double noise_ratio = 0.0) {
    const core::SinCos left = core::sin_cos(left_deg * core::kDegree);
    const core::SinCos up = core::sin_cos(up_deg * core::kDegree);
    Matrix3 yaw, pitch;
    yaw << left.cos, -left.sin, 0, left.sin, left.cos, 0, 0, 0, 1;
    pitch << up.cos, 0, -up.sin, 0, 1, 0, up.sin, 0, up.cos;
    const Matrix3 R = yaw * pitch;
    for (int v = 0; v < kSide; ++v)
      for (int u = 0; u < kSide; ++u) {
        const Vector3 ray_C(1.0, 1.0 - (2.0 * u + 1.0) / kSide, 1.0 - (2.0 * v + 1.0) / kSide);
        const double depth_m = depth_along(R * ray_C) * (1.0 + noise_ratio * rng_.normal());
        depth_m_[static_cast<std::size_t>(v * kSide + u)] = static_cast<float>(depth_m);
      }
    return posed();
  }
  [[nodiscard]] stages::PosedDepthFrame image_of(double (*depth_m)(int u, int v, core::CounterRng&)) {
    for (int v = 0; v < kSide; ++v)
      for (int u = 0; u < kSide; ++u)
        depth_m_[static_cast<std::size_t>(v * kSide + u)] = static_cast<float>(depth_m(u, v, rng_));
    return posed();
  }
  /// A body in front of what is there, over so many columns of the image, from the left one on or another one.
  [[nodiscard]] stages::PosedDepthFrame behind_body(int columns, float body_m = 2.0F, int first = 0) {
    stages::PosedDepthFrame frame = image(0, 0);
    for (int v = 0; v < kSide; ++v)
      for (int u = first; u < first + columns; ++u) {
        float& depth_m = depth_m_[static_cast<std::size_t>(v * kSide + u)];
        depth_m = std::min(depth_m, body_m);
      }
    return frame;
  }

 private:
  static inline const Vector3 kEye_W{-2.0, 0.5, 2.5};
  [[nodiscard]] stages::PosedDepthFrame posed() const {
    stages::PosedDepthFrame frame;
    frame.frame.width = frame.frame.height = kSide;
    frame.frame.tan_half_width = frame.frame.tan_half_height = 1.0F;
    frame.frame.range_m = 25.0F;
    frame.frame.depth_m = depth_m_;
    frame.X_WC.p_RT = kEye_W;
    frame.X_WC.R_RT = Matrix3::Identity();
    return frame;
  }
  [[nodiscard]] double depth_along(const Vector3& ray_W) const {
    std::uint64_t lookups = 0;
    double depth_m = 0.0;
    while (depth_m < 25.0 && view_.at(kEye_W + depth_m * ray_W, lookups) == stages::CellState::kFree)
      depth_m += 0.02;
    return depth_m;
  }
  test::BoxView view_;
  std::vector<float> depth_m_ = std::vector<float>(kSide * kSide);
  core::CounterRng rng_{7};
};

TEST(CameraWatch, SaysTurnedWhicheverWayItWasTurned) {
  Hall hall;
  for (const auto& [left_deg, up_deg] :
       {std::pair{12.0, 12.0}, {12.0, -10.0}, {-12.0, 0.0}, {0.0, 12.0}, {-10.0, -12.0}, {16.0, 4.0}})
    EXPECT_EQ(agreement_of(hall.image(left_deg, up_deg), hall.view()), Agreement::kTurned)
        << left_deg << " to the left, " << up_deg << " up";
  EXPECT_EQ(agreement_of(hall.image(12.0, 12.0, 0.02), hall.view()), Agreement::kTurned) << "with noise";
}

TEST(CameraWatch, AgreesWhereNothingWasTurnedHoweverOftenItLooks) {
  Hall hall;
  for (int i = 0; i < 10; ++i) EXPECT_EQ(agreement_of(hall.image(0, 0), hall.view()), Agreement::kAgrees);
  EXPECT_EQ(agreement_of(hall.image(0, 0, 0.03), hall.view()), Agreement::kAgrees) << "with noise";
  EXPECT_EQ(agreement_of(hall.image(1.5, -1.5), hall.view()), Agreement::kAgrees)
      << "within the mount's error";
}

TEST(CameraWatch, FogAndBodiesAreNoTurn) {
  Hall hall;
  const auto fog = hall.image_of([](int, int, core::CounterRng& rng) { return 1.2 + 2.0 * rng.uniform(); });
  EXPECT_NE(agreement_of(fog, hall.view()), Agreement::kTurned);
  const auto wall = hall.image_of([](int, int, core::CounterRng&) { return 3.0; });
  EXPECT_NE(agreement_of(wall, hall.view()), Agreement::kTurned);
  for (const int columns : {8, 16, 24})
    EXPECT_NE(agreement_of(hall.behind_body(columns), hall.view()), Agreement::kTurned) << columns;
  EXPECT_EQ(agreement_of(hall.behind_body(8), hall.view()), Agreement::kAgrees);
}

// Turned, all of it would lie where known space ends.
TEST(CameraWatch, ABodyBesideABlockIsNoTurn) {
  Hall hall(true);
  EXPECT_EQ(agreement_of(hall.behind_body(4, 2.5F, 10), hall.view()), Agreement::kUnknown);
}

TEST(CameraWatch, KnowsNothingOfSpaceThatNobodyKnowsNorOfAnEmptyImage) {
  Hall hall;
  const test::BoxView nothing;
  EXPECT_NE(agreement_of(hall.image(12, 12), nothing), Agreement::kTurned);
  EXPECT_NE(agreement_of(hall.image(12, 12), nothing), Agreement::kDisagrees);
  const auto sky = hall.image_of([](int, int, core::CounterRng&) { return 25.0; });
  EXPECT_EQ(agreement_of(sky, hall.view()), Agreement::kUnknown);
}

TEST(PlaceError, IsWhatTheMarginsDoNotHoldYetAndTheDriftAsAnAngle) {
  stages::EstimatedState state;
  state.map_sigma_m = kSureWithin_m;
  state.map_sigma_rad = kSureWithin_rad;
  state.position_sigma_m = 9.0;
  DepthError error = place_error(state);
  EXPECT_EQ(error.place_m, 0.0) << "the error on the earth moves map and vehicle alike";
  EXPECT_EQ(error.angle_rad, 0.0);
  EXPECT_EQ(error.at_m(10.0), 0.0);
  state.map_sigma_m += 0.2;
  state.map_sigma_rad += 0.01;
  state.drift_ratio = 0.02;
  error = place_error(state);
  EXPECT_NEAR(error.place_m, 0.2, 1e-12);
  EXPECT_NEAR(error.angle_rad, 0.03, 1e-12);
}

}  // namespace
}  // namespace roborun::flight
