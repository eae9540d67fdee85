#include "platform/sitl/fault/faulty_sensors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/executive/frame_table.hpp"
#include "platform/sitl/sensors/depth_camera.hpp"
#include "platform/sitl/world/world.hpp"

namespace roborun::sitl {
namespace {

struct Bench {
  NavigationSensorsConfig config{};
  FaultLine line{};
  FaultySensors sensors{NavigationSensors(config, 7)};
  NavigationSensors twin{config, 7};
  VehicleState state{};
  MonotonicTime now{};

  explicit Bench(const NavigationSensorsConfig& sensors_config = {}) : config(sensors_config) {
    sensors.connect(&line);
  }
  void frame() {
    now += core::kMinorFrame;
    line.advance(now);
    state.p_WB.x() += 0.01;
    sensors.sample(now, state);
    twin.sample(now, state);
  }
  void run(double time_s) {
    for (int i = 0; i < static_cast<int>(time_s * 400); ++i) frame();
  }
  /// What comes out of both within a second, frame by frame.
  template <typename Sample>
  std::pair<std::vector<Sample>, std::vector<Sample>> second() {
    std::pair<std::vector<Sample>, std::vector<Sample>> out;
    for (int i = 0; i < 400; ++i) {
      frame();
      Sample s;
      while (sensors.read(s) == Status::kOk) out.first.push_back(s);
      while (twin.read(s) == Status::kOk) out.second.push_back(s);
    }
    return out;
  }
};

TEST(FaultySensors, PassEverythingAsItIsWithoutAFault) {
  Bench bench;
  const auto [got, wanted] = bench.second<firmware_if::GnssFix>();
  ASSERT_GT(wanted.size(), 5U);
  ASSERT_EQ(got.size(), wanted.size());
  for (std::size_t i = 0; i < got.size(); ++i) {
    EXPECT_EQ(got[i].p_WB_m, wanted[i].p_WB_m);
    EXPECT_EQ(got[i].stamp, wanted[i].stamp);
  }
}

TEST(FaultySensors, OdometryBeginsAnewElsewhereAndTurnedAndSaysSo) {
  Bench bench{NavigationSensorsConfig{.odometry = OdometryModel::kVio}};
  (void)bench.second<firmware_if::OdometrySample>();
  bench.line.inject({Component::kOdometry, FaultKind::kReset}, Nanos{std::chrono::seconds{2}});
  const auto [got, wanted] = bench.second<firmware_if::OdometrySample>();
  ASSERT_EQ(got.size(), wanted.size());
  ASSERT_GT(got.size(), 5U);
  const auto rotation = [](const firmware_if::OdometrySample& s) {
    return Quaternion(s.q_OB[0], s.q_OB[1], s.q_OB[2], s.q_OB[3]);
  };
  // From the old frame to the new one: one turn about the vertical for pose and velocity alike.
  const Quaternion turn = rotation(got[0]) * rotation(wanted[0]).conjugate();
  EXPECT_NEAR(turn.norm(), 1.0, 1e-9);
  EXPECT_NEAR(turn.z() * turn.z() + turn.w() * turn.w(), 1.0, 1e-9);
  EXPECT_NEAR(2.0 * turn.z() * turn.w(), 1.0, 1e-9) << "a quarter to the left";
  const Vector3 before(wanted[3].p_OB_m[0] - wanted[0].p_OB_m[0], wanted[3].p_OB_m[1] - wanted[0].p_OB_m[1],
                       0.0);
  const Vector3 after(got[3].p_OB_m[0] - got[0].p_OB_m[0], got[3].p_OB_m[1] - got[0].p_OB_m[1], 0.0);
  EXPECT_LT((turn.toRotationMatrix() * before - after).norm(), 1e-9);
  EXPECT_EQ(got[0].reset_counter, wanted[0].reset_counter + 1);
}

TEST(FaultySensors, AJumpIsTwoMetresToTheNorth) {
  Bench bench;
  bench.line.inject({Component::kGnss, FaultKind::kJump}, Nanos{std::chrono::seconds{2}});
  const auto [got, wanted] = bench.second<firmware_if::GnssFix>();
  ASSERT_EQ(got.size(), wanted.size());
  EXPECT_DOUBLE_EQ(got[0].p_WB_m[1], wanted[0].p_WB_m[1] + 2.0);
}

TEST(FaultySensors, EveryKindDoesWhatItsNameSays) {
  for (const auto kind : {FaultKind::kOff, FaultKind::kStuck, FaultKind::kGarbage, FaultKind::kWrong,
                          FaultKind::kSlow, FaultKind::kDelayed, FaultKind::kIntermittent}) {
    Bench bench;
    (void)bench.second<firmware_if::GnssFix>();
    bench.line.inject({Component::kGnss, kind}, Nanos{std::chrono::seconds{2}});
    const auto [got, wanted] = bench.second<firmware_if::GnssFix>();
    ASSERT_GT(wanted.size(), 5U);
    SCOPED_TRACE(kFaultKindNames[static_cast<std::size_t>(kind)]);
    switch (kind) {
      case FaultKind::kOff:
        EXPECT_TRUE(got.empty());
        break;
      case FaultKind::kStuck:
        ASSERT_GT(got.size(), 2U);
        EXPECT_EQ(got[1].p_WB_m, got[0].p_WB_m);
        EXPECT_GT(got[1].stamp, got[0].stamp) << "fresh stamps";
        break;
      case FaultKind::kGarbage: {
        ASSERT_GT(got.size(), 2U);
        int senseless = 0;
        for (const auto& fix : got) senseless += std::fabs(fix.p_WB_m[0]) < 1000.0 ? 0 : 1;
        EXPECT_GT(senseless, 4);
        break;
      }
      case FaultKind::kWrong:
        ASSERT_EQ(got.size(), wanted.size());
        EXPECT_DOUBLE_EQ(got[0].p_WB_m[1], wanted[0].p_WB_m[1] + 30.0);
        break;
      case FaultKind::kSlow:
        EXPECT_LE(got.size(), 2U);
        break;
      case FaultKind::kDelayed:
        ASSERT_GT(got.size(), 2U);
        EXPECT_LT(got.size(), wanted.size()) << "the first ones are still on their way";
        EXPECT_EQ(got[0].p_WB_m, wanted[0].p_WB_m);
        break;
      case FaultKind::kIntermittent:
        EXPECT_GT(got.size(), 0U);
        EXPECT_LT(got.size(), wanted.size());
        break;
      default:
        FAIL();
    }
    // Over after two seconds, and what comes is fresh.
    (void)bench.second<firmware_if::GnssFix>();
    const auto [after, healthy] = bench.second<firmware_if::GnssFix>();
    ASSERT_EQ(after.size(), healthy.size());
    EXPECT_EQ(after.back().p_WB_m, healthy.back().p_WB_m);
  }
}

TEST(FaultySensors, AClockThatRunsAheadShiftsOnlyTheStamps) {
  Bench bench;
  bench.line.inject({Component::kClock, FaultKind::kWrong}, Nanos{std::chrono::seconds{9}});
  const auto [got, wanted] = bench.second<firmware_if::GnssFix>();
  ASSERT_GT(got.size(), 5U);
  EXPECT_EQ(got[3].stamp - wanted[3].stamp, Nanos{200'000'000});
  EXPECT_EQ(got[3].p_WB_m, wanted[3].p_WB_m);
}

TEST(FaultySensors, ADriftGoesAwayFromTheTruthAtItsRate) {
  Bench bench;
  bench.line.inject({.component = Component::kGnss, .kind = FaultKind::kDrift, .size = 0.25},
                    from_seconds(3.0));
  const auto [got, wanted] = bench.second<firmware_if::GnssFix>();
  ASSERT_EQ(got.size(), wanted.size());
  ASSERT_GT(got.size(), 5U);
  const auto off_m = [&, &got = got, &wanted = wanted](std::size_t i) {
    return got[i].p_WB_m[1] - wanted[i].p_WB_m[1];
  };
  const double apart_s = seconds(got.back().stamp - got.front().stamp);
  ASSERT_GT(apart_s, 0.5);
  EXPECT_NEAR(off_m(got.size() - 1) - off_m(0), 0.25 * apart_s, 0.25 * 2e-3 * 3);
  EXPECT_GT(off_m(0), 0.0);
}

TEST(FaultLine, LosesTheShareThatItIsToldAndOtherOnesOfAnotherInstance) {
  constexpr std::uint64_t kNumbers = 20000;
  FaultLine sut, same;
  for (FaultLine* line : {&sut, &same})
    line->inject({.component = Component::kDepth, .kind = FaultKind::kIntermittent, .size = 0.1},
                 Nanos{1000});
  std::uint64_t lost = 0, apart = 0, last_lost = 0;
  for (std::uint64_t n = 0; n < kNumbers; ++n) {
    if (sut.loses(Component::kDepth, 0, n)) ++lost, last_lost = n;
    apart += sut.loses(Component::kDepth, 0, n) != sut.loses(Component::kDepth, 1, n) ? 1U : 0U;
    ASSERT_EQ(sut.loses(Component::kDepth, 0, n), same.loses(Component::kDepth, 0, n));
  }
  // Binomial: 2000 with a deviation of 42.
  EXPECT_NEAR(static_cast<double>(lost), 2000.0, 5 * 42.0);
  EXPECT_GT(apart, 3000U) << "2 x 0.1 x 0.9 of them";
  sut.advance(MonotonicTime{Nanos{1000}});
  EXPECT_FALSE(sut.loses(Component::kDepth, 0, last_lost)) << "it is over";
}

TEST(FaultLine, ABurstComesAgainForEver) {
  FaultLine sut;
  sut.advance(MonotonicTime{from_seconds(2.0)});
  sut.inject({Component::kCan, FaultKind::kOff}, from_seconds(0.05), from_seconds(1.0));
  for (const double at_s : {2.0, 2.049, 3.0, 3.049, 1002.04}) {
    sut.advance(MonotonicTime{from_seconds(at_s)});
    EXPECT_EQ(sut.of(Component::kCan), FaultKind::kOff) << at_s;
    EXPECT_LT(sut.age(Component::kCan), from_seconds(0.05));
  }
  for (const double at_s : {2.051, 2.999, 3.06, 1002.06}) {
    sut.advance(MonotonicTime{from_seconds(at_s)});
    EXPECT_EQ(sut.of(Component::kCan), FaultKind::kNone) << at_s;
  }
}

TEST(FaultLine, EverySizeIsOfAKindThatItsComponentHas) {
  for (const FaultSize& row : kSizes) {
    const ComponentSpec& spec = kComponents.at(static_cast<std::size_t>(row.component));
    EXPECT_NE(spec.kinds & bit(row.kind), 0) << spec.name;
    EXPECT_GE(row.usual, row.least) << spec.name;
    EXPECT_LE(row.usual, row.most) << spec.name;
  }
  // Nothing else can be more or less of itself.
  FaultLine sut;
  sut.inject({Component::kGnss, FaultKind::kOff}, Nanos{1000});
  EXPECT_EQ(sut.size(Component::kGnss), 0.0);
  sut.inject({Component::kGnss, FaultKind::kJump}, Nanos{1000});
  EXPECT_EQ(sut.size(Component::kGnss), 2.0);
}

TEST(FaultySensors, OnlyTheInstanceThatIsNamedFails) {
  FaultLine line;
  line.inject({Component::kDepth, FaultKind::kOff, 2}, Nanos{1000});
  EXPECT_EQ(line.of(Component::kDepth, 2), FaultKind::kOff);
  EXPECT_EQ(line.of(Component::kDepth, 1), FaultKind::kNone);
  EXPECT_EQ(line.of(Component::kEsc, 2), FaultKind::kNone);
  line.inject({Component::kDepth, FaultKind::kStuck}, Nanos{1000});
  EXPECT_EQ(line.of(Component::kDepth, 2), FaultKind::kStuck) << "the last one counts";
  line.advance(MonotonicTime{Nanos{1000}});
  EXPECT_EQ(line.of(Component::kDepth, 2), FaultKind::kNone) << "over";
}

/// A wall five metres ahead.
World wall() {
  WorldDescription d;
  d.bounds_W = {{-5, -5, 0.5}, {20, 5, 8}};
  d.start_W = Vector3(0, 0, 4);
  d.goal_W = Vector3(3, 0, 4);
  d.boxes.push_back({{5, -5, 0}, {6, 5, 12}});
  return World(std::move(d));
}

TEST(FaultyDepthCamera, EveryKindDoesWhatItsNameSays) {
  const World world = wall();
  const auto mounts = six_camera_mounts();
  const auto picture = [&](FaultKind kind, double for_s, int& frames) {
    DepthCameraConfig config;
    config.pixels = 8;
    config.frame_dropout_ratio = 0.0;
    SimulatedDepthCamera inner(world, config, mounts[0], 3, 0);
    FaultLine line;
    FaultyDepthCamera sut(inner, 0, line);
    MonotonicTime now{};
    firmware_if::DepthFrame frame;
    std::vector<float> last;
    std::uint32_t sequence = 0;
    frames = 0;
    for (int i = 0; i < static_cast<int>((1.0 + for_s) * 400); ++i) {
      now += core::kMinorFrame;
      line.advance(now);
      if (i == 400) line.inject({Component::kDepth, kind}, from_seconds(for_s));
      inner.expose(now, {Matrix3::Identity(), Vector3(0, 0, 4)});
      if (sut.read(frame) != Status::kOk || i <= 400) continue;
      ++frames;
      EXPECT_GT(frame.sequence, sequence) << "never the same frame twice";
      sequence = frame.sequence;
      last.assign(frame.depth_m.begin(), frame.depth_m.end());
    }
    return last;
  };
  int healthy = 0;
  const std::vector<float> sane = picture(FaultKind::kNone, 1.0, healthy);
  ASSERT_GE(healthy, 18);
  EXPECT_NEAR(sane[27], 5.0F, 0.2F);
  int frames = 0;
  (void)picture(FaultKind::kOff, 1.0, frames);
  EXPECT_EQ(frames, 0);
  (void)picture(FaultKind::kSlow, 1.0, frames);
  EXPECT_LE(frames, 3);
  EXPECT_GE(frames, 1);
  (void)picture(FaultKind::kIntermittent, 1.0, frames);
  EXPECT_GT(frames, 3);
  EXPECT_LT(frames, 17);
  EXPECT_NEAR(picture(FaultKind::kWrong, 1.0, frames)[27], 2.5F, 0.1F);
  for (const float depth_m : picture(FaultKind::kGarbage, 1.0, frames)) EXPECT_FALSE(depth_m > 0.0F);
  (void)picture(FaultKind::kDelayed, 1.0, frames);
  EXPECT_GE(frames, 1);
  EXPECT_LE(frames, 3);
  EXPECT_EQ(picture(FaultKind::kStuck, 1.0, frames), picture(FaultKind::kStuck, 0.5, frames))
      << "the image before the fault, however long it lasts";
}

}  // namespace
}  // namespace roborun::sitl
