// The rules of the frame guard one by one, at their edges, with images that are made for each of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "core/random/counter_rng.hpp"
#include "stages/perception/depth_steps.hpp"
#include "stages/perception/frame_guard.hpp"
#include "tests/support/limits.hpp"

namespace roborun::stages {
namespace {

using core::CounterRng;
using test::kNan, test::kNanF;
constexpr float kNothing = std::numeric_limits<float>::infinity();
constexpr float kBlack = 0.0F;
constexpr std::size_t kLooks = 256;  // 16 x 16 pixels are looked at for information

MonotonicTime at_s(double time_s) { return MonotonicTime{} + from_seconds(time_s); }

/// An image that owns its pixels, of a camera with noise that looks straight down.
struct Image {
  std::vector<float> depth_m;
  PosedDepthFrame posed;

  explicit Image(std::uint16_t width = 16, std::uint16_t height = 16, float depth = 5.0F)
      : depth_m(std::size_t{width} * height, depth) {
    posed.frame.width = width;
    posed.frame.height = height;
    posed.frame.tan_half_width = posed.frame.tan_half_height = 1.0F;
    posed.frame.range_m = 20.0F;
    posed.frame.range_min_m = 0.2F;
    posed.frame.stamp = at_s(10.0);
    posed.frame.depth_m = depth_m;
    posed.X_WC.R_RT << 0, 0, 1, 0, 1, 0, -1, 0, 0;
  }
  Image(const Image&) = delete;
  Image& operator=(const Image&) = delete;

  FrameFault judge(FrameGuard& guard) {
    guard.begin({&posed, 1});
    return guard.judge(posed);
  }
  FrameFault judge() {
    FrameGuard guard;
    return judge(guard);
  }
};

TEST(FrameRules, ShapeHasEdges) {
  const auto sized = [](std::uint16_t width, std::uint16_t height) {
    const Image image(width, height);
    return check_shape(image.posed) == Status::kOk;
  };
  EXPECT_TRUE(sized(8, 8));
  EXPECT_FALSE(sized(7, 8));
  EXPECT_FALSE(sized(8, 7));
  EXPECT_TRUE(sized(kMaxImageSide, 8));
  EXPECT_TRUE(sized(8, kMaxImageSide));
  EXPECT_FALSE(sized(kMaxImageSide + 1, 8));
  EXPECT_FALSE(sized(8, kMaxImageSide + 1));
  using F = firmware_if::DepthFrame;
  const auto with = [](auto change) {
    Image image;
    change(image.posed.frame);
    const bool good = check_shape(image.posed) == Status::kOk;
    EXPECT_EQ(image.judge() != FrameFault::kShape, good);
    return good;
  };
  EXPECT_FALSE(with([](F& f) { f.depth_m = f.depth_m.first(255); }));
  EXPECT_TRUE(with([](F& f) { f.range_m = kMaxRange_m; }));
  EXPECT_FALSE(with([](F& f) { f.range_m = std::nextafter(kMaxRange_m, kNothing); }));
  EXPECT_FALSE(with([](F& f) { f.range_m = f.range_min_m; }));
  EXPECT_TRUE(with([](F& f) { f.range_m = std::nextafter(f.range_min_m, 1.0F); }));
  EXPECT_FALSE(with([](F& f) { f.range_m = f.range_min_m = 0.0F; }));
  EXPECT_TRUE(with([](F& f) { f.range_min_m = 0.0F; }));
  EXPECT_FALSE(with([](F& f) { f.range_min_m = -0.001F; }));
  EXPECT_FALSE(with([](F& f) { f.range_m = kNanF; }));
  for (float F::*tangent : {&F::tan_half_width, &F::tan_half_height}) {
    EXPECT_TRUE(with([tangent](F& f) { f.*tangent = kMaxTanHalfFov; }));
    EXPECT_FALSE(with([tangent](F& f) { f.*tangent = std::nextafter(kMaxTanHalfFov, kNothing); }));
    EXPECT_FALSE(with([tangent](F& f) { f.*tangent = 0.0F; }));
    EXPECT_TRUE(with([tangent](F& f) { f.*tangent = 0.001F; }));
  }
  Image lost;
  lost.posed.X_WC.p_RT.x() = kNan;
  EXPECT_EQ(lost.judge(), FrameFault::kShape);
  Image turned;
  turned.posed.X_WC.R_RT(1, 2) = kNan;
  EXPECT_EQ(turned.judge(), FrameFault::kShape);
  FrameGuard guard;
  guard.begin({&turned.posed, 1});
  EXPECT_EQ(guard.check(turned.posed), Status::kInvalidArgument);
  EXPECT_EQ(check_frame(turned.posed), Status::kInvalidArgument);
}

TEST(FrameRules, AFrameNeedsAPixelThatKnowsSomething) {
  Image up(16, 16, 0.2F);  // the least range itself means nothing
  up.posed.X_WC.R_RT << 0, 0, -1, 0, 1, 0, 1, 0, 0;
  EXPECT_EQ(check_frame(up.posed), Status::kInvalidArgument);
  up.depth_m[77] = 0.21F;
  EXPECT_EQ(check_frame(up.posed), Status::kOk);
}

/// The pixels at which the guard looks, of those that look down: written anew from the contract.
std::vector<std::size_t> looks_down(const PosedDepthFrame& posed) {
  const firmware_if::DepthFrame& f = posed.frame;
  std::vector<std::size_t> pixels;
  for (std::size_t n = 0; n < kLooks; ++n) {
    const std::size_t u = (n % 16) * f.width / 16 + f.width / 32U,
                      v = n / 16 * f.height / 16 + f.height / 32U;
    const double y = (0.5 * f.width - 0.5 - static_cast<double>(u)) / (0.5 * f.width);
    const double z = (0.5 * f.height - 0.5 - static_cast<double>(v)) / (0.5 * f.height);
    const Vector3 ray_W = posed.X_WC.R_RT * Vector3(1.0, y * static_cast<double>(f.tan_half_width),
                                                    z * static_cast<double>(f.tan_half_height));
    if (ray_W.z() <= -kDownwards * ray_W.norm()) pixels.push_back(v * f.width + u);
  }
  return pixels;
}

/// With `known` of the pixels of `down` informed (chosen by `rng`), and all others as `elsewhere_m` says.
FrameFault fault_of(Image& image, std::vector<std::size_t> down, std::size_t known, float elsewhere_m,
                    CounterRng& rng) {
  for (std::size_t i = down.size(); i > 1; --i)
    std::swap(down[i - 1], down[static_cast<std::size_t>(rng.below(i))]);
  std::fill(image.depth_m.begin(), image.depth_m.end(), elsewhere_m);
  for (std::size_t i = 0; i < down.size(); ++i) image.depth_m[down[i]] = i < known ? 5.0F : kBlack;
  const FrameFault fault = image.judge();
  EXPECT_EQ(check_frame(image.posed) == Status::kOk, fault == FrameFault::kNone);
  return fault;
}

TEST(FrameRules, AQuarterOfWhatLooksDownIsInformed) {
  CounterRng rng(3);
  for (int round = 0; round < 300; ++round) {
    // Sizes of which the guard's pixels are whole ones, and of which they are not.
    const auto side = [&rng] { return static_cast<std::uint16_t>(16 + 16 * rng.below(5)); };
    Image image(side(), side());
    image.posed.frame.tan_half_width = static_cast<float>(rng.uniform(0.3, 1.9));
    image.posed.frame.tan_half_height = static_cast<float>(rng.uniform(0.3, 1.9));
    const auto turn = [&](const Vector3& axis) { return Eigen::AngleAxisd(rng.uniform(-3.0, 3.0), axis); };
    image.posed.X_WC.R_RT =
        (turn(Vector3::UnitZ()) * turn(Vector3::UnitY()) * turn(Vector3::UnitX())).toRotationMatrix();
    const std::vector<std::size_t> down = looks_down(image.posed);
    if (down.empty()) {
      std::fill(image.depth_m.begin(), image.depth_m.end(), kNanF);
      EXPECT_EQ(image.judge(), FrameFault::kNone) << "no pixel has to know anything";
      continue;
    }
    const std::size_t quarter = (down.size() + 3) / 4;
    EXPECT_EQ(fault_of(image, down, quarter, kBlack, rng), FrameFault::kNone) << round;
    if (quarter > 1) {
      EXPECT_NE(fault_of(image, down, quarter - 1, 5.0F, rng), FrameFault::kNone) << round;
    }
    const std::size_t twentieth = (down.size() + 19) / 20;
    if (twentieth < quarter) {
      EXPECT_EQ(fault_of(image, down, twentieth, kBlack, rng), FrameFault::kFog) << round;
      EXPECT_EQ(fault_of(image, down, twentieth - 1, 5.0F, rng), FrameFault::kCovered) << round;
    }
  }
}

// Exactly a quarter and exactly a twentieth, in the columns and in the rows of one side.
TEST(FrameRules, ExactlyAQuarterIsEnough) {
  CounterRng rng(4);
  for (const bool rows : {false, true}) {
    for (const std::size_t side : {0U, 12U}) {
      Image image(16, 16, kBlack);
      for (std::size_t p = 0; p < kLooks; ++p) {
        const std::size_t at = rows ? p / 16 : p % 16;
        if (at >= side && at < side + 4) image.depth_m[p] = 5.0F;
      }
      EXPECT_EQ(image.judge(), FrameFault::kNone);
      image.depth_m[side * (rows ? 16 : 1)] = 0.2F;
      EXPECT_EQ(image.judge(), FrameFault::kFog) << "the least range itself means nothing";
    }
  }
  int seen = 0;
  for (double pitch_rad = 0.0; pitch_rad < 1.5; pitch_rad += 0.01) {
    Image image;
    image.posed.X_WC.R_RT = Eigen::AngleAxisd(pitch_rad, Vector3::UnitY()).toRotationMatrix();
    const std::vector<std::size_t> down = looks_down(image.posed);
    if (down.empty() || down.size() % 20 != 0) continue;
    ++seen;
    EXPECT_EQ(fault_of(image, down, down.size() / 20, kBlack, rng), FrameFault::kFog) << pitch_rad;
  }
  EXPECT_GT(seen, 3);
}

TEST(FrameRules, OfACloudNoPixelHasToKnowAnything) {
  Image image(16, 16, kBlack);
  EXPECT_EQ(image.judge(), FrameFault::kCovered);
  image.posed.is_cloud = true;
  EXPECT_EQ(image.judge(), FrameFault::kNone);
}

/// Whether an image and the same one with another stamp are one too many.
FrameFault judge_twice(Image& image) {
  FrameGuard guard;
  EXPECT_EQ(image.judge(guard), FrameFault::kNone);
  image.posed.frame.stamp = at_s(10.1);
  const FrameFault fault = image.judge(guard);
  image.posed.frame.stamp = at_s(10.0);
  return fault;
}

TEST(FrameRules, SixtyFourPixelsTellAFrozenImage) {
  for (std::size_t p = 0; p < kLooks; ++p) {
    Image image;
    FrameGuard guard;
    ASSERT_EQ(image.judge(guard), FrameFault::kNone);
    image.posed.frame.stamp = at_s(10.1);
    image.depth_m[p] = 5.001F;
    ASSERT_EQ(image.judge(guard), p % 4 == 2 ? FrameFault::kNone : FrameFault::kFrozen) << p;
  }
  Image image;
  for (const auto& error : {DepthError{0.005, 0.0}, DepthError{0.0, 0.0004}}) {
    image.posed.error = error;
    EXPECT_EQ(judge_twice(image), FrameFault::kFrozen);
  }
  FrameGuard guard;
  EXPECT_EQ(image.judge(guard), FrameFault::kNone);
  EXPECT_EQ(guard.check_content(image.posed), Status::kOk) << "the same stamp";
  image.posed.frame.stamp = at_s(10.1);
  EXPECT_EQ(guard.check_content(image.posed), Status::kInvalidArgument);
  EXPECT_EQ(guard.check(image.posed), Status::kInvalidArgument) << "asked again: the same answer";
}

TEST(FrameRules, NoPixelBehindTheImageIsLookedAt) {
  Image image;
  image.depth_m.resize(kLooks + 8, 5.0F);
  image.posed.frame.depth_m = std::span(image.depth_m).first(kLooks);
  FrameGuard guard;
  EXPECT_EQ(image.judge(guard), FrameFault::kNone);
  image.posed.frame.stamp = at_s(10.1);
  std::fill(image.depth_m.begin() + kLooks, image.depth_m.end(), 6.0F);
  EXPECT_EQ(image.judge(guard), FrameFault::kFrozen);
}

TEST(FrameRules, EightSurfacesMakeAPrint) {
  const auto with = [](std::size_t surfaces, float other_m) {
    Image image(16, 16, other_m);
    for (std::size_t i = 0; i < surfaces; ++i) image.depth_m[4 * i + 2] = 5.0F;
    return judge_twice(image);
  };
  EXPECT_EQ(with(8, kNothing), FrameFault::kFrozen);
  EXPECT_EQ(with(7, kNothing), FrameFault::kNone);
  EXPECT_EQ(with(7, 20.0F), FrameFault::kNone) << "the range itself is nothing within it";
  // The least range is no surface, and the last of the pixels counts as the first.
  Image image(16, 16, kNothing);
  for (std::size_t i = 57; i < 64; ++i) image.depth_m[4 * i + 2] = 5.0F;
  image.depth_m[2] = 0.2F;
  EXPECT_EQ(judge_twice(image), FrameFault::kNone);
  image.depth_m[2] = 0.21F;
  EXPECT_EQ(judge_twice(image), FrameFault::kFrozen);
}

// A ray of a cloud that met nothing ends at its range, not at the same depth.
TEST(FrameRules, ARayOfACloudEndsAtItsRange) {
  for (const bool is_cloud : {true, false}) {
    for (std::size_t i = 0; i < 64; ++i) {
      const std::size_t p = 4 * i + 2;
      Image image(16, 16, kNothing);
      image.posed.is_cloud = is_cloud;
      image.posed.frame.tan_half_width = 1.5F;
      image.posed.frame.tan_half_height = 0.4F;
      for (std::size_t k = 1; k <= 7; ++k) image.depth_m[4 * ((i + k) % 64) + 2] = 1.0F;
      const auto corner = [](std::size_t at) {
        return std::max(std::fabs(static_cast<double>(at) / 8.0 - 1.0),
                        std::fabs(static_cast<double>(at + 1) / 8.0 - 1.0));
      };
      const double ray = std::hypot(1.0, 1.5 * corner(p % 16), static_cast<double>(0.4F) * corner(p / 16));
      const double end_m = 20.0 / ray;
      image.depth_m[p] = static_cast<float>(end_m * 0.9999);
      EXPECT_EQ(judge_twice(image), FrameFault::kFrozen) << i;
      image.depth_m[p] = static_cast<float>(end_m * 1.0001);
      EXPECT_EQ(judge_twice(image), is_cloud ? FrameFault::kNone : FrameFault::kFrozen) << i;
    }
  }
}

TEST(FrameRules, ThirtyTwoImagesAreRemembered) {
  for (const int others : {31, 32}) {
    FrameGuard guard;
    Image image;
    for (int n = 0; n <= others; ++n) {
      image.depth_m[2] = 5.0F + 0.01F * static_cast<float>(n);
      image.posed.frame.stamp = at_s(10.0 + 0.1 * n);
      ASSERT_EQ(image.judge(guard), FrameFault::kNone);
    }
    image.depth_m[2] = 5.0F;
    image.posed.frame.stamp = at_s(20.0);
    EXPECT_EQ(image.judge(guard), others == 31 ? FrameFault::kFrozen : FrameFault::kNone);
  }
}

struct Scan {
  Image image;
  std::vector<PosedDepthFrame> frames;
  explicit Scan(std::initializer_list<double> stamps_s) {
    for (const double s : stamps_s) {
      frames.push_back(image.posed);
      frames.back().frame.stamp = at_s(s);
      frames.back().error = {0.0, 0.0};
    }
  }
  int refused(FrameGuard& guard) const {
    guard.begin(frames);
    return static_cast<int>(std::ranges::count_if(
        frames, [&](const PosedDepthFrame& f) { return guard.judge(f) == FrameFault::kStamp; }));
  }
};

TEST(FrameRules, StampsLieAroundTheMiddleOne) {
  FrameGuard guard;
  EXPECT_EQ(Scan({-1.0}).refused(guard), 0) << "the first one, before the clock's zero";
  EXPECT_EQ(Scan({10.4, 10.0, 10.2}).refused(guard), 0);
  EXPECT_EQ(Scan({10.3, 10.0, 10.1, 10.35, 10.35}).refused(guard), 1);
  EXPECT_EQ(Scan({10.25, 10.0, 10.5}).refused(guard), 0) << "a quarter of a second is near enough";
  EXPECT_EQ(Scan({10.25, 9.9999, 10.5001}).refused(guard), 2);
}

TEST(FrameRules, AScanMayBeAQuarterOfASecondOlder) {
  FrameGuard guard;
  EXPECT_EQ(Scan({10.0}).refused(guard), 0);
  EXPECT_EQ(Scan({9.75}).refused(guard), 0);
  EXPECT_EQ(Scan({9.4999}).refused(guard), 1);
  EXPECT_EQ(Scan({20.0}).refused(guard), 0);
  guard.begin({});
  const Scan now({20.0});
  EXPECT_EQ(guard.judge(now.frames[0]), FrameFault::kNone) << "a scan of no frame is none";
}

}  // namespace
}  // namespace roborun::stages
