// A delivery in a closed loop: the vehicle flies by throttles on the bus, comes down to where a parcel may
// fall, and its hook is opened over the same bus, through interlock and gate.
#include <gtest/gtest.h>

#include <array>

#include "firmware_if/dronecan/node.hpp"
#include "firmware_if/kill_switch.hpp"
#include "firmware_if/package_release.hpp"
#include "platform/sitl/bus/fake_can.hpp"
#include "platform/sitl/bus/fake_esc.hpp"
#include "platform/sitl/bus/fake_gpio.hpp"
#include "platform/sitl/bus/fake_hardpoint.hpp"
#include "tests/platform/sitl/vehicle/flight.hpp"

namespace roborun::test {
namespace {

namespace dc = firmware_if::dronecan;

constexpr Nanos kFrame = Flight::kFrame;
constexpr double kClimb_m = 5.0;
constexpr double kDrop_m = 1.5;

/// Flight lane, node, gate, interlock; bus, ESCs, hook; vehicle. The mission wants the release all the time.
class Delivery final : public firmware_if::Motors {
 public:
  explicit Delivery(std::uint64_t seed) : vehicle_({}, {}, Vector3::Zero(), seed), sensors_({}, seed) {
    kill_closed_.drive(true, {});
    lane_.set_cruise_height(5.0);
  }
  [[nodiscard]] Status command(const firmware_if::MotorCommand& command) noexcept override {
    thrust_ratio_ = command.thrust_ratio;
    armed_ = armed_ || gate_.arm_unproven() == Status::kOk;
    return Status::kOk;
  }
  void step() {
    now_ += kFrame;
    sensors_.sample(now_, vehicle_.state());
    lane_.step(now_, sensors_, *this);
    if (kill_switch_.sample()) gate_.kill();
    gate_.beat(now_);
    (void)node_.step(now_, {.cycle_ok = true, .armed = armed_, .thrust_ratio = thrust_ratio_});
    stages::EstimatedState state;
    const bool estimated = lane_.estimator().state(state) == Status::kOk;
    EXPECT_EQ(release_.step(now_, {.wanted = lane_.airborne(),
                                   .killed = kill_switch_.killed(),
                                   .estimated = estimated,
                                   .height_m = state.p_WB.z() - lane_.ground_m(),
                                   .speed_mps = state.v_WB.norm()}),
              Status::kOk);
    vehicle_.step(kFrame / 2);
    bus_.advance(now_ + kFrame / 2);
    firmware_if::MotorCommand out;
    for (std::size_t i = 0; i < escs_.size(); ++i) out.thrust_ratio[i] = escs_[i].step(now_ + kFrame / 2);
    (void)vehicle_.command(out);
    hook_.step(now_ + kFrame / 2);
    vehicle_.step(kFrame / 2);
  }
  void run(double duration_s) {
    for (const MonotonicTime end = now_ + from_seconds(duration_s); now_ < end;) step();
  }
  void climb() {
    while (!lane_.airborne() && now_ < MonotonicTime{std::chrono::seconds{60}}) step();
  }
  void fly_to(const Vector3& p_W, double speed_mps) {
    const Trajectory line = straight(lane_.committed().end_W(), p_W, speed_mps, now_ + kFrame);
    lane_.offer(line);
    run(line.duration_s() + 2.0);
  }
  void press_kill_switch() { kill_open_.drive(true, now_), kill_closed_.drive(false, now_); }
  [[nodiscard]] const sitl::VehicleState& truth() const { return vehicle_.state(); }
  [[nodiscard]] const sitl::FakeHardpoint& hook() const { return hook_; }
  [[nodiscard]] const firmware_if::PackageRelease& release() const { return release_; }
  [[nodiscard]] const dc::HardpointStatus& hook_says() const { return node_.inbox().hardpoint.message; }
  [[nodiscard]] Vector3 above_the_drop() const {
    return {lane_.home_W().x(), lane_.home_W().y(), lane_.ground_m() + kDrop_m};
  }

 private:
  MonotonicTime now_{};
  sitl::Vehicle vehicle_;
  sitl::NavigationSensors sensors_;
  flight::FlightControl lane_{{}, 0.0025};
  sitl::FakeCan bus_{1'000'000, 3};
  sitl::FakeCanPort& port_ = bus_.port(0);
  firmware_if::TransmitGate gate_{{}, port_};
  std::array<dc::Reassembler::Session, 32> sessions_{};
  dc::Node node_{{}, gate_, port_, sessions_};
  std::array<sitl::FakeEsc, 4> escs_{{{{.node_id = 21, .index = 0}, bus_.port(1)},
                                      {{.node_id = 22, .index = 1}, bus_.port(2)},
                                      {{.node_id = 23, .index = 2}, bus_.port(3)},
                                      {{.node_id = 24, .index = 3}, bus_.port(4)}}};
  sitl::FakeHardpoint hook_{{.node_id = 26}, bus_.port(5)};
  sitl::FakeGpioInput kill_open_;
  sitl::FakeGpioInput kill_closed_;
  firmware_if::KillSwitch kill_switch_{kill_open_, kill_closed_};
  firmware_if::PackageRelease release_{{}, gate_, nullptr};
  std::array<double, 4> thrust_ratio_{};
  bool armed_{false};
};

TEST(Delivery, ThePackageFallsFromBelowTwoMetresAndNotBefore) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Delivery sut(seed);
    sut.climb();
    ASSERT_GT(sut.truth().p_WB.z(), 4.0);
    sut.run(3.0);
    EXPECT_TRUE(sut.hook().holds_package()) << "too high";
    EXPECT_GT(sut.release().counters().unsafe, 1000U) << "it was wanted all the time";
    EXPECT_EQ(sut.hook_says().payload_weight, 20.0F);

    sut.fly_to(sut.above_the_drop(), 1.0);
    EXPECT_FALSE(sut.hook().holds_package());
    EXPECT_EQ(sut.release().counters().releases, 1U);
    EXPECT_EQ(sut.hook_says().payload_weight, 0.0F) << "the runtime knows";
    EXPECT_LT(sut.truth().p_WB.z(), 2.0);
    EXPECT_GT(sut.truth().p_WB.z(), 1.0) << "and still hovers";
  }
}

TEST(Delivery, AKilledVehicleKeepsItsPackageAllTheWayDown) {
  Delivery sut(1);
  sut.climb();
  sut.run(1.0);
  sut.press_kill_switch();
  sut.run(5.0);
  EXPECT_TRUE(sut.truth().on_ground);
  EXPECT_TRUE(sut.hook().holds_package());
  EXPECT_EQ(sut.release().counters().releases, 0U);
  EXPECT_GE(sut.hook().commands(), 3U) << "it was told to hold, each second";
}

}  // namespace
}  // namespace roborun::test
