// The companion's contract (firmware_if/autopilot.hpp) on both fakes, in lockstep.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>

#include "core/random/counter_rng.hpp"
#include "tests/platform/sitl/autopilot/bench.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::test {
namespace {

using firmware_if::AutopilotSetPoint;
using firmware_if::AutopilotStage;
using firmware_if::AutopilotState;
using mav::AutopilotKind;
using mav::Companion;
using Mode = sitl::FakeAutopilot::Mode;

struct SetupSigning {
  static constexpr mav::MessageType kType = mav::kSetupSigning;
  std::uint8_t target_system{}, target_component{};
  std::array<std::uint8_t, 32> secret_key{};
  std::uint64_t initial_timestamp{};
  static constexpr std::tuple kMembers{mav::Member<&SetupSigning::target_system>{"target_system"},
                                       mav::Member<&SetupSigning::target_component>{"target_component"},
                                       mav::Member<&SetupSigning::secret_key>{"secret_key"},
                                       mav::Member<&SetupSigning::initial_timestamp>{"initial_timestamp"}};
};

/// A lane that asks for the command and leads the vehicle along x.
class Lane {
 public:
  static constexpr Nanos kFrame = AutopilotBench::kFrame;
  explicit Lane(AutopilotKind kind, Companion::Config config)
      : body_(VehicleModel{}, still_air(), Vector3(0.0, 0.0, 0.05), 1, kFrame, cameras_),
        sut_(body_, VehicleModel{}, kFrame, (config.kind = kind, config)) {}

  void step() {
    now_ += kFrame;
    sut_.begin_frame(now_);
    companion().step(now_);
    while (companion().read(state_) == Status::kOk) ++states_;
    if (states_ > 0 && companion().report().stage == AutopilotStage::kReady && asks)
      companion().take_command(8.0);
    if (states_ > 0) {
      const bool ours = companion().report().stage == AutopilotStage::kOurs;
      if (!is_led_) place_m_ = state_.p_WB_m;
      is_led_ = is_led_ || ours;
      if (is_led_) place_m_[0] += seconds(kFrame) * speed_mps;
      if (sinks) place_m_[2] = std::max(place_m_[2] - seconds(kFrame) * 1.0, -3.0);
      if (is_led_ && !sinks && place_m_[2] < 8.0) place_m_[2] += seconds(kFrame) * 1.0;
      if (leads)
        last_ = companion().command(now_, {place_m_, {is_led_ ? speed_mps : 0.0, 0.0, 0.0}, {}, yaw_rad});
    }
    sut_.end_frame(now_);
  }
  void run(double time_s) {
    for (int i = 0; i < static_cast<int>(400.0 * time_s); ++i) step();
  }
  /// Besides what the autopilot sends.
  template <typename T>
  void say(std::uint8_t sysid, std::uint8_t compid, const T& message) {
    std::array<std::uint8_t, mav::kMostFrame_bytes> bytes{};
    const auto length = mav::write_frame(T::kType, {0, sysid, compid}, mav::pack(message), nullptr, bytes);
    EXPECT_EQ(companion().receive(now_, std::span<const std::uint8_t>(bytes).first(length.value())),
              length.value());
  }
  void connect(const sitl::FaultLine& line) { body_.connect(line); }
  [[nodiscard]] Companion& companion() { return sut_.companion(); }
  [[nodiscard]] sitl::FakeAutopilot& fake() { return sut_.fake(); }
  [[nodiscard]] sitl::AutopilotAircraft& aircraft() { return sut_; }
  [[nodiscard]] const sitl::VehicleState& truth() const { return body_.vehicle().state(); }
  [[nodiscard]] const AutopilotState& state() const { return state_; }
  [[nodiscard]] MonotonicTime now() const { return now_; }
  [[nodiscard]] Status last() const { return last_; }
  [[nodiscard]] AutopilotStage stage() { return companion().report().stage; }

  double speed_mps{0.0};
  double yaw_rad{0.3};
  bool asks{true}, leads{true}, sinks{false};

 private:
  NoCameras cameras_;
  sitl::SimulatedAircraft body_;
  sitl::AutopilotAircraft sut_;
  MonotonicTime now_{};
  AutopilotState state_{};
  std::uint64_t states_{0};
  std::array<double, 3> place_m_{};
  bool is_led_{false};
  Status last_{Status::kOk};
};

class CompanionContract : public ::testing::TestWithParam<AutopilotKind> {
 protected:
  [[nodiscard]] static Companion::Config config() {
    Companion::Config config = Companion::config_for(GetParam());
    config.may_arm = true;
    return config;
  }
  static std::unique_ptr<Lane> lane(const Companion::Config& with = config()) {
    return std::make_unique<Lane>(GetParam(), with);
  }
  [[nodiscard]] static bool is_px4() { return GetParam() == AutopilotKind::kPx4; }
  [[nodiscard]] static const char* time_out() { return is_px4() ? "COM_OF_LOSS_T" : "GUID_TIMEOUT"; }
};

TEST_P(CompanionContract, TakesOffLeadsAndSeesWhereItIs) {
  const auto sut = lane();
  sut->run(25.0);
  ASSERT_EQ(sut->stage(), AutopilotStage::kOurs) << sut->companion().report().reason;
  sut->speed_mps = 2.0;
  sut->run(5.0);
  EXPECT_NEAR(sut->truth().v_WB.x(), 2.0, 0.3);
  EXPECT_NEAR(sut->truth().p_WB.z(), 8.0, 0.7);
  const Vector3 forward = sut->truth().q_WB * Vector3::UnitX();
  EXPECT_NEAR(std::atan2(forward.y(), forward.x()), 0.3, 0.1);
  // Its state, on our clock: where the vehicle was at the stamp.
  const double age_s = seconds(sut->now() - sut->state().stamp);
  EXPECT_GT(age_s, 0.001);
  EXPECT_LT(age_s, 0.03);
  const Vector3 said(sut->state().p_WB_m[0], sut->state().p_WB_m[1], sut->state().p_WB_m[2]);
  EXPECT_LT((said + age_s * sut->truth().v_WB - sut->truth().p_WB).norm(), 0.2);
  EXPECT_NEAR(sut->state().v_WB_mps[0], 2.0, 0.3);
  const auto& q = sut->state().q_WB;
  EXPECT_GT(std::fabs(Quaternion(q[0], q[1], q[2], q[3]).dot(sut->truth().q_WB)), 0.999);
}

TEST_P(CompanionContract, SendsFiftySetPointsASecondAndNoneIsLost) {
  const auto sut = lane();
  sut->run(25.0);
  ASSERT_EQ(sut->stage(), AutopilotStage::kOurs);
  const auto sent = sut->companion().counters().set_points;
  const auto taken = sut->fake().counters().set_points;
  sut->run(10.0);
  EXPECT_EQ(sut->companion().counters().set_points - sent, 500U);
  EXPECT_EQ(sut->fake().counters().set_points - taken, 500U);
  EXPECT_EQ(sut->fake().counters().refused_set_points, 0U);
}

TEST_P(CompanionContract, ReadsTheTimeOutsAndSetsThemOnRequest) {
  const auto sut = lane();
  EXPECT_GT(sut->fake().parameter(time_out()), 0.5);
  sut->run(25.0);
  EXPECT_EQ(sut->fake().parameter(time_out()), 0.5);
  EXPECT_EQ(sut->companion().limits().silence_s, 0.5);
  if (is_px4()) {
    EXPECT_EQ(sut->fake().parameter("COM_OBL_RC_ACT"), 5.0);
  }
}

TEST_P(CompanionContract, RefusesATimeOutThatItMayNotSet) {
  Companion::Config careful = config();
  careful.may_set = false;
  const auto sut = lane(careful);
  sut->run(25.0);
  EXPECT_EQ(sut->stage(), AutopilotStage::kRefused);
  EXPECT_STREQ(sut->companion().report().subject, time_out());
  EXPECT_GT(sut->fake().parameter(time_out()), 0.5);
  EXPECT_TRUE(sut->truth().on_ground);
}

TEST_P(CompanionContract, RefusesAnAutopilotThatBrakesLessThanPlanned) {
  const auto sut = lane();
  const char* const name = is_px4() ? "MPC_ACC_HOR" : "WPNAV_ACCEL";
  ASSERT_TRUE(sut->fake().set_parameter(name, 0.5 * sut->fake().parameter(name)));
  sut->run(25.0);
  EXPECT_EQ(sut->stage(), AutopilotStage::kRefused);
  EXPECT_STREQ(sut->companion().report().subject, name);
}

TEST_P(CompanionContract, WaitsForTheOperatorUnlessItMayArm) {
  Companion::Config careful = config();
  careful.may_arm = false;
  const auto sut = lane(careful);
  sut->run(12.0);
  EXPECT_EQ(sut->stage(), AutopilotStage::kTaking);
  EXPECT_FALSE(sut->fake().armed());
}

TEST_P(CompanionContract, HearsOfTheBatteryWhatItsPowerModuleSays) {
  const auto sut = lane();
  sitl::FaultLine line;
  sut->connect(line);
  sut->run(10.0);
  EXPECT_NEAR(sut->companion().report().battery_ratio, 1.0, 0.02);
  line.inject({sitl::Component::kBattery, sitl::FaultKind::kOff}, Nanos{1'000'000'000'000});
  sut->run(5.0);
  EXPECT_TRUE(std::isnan(sut->companion().report().battery_ratio));
}

TEST_P(CompanionContract, EndsWithThePilotsSwitchForGood) {
  const auto sut = lane();
  sut->run(25.0);
  ASSERT_EQ(sut->stage(), AutopilotStage::kOurs);
  sut->fake().pilot_takes(Mode::kHold);
  sut->run(0.2);  // a heartbeat every 0.1 s
  EXPECT_EQ(sut->stage(), AutopilotStage::kPilots);
  const auto sent = sut->companion().counters().set_points;
  sut->fake().pilot_takes(Mode::kGuided);
  sut->run(3.0);
  EXPECT_EQ(sut->companion().counters().set_points, sent);
  EXPECT_EQ(sut->last(), Status::kNotReady);
  EXPECT_EQ(sut->stage(), AutopilotStage::kPilots);
}

TEST_P(CompanionContract, TakesNobodyElsesRefusalAsItsOwnAndAsksAgainAfterNotNow) {
  constexpr std::uint8_t kDenied = 2;
  constexpr std::uint8_t kNotNow = 1;
  const auto sut = lane();
  for (int i = 0; i < 400 * 25; ++i) {
    sut->step();
    sut->say(1, 1, mav::CommandAck{511, kDenied, 0, 0, 255, 190});
    sut->say(1, 1, mav::CommandAck{511, kDenied, 0, 0, 1, 100});
    sut->say(1, 1, mav::CommandAck{511, kNotNow, 0, 0, 1, 191});
  }
  EXPECT_EQ(sut->stage(), AutopilotStage::kOurs) << sut->companion().report().reason;
  const auto refused = lane();
  for (int i = 0; i < 400 * 25; ++i) {
    refused->step();
    refused->say(1, 1, mav::CommandAck{511, kDenied, 0, 0, 1, 191});
  }
  EXPECT_EQ(refused->stage(), AutopilotStage::kRefused);
}

TEST_P(CompanionContract, DoesNotTakeOverWhatHasFallenSilent) {
  const auto sut = lane();
  sut->asks = false;
  sut->run(12.0);
  ASSERT_EQ(sut->stage(), AutopilotStage::kReady);
  sut->aircraft().cut(true);
  sut->run(1.2);
  EXPECT_EQ(sut->stage(), AutopilotStage::kChecking);
  EXPECT_STRNE(sut->companion().report().reason, "");
  sut->companion().take_command(8.0);
  sut->run(5.0);
  EXPECT_EQ(sut->stage(), AutopilotStage::kChecking);
  EXPECT_STREQ(sut->companion().report().reason, "its heartbeat does not come");
  sut->aircraft().cut(false);
  sut->run(15.0);
  EXPECT_EQ(sut->stage(), AutopilotStage::kOurs) << "it was remembered";
}

TEST_P(CompanionContract, KnowsThePilotsSwitchAlsoAfterASilenceDuringTheTakeOver) {
  if (is_px4()) GTEST_SKIP() << "armed in the mode it is ours at once";
  const auto sut = lane();
  for (int i = 0; i < 400 * 25 && sut->truth().p_WB.z() < 2.0; ++i) sut->step();
  ASSERT_EQ(sut->stage(), AutopilotStage::kTaking);
  sut->aircraft().cut(true);
  sut->run(1.5);
  EXPECT_EQ(sut->stage(), AutopilotStage::kChecking);
  sut->fake().pilot_takes(Mode::kHold);
  sut->aircraft().cut(false);
  sut->run(3.0);
  EXPECT_EQ(sut->stage(), AutopilotStage::kPilots);
  EXPECT_EQ(sut->fake().mode(), Mode::kHold);
}

TEST_P(CompanionContract, IsLostByTheAgeOfTheStateAndNotOfItsArrival) {
  const auto sut = lane();
  sut->run(25.0);
  ASSERT_EQ(sut->stage(), AutopilotStage::kOurs);
  const auto states = sut->companion().counters().states;
  // Half as fast as time, as behind a queue that grows.
  for (int i = 0; i < 400 * 2; ++i) {
    sut->fake().late += Lane::kFrame * 12 / 25;
    sut->step();
  }
  EXPECT_EQ(sut->stage(), AutopilotStage::kOurs) << "a second is not a loss";
  for (int i = 0; i < 400 / 4; ++i) {
    sut->fake().late += Lane::kFrame / 2;
    sut->step();
  }
  EXPECT_EQ(sut->stage(), AutopilotStage::kLost);
  EXPECT_GT(sut->companion().counters().states - states, 100U) << "they came all the time";
  EXPECT_EQ(sut->companion().counters().reboots, 0U);
}

TEST_P(CompanionContract, FliesUntilItIsToldThatItStands) {
  const auto sut = lane();
  sut->run(25.0);
  ASSERT_EQ(sut->stage(), AutopilotStage::kOurs);
  EXPECT_TRUE(sut->companion().report().in_air);
  const auto told = [&](std::uint8_t landed_state) {
    sut->fake().landed_state = landed_state;
    sut->run(0.5);
    return sut->companion().report().in_air;
  };
  EXPECT_FALSE(told(1));
  EXPECT_TRUE(told(0)) << "undefined";
  EXPECT_FALSE(told(1));
  sut->fake().is_mute_of_landing = true;
  sut->run(1.5);
  EXPECT_TRUE(sut->companion().report().in_air) << "said more than a second ago";
  EXPECT_EQ(sut->stage(), AutopilotStage::kOurs) << "no reason to stop leading it";
}

TEST_P(CompanionContract, IsNotTakenOverWithoutKnowingWhetherItStands) {
  const auto sut = lane();
  sut->fake().is_mute_of_landing = true;
  sut->run(25.0);
  EXPECT_EQ(sut->stage(), AutopilotStage::kChecking);
  EXPECT_STREQ(sut->companion().report().subject, "EXTENDED_SYS_STATE");
  sut->fake().is_mute_of_landing = false;
  sut->run(15.0);
  EXPECT_EQ(sut->stage(), AutopilotStage::kOurs);
}

TEST_P(CompanionContract, IsDisarmedAlsoIfTheFirstRequestIsLost) {
  const auto sut = lane();
  sut->run(25.0);
  ASSERT_EQ(sut->stage(), AutopilotStage::kOurs);
  sut->sinks = true;
  sut->run(15.0);
  ASSERT_TRUE(sut->truth().on_ground);
  ASSERT_TRUE(sut->fake().armed());
  const auto sent = sut->companion().counters().set_points;
  sut->aircraft().cut(true);
  sut->companion().disarm();
  sut->run(0.3);
  EXPECT_TRUE(sut->fake().armed());
  sut->aircraft().cut(false);
  sut->run(1.0);
  EXPECT_FALSE(sut->fake().armed());
  EXPECT_EQ(sut->companion().counters().set_points, sent);
  EXPECT_FALSE(sut->companion().report().armed);
  sut->run(1.0);
  EXPECT_TRUE(sut->companion().outgoing().empty());
}

TEST_P(CompanionContract, AsksForDisarmingTenTimesAndNotOfAPilot) {
  for (const bool pilot : {false, true}) {
    const auto sut = lane();
    sut->run(25.0);
    ASSERT_EQ(sut->stage(), AutopilotStage::kOurs);
    const auto asked = sut->fake().counters().refused_disarms;
    sut->companion().disarm();  // in the air, where it is refused
    sut->run(0.2);
    if (pilot) sut->fake().pilot_takes(Mode::kHold);
    sut->run(20.0);
    EXPECT_TRUE(sut->fake().armed());
    const auto times = sut->fake().counters().refused_disarms - asked;
    if (pilot || is_px4()) {  // PX4 leaves the mode by itself once the set-points end
      EXPECT_GE(times, 1U);
      EXPECT_LE(times, 3U);
    } else {
      EXPECT_EQ(times, 10U);
    }
  }
}

/// Led, or a pilot's by then; the last word is said while the line is cut for 0.3 s. False: it was never led.
template <typename Word>
bool is_led_until_told(Lane& sut, bool pilot, Word&& last_word) {
  sut.run(25.0);
  if (sut.stage() != AutopilotStage::kOurs) return false;
  if (pilot) {
    sut.fake().pilot_takes(Mode::kHold);
    sut.run(0.3);
  }
  sut.aircraft().cut(true);
  last_word();
  sut.run(0.3);
  sut.aircraft().cut(false);
  return true;
}

TEST_P(CompanionContract, TerminatesWhatItLeadsAndNotWhatAPilotFlies) {
  for (const bool pilot : {false, true}) {
    const auto sut = lane();
    ASSERT_TRUE(is_led_until_told(*sut, pilot, [&] { sut->aircraft().terminate(); }));
    sut->run(3.0);
    EXPECT_EQ(sut->fake().armed(), pilot);
    EXPECT_EQ(sut->truth().on_ground, !pilot);
  }
}

TEST_P(CompanionContract, LandsByTheAutopilotsOwnModeOnRequest) {
  for (const bool pilot : {false, true}) {
    const auto sut = lane();
    ASSERT_TRUE(is_led_until_told(*sut, pilot, [&] { sut->companion().land(); }));
    sut->run(25.0);
    EXPECT_EQ(sut->fake().mode(), pilot ? Mode::kHold : Mode::kLand) << "the pilot is not disturbed";
    EXPECT_EQ(sut->truth().on_ground, !pilot);
    EXPECT_EQ(sut->fake().armed(), pilot);
    EXPECT_EQ(sut->stage(), AutopilotStage::kPilots);
  }
}

TEST_P(CompanionContract, IsTakenOverInItsClimbOnRequest) {
  if (is_px4()) GTEST_SKIP() << "it has no take-off of its own";
  const auto sut = lane();
  for (int i = 0; i < 400 * 25 && sut->truth().p_WB.z() < 3.0; ++i) sut->step();
  ASSERT_EQ(sut->stage(), AutopilotStage::kTaking);
  sut->asks = false;
  sut->companion().take_command(0.0);
  sut->step();
  EXPECT_EQ(sut->stage(), AutopilotStage::kOurs);
  sut->sinks = true;
  sut->run(15.0);
  EXPECT_TRUE(sut->truth().on_ground);
}

TEST_P(CompanionContract, LeavesThePilotWhatHeChangesDuringTheTakeOver) {
  for (const bool disarms : {false, true}) {
    if (is_px4() && disarms) continue;  // armed in the mode it is ours at once
    const auto sut = lane();
    sut->fake().never_arms = is_px4();
    const auto begun = [&] {
      return sut->fake().mode() == Mode::kGuided && (is_px4() || sut->truth().p_WB.z() > 2.0);
    };
    for (int i = 0; i < 400 * 25 && !begun(); ++i) sut->step();
    ASSERT_TRUE(begun());
    sut->run(0.3);  // a heartbeat has told it
    ASSERT_EQ(sut->stage(), AutopilotStage::kTaking);
    if (disarms) {
      sut->fake().pilot_disarms();
    } else {
      sut->fake().pilot_takes(Mode::kHold);
    }
    sut->run(3.0);
    EXPECT_EQ(sut->stage(), AutopilotStage::kPilots) << disarms;
    if (disarms) {
      EXPECT_FALSE(sut->fake().armed());
    } else {
      EXPECT_EQ(sut->fake().mode(), Mode::kHold);
    }
  }
}

TEST_P(CompanionContract, DoesNotArmAgainByItselfAfterARestartDuringTheTakeOver) {
  const auto sut = lane();
  int steps = 0;
  while (sut->stage() != AutopilotStage::kTaking && ++steps < 400 * 25) sut->step();
  ASSERT_LT(steps, 400 * 25);
  ASSERT_FALSE(sut->fake().armed());
  sut->fake().reboot(sut->now());
  sut->run(15.0);
  EXPECT_EQ(sut->stage(), AutopilotStage::kPilots);
  EXPECT_FALSE(sut->fake().armed());
}

TEST_P(CompanionContract, GivesATakeOverUpThatLeadsToNothing) {
  const auto sut = lane();
  sut->fake().never_arms = true;
  sut->run(50.0);
  EXPECT_EQ(sut->stage(), AutopilotStage::kTaking);
  sut->run(30.0);
  EXPECT_EQ(sut->stage(), AutopilotStage::kRefused);
  EXPECT_STREQ(sut->companion().report().subject, "arming");
}

TEST_P(CompanionContract, EndsWithARestartOfTheAutopilot) {
  const auto sut = lane();
  sut->run(25.0);
  ASSERT_EQ(sut->stage(), AutopilotStage::kOurs);
  sut->fake().reboot(sut->now());
  sut->run(2.0);
  EXPECT_EQ(sut->stage(), AutopilotStage::kPilots);
  EXPECT_EQ(sut->companion().counters().reboots, 1U);
}

TEST_P(CompanionContract, StandsByItselfWhereTheStopSaysWhenTheCableIsPulled) {
  const auto sut = lane();
  sut->run(25.0);
  sut->speed_mps = 4.0;
  sut->run(8.0);
  ASSERT_NEAR(sut->truth().v_WB.x(), 4.0, 0.4);
  const double x_m = sut->truth().p_WB.x();
  const double v_mps = sut->truth().v_WB.x();
  sut->aircraft().cut(true);
  double farthest_m = 0.0;
  for (int i = 0; i < 400 * 8; ++i) {
    sut->step();
    farthest_m = std::max(farthest_m, sut->truth().p_WB.x() - x_m);
  }
  const auto& limits = sut->companion().limits();
  const double bound_m =
      v_mps * (limits.silence_s + limits.delay_s + 0.03 + 0.5 * limits.stop_mps2 / limits.stop_jerk_mps3) +
      v_mps * v_mps / (2.0 * limits.stop_mps2) + VehicleModel{}.tracking_error_m;
  RecordProperty("run_on_m", std::to_string(farthest_m));
  EXPECT_LT(farthest_m, bound_m);
  EXPECT_GT(farthest_m, 0.5 * bound_m) << "the bound is worth something";
  EXPECT_LT(sut->truth().v_WB.norm(), 0.3);
  EXPECT_EQ(sut->stage(), AutopilotStage::kLost);
  sut->aircraft().cut(false);
  sut->run(3.0);
  // ArduCopter stays in its mode; PX4 has changed it by itself, which is not ours to undo.
  EXPECT_EQ(sut->stage(), is_px4() ? AutopilotStage::kPilots : AutopilotStage::kOurs);
}

/// A key along the line would be everybody's who hears it: keys come from files alone.
TEST_P(CompanionContract, TakesNoKeyThatComesAlongTheLine) {
  const auto sut = lane();
  sut->run(25.0);
  ASSERT_EQ(sut->stage(), AutopilotStage::kOurs);
  for (const auto& [sysid, compid] : {std::pair{1, 1}, std::pair{255, 190}}) {
    for (const int target : {191, 0}) {
      SetupSigning setup;
      setup.target_system = 1;
      setup.target_component = static_cast<std::uint8_t>(target);
      setup.secret_key.fill(7);
      setup.initial_timestamp = 1;
      sut->say(static_cast<std::uint8_t>(sysid), static_cast<std::uint8_t>(compid), setup);
    }
  }
  const auto states = sut->companion().counters().states;
  const auto set_points = sut->fake().counters().set_points;
  sut->run(2.0);
  EXPECT_GT(sut->companion().counters().states, states + 150) << "what is not signed is still heard";
  EXPECT_GT(sut->fake().counters().set_points, set_points + 80) << "and nothing is signed";
  EXPECT_EQ(sut->stage(), AutopilotStage::kOurs);
}

/// Frames of somebody else on the same line, and nonsense.
TEST_P(CompanionContract, ObeysAndBelievesNobodyElse) {
  const auto sut = lane();
  sut->run(25.0);
  ASSERT_EQ(sut->stage(), AutopilotStage::kOurs);
  const auto say = [&](std::uint8_t sysid, std::uint8_t compid, const auto& message) {
    sut->say(sysid, compid, message);
  };
  const auto frame_number = sut->state().frame_number;
  for (int i = 0; i < 200; ++i) {
    sut->step();
    // Another autopilot, the same system's camera, a ground station: modes, states, clocks, set-points, commands.
    say(2, 1, mav::Heartbeat{2, is_px4() ? std::uint8_t{12} : std::uint8_t{3}, 0, 99, 4, 3});
    say(1, 100, mav::Heartbeat{2, is_px4() ? std::uint8_t{12} : std::uint8_t{3}, 0, 99, 4, 3});
    say(255, 190, mav::LocalPositionNed{1, 500.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F});
    say(2, 1, mav::SystemTime{0, 1});
    mav::SetPositionTargetLocalNed point;
    point.coordinate_frame = 1;
    point.x = 1000.0F;
    say(255, 190, point);
    mav::CommandLong land;
    land.target_system = 1;
    land.target_component = 191;
    land.command = 21;
    say(255, 190, land);
    say(1, 1, land);  // not even the autopilot commands us
  }
  EXPECT_EQ(sut->stage(), AutopilotStage::kOurs);
  EXPECT_EQ(sut->companion().counters().reboots, 0U);
  EXPECT_EQ(sut->state().frame_number, frame_number);
  EXPECT_GE(sut->companion().counters().foreign, 1000U);
  sut->run(2.0);
  EXPECT_NEAR(sut->truth().p_WB.z(), 8.0, 0.7);
}

TEST_P(CompanionContract, HandsOutWhatTheGroundStationAsksForAndObeysNothingOfIt) {
  mav::CommandInt ask;
  ask.target_system = 1;
  ask.target_component = 191;
  ask.frame = 1;
  ask.command = mav::kDoReposition;
  ask.x = 300'000;
  ask.z = -8.0F;
  for (const std::uint8_t ground : {std::uint8_t{0}, std::uint8_t{255}}) {
    Companion::Config with = config();
    with.ground_sysid = ground;
    const auto sut = lane(with);
    sut->run(25.0);
    ASSERT_EQ(sut->stage(), AutopilotStage::kOurs);
    sut->say(254, 190, ask);
    EXPECT_FALSE(sut->companion().asked().has_value()) << "another system";
    sut->say(255, 190, ask);
    const auto asked = sut->companion().asked();
    EXPECT_EQ(asked.has_value(), ground == 255) << "as it is told who may ask";
    EXPECT_FALSE(sut->companion().asked().has_value()) << "once";
    const double x_m = sut->truth().p_WB.x();
    sut->run(3.0);
    EXPECT_NEAR(sut->truth().p_WB.x(), x_m, 0.7) << "whoever flies decides";
    if (asked.has_value()) {
      EXPECT_DOUBLE_EQ(asked->place[1], 30.0);
    }
  }
}

TEST_P(CompanionContract, OutlivesAFloodOfMutatedFramesWithoutAllocation) {
  const auto sut = lane();
  sut->run(25.0);
  ASSERT_EQ(sut->stage(), AutopilotStage::kOurs);
  core::CounterRng rng(7);
  std::array<std::uint8_t, 4096> noise{};
  const auto& types = mav::kAllMessages;
  std::size_t offered = 0;
  for (int round = 0; round < 4000; ++round) {
    std::size_t at = 0;
    while (at + mav::kMostFrame_bytes < noise.size()) {
      mav::Payload payload{};
      for (auto& byte : payload) byte = static_cast<std::uint8_t>(rng.next());
      const auto& type = types[rng.next() % types.size()];
      // Also of the autopilot's own address, but what would speak for it: that is what signing is for.
      const bool own = type.id != 0 && type.id != 2 && type.id != 31 && type.id != 32 && type.id != 331 &&
                       rng.next() % 4 == 0;
      const mav::FrameHeader header{static_cast<std::uint8_t>(rng.next()),
                                    own ? std::uint8_t{1} : static_cast<std::uint8_t>(2 + rng.next() % 250),
                                    static_cast<std::uint8_t>(1 + rng.next() % 3)};
      const auto length =
          mav::write_frame(type, header, payload, nullptr, std::span<std::uint8_t>(noise).subspan(at));
      if (rng.next() % 2 == 0)
        noise.at(at + rng.next() % length.value()) ^= static_cast<std::uint8_t>(1U << (rng.next() % 8));
      at += length.value();
      ++offered;
    }
    const NoAllocScope scope;
    sut->step();
    (void)sut->companion().receive(sut->now(), std::span<const std::uint8_t>(noise).first(at));
    ASSERT_EQ(scope.count(), 0U);
  }
  EXPECT_GT(offered, 50'000U);
  EXPECT_EQ(sut->stage(), AutopilotStage::kOurs);
  sut->run(2.0);
  EXPECT_EQ(sut->stage(), AutopilotStage::kOurs);
  EXPECT_NEAR(sut->truth().p_WB.z(), 8.0, 0.7);
}

INSTANTIATE_TEST_SUITE_P(Both, CompanionContract,
                         ::testing::Values(AutopilotKind::kPx4, AutopilotKind::kArduCopter),
                         [](const auto& p) { return p.param == AutopilotKind::kPx4 ? "Px4" : "ArduCopter"; });

/// One question at now_ns, which moves on to its answer and by a rest after it. True: the answer was taken.
bool asks(mav::ClockMatch& sut, std::int64_t& now_ns, std::int64_t offset_ns, std::int64_t there_ns,
          std::int64_t back_ns, std::int64_t rest_ns) {
  const std::int64_t asked = sut.question(MonotonicTime{Nanos{now_ns}});
  const std::int64_t theirs = now_ns + there_ns + offset_ns;
  now_ns += there_ns + back_ns;
  const bool taken = sut.answer(MonotonicTime{Nanos{now_ns}}, theirs, asked);
  now_ns += rest_ns;
  return taken;
}

TEST(ClockMatch, RefusesSlowAndForeignAnswersAndKeepsTheShortest) {
  mav::ClockMatch sut;
  constexpr std::int64_t kOffset_ns = 123'456'789'000;
  std::int64_t now_ns = 1'000'000'000;
  const auto round_trip = [&](std::int64_t there_ns, std::int64_t back_ns) {
    return asks(sut, now_ns, kOffset_ns, there_ns, back_ns, 100'000'000);
  };
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(round_trip(100'000, 100'000));
  ASSERT_TRUE(sut.matched());
  EXPECT_FALSE(round_trip(100'000, 11'000'000)) << "more than 10 ms";
  EXPECT_FALSE(round_trip(100'000, 1'500'000)) << "more than three times the shortest";
  EXPECT_TRUE(round_trip(100'000, 800'000)) << "fast enough, and of no weight";
  EXPECT_EQ(sut.ours(kOffset_ns + 5'000).time_since_epoch().count(), 5'000);
  EXPECT_FALSE(sut.answer(MonotonicTime{Nanos{now_ns}}, now_ns + kOffset_ns, 42)) << "not our question";
  EXPECT_EQ(sut.counters().slow, 2U);
  EXPECT_EQ(sut.counters().foreign, 1U);
  EXPECT_EQ(sut.counters().moved, 0U);
}

/// As under a loaded machine with ArduCopter in simulation: its clock stands still whenever its world does.
TEST(ClockMatch, FollowsAClockThatStoodStillWithTheFirstAnswerThatProvesIt) {
  mav::ClockMatch sut;
  std::int64_t offset_ns = 123'456'789'000;
  std::int64_t now_ns = 1'000'000'000;
  const auto error_ns = [&] { return sut.ours(now_ns + offset_ns).time_since_epoch().count() - now_ns; };
  const auto round_trip = [&](std::int64_t there_ns, std::int64_t back_ns) {
    return asks(sut, now_ns, offset_ns, there_ns, back_ns, 500'000'000);
  };
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(round_trip(100'000, 100'000));
  offset_ns -= 6'000'000;
  EXPECT_FALSE(round_trip(4'000'000, 5'000'000)) << "too slow to prove anything";
  EXPECT_EQ(error_ns(), -6'000'000);
  EXPECT_TRUE(round_trip(1'000'000, 2'000'000)) << "too slow for a good one, and proof enough";
  EXPECT_EQ(sut.counters().moved, 1U);
  EXPECT_LE(std::abs(error_ns()), 1'500'000);
  EXPECT_TRUE(round_trip(100'000, 100'000));
  EXPECT_EQ(error_ns(), 0);
  for (int i = 0; i < 40; ++i) {  // 2.3 % slow, as it was seen: 11.5 ms between two questions
    offset_ns -= 11'500'000;
    ASSERT_TRUE(round_trip(100'000, 100'000));
    ASSERT_EQ(error_ns(), 0);
  }
  EXPECT_EQ(sut.counters().moved, 41U);
}

}  // namespace
}  // namespace roborun::test
