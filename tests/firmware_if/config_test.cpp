// Configs of the units at the boundary.
#include <gtest/gtest.h>

#include "firmware_if/dronecan/node.hpp"
#include "firmware_if/package_release.hpp"
#include "firmware_if/transmit_gate.hpp"
#include "tests/firmware_if/recording_bus.hpp"
#include "tests/support/config_death.hpp"

namespace roborun::firmware_if {
namespace {

using std::chrono::milliseconds;

TEST(TransmitGateConfigDeathTest, OnlyValidOnesAreMade) {
  using Config = TransmitGate::Config;
  test::expect_only_valid_configs<Config>(
      {},
      [](const Config& config) {
        test::RecordingBus bus;
        const TransmitGate sut(config, bus);
      },
      {{"no ESC", [](Config& c) { c.esc_count = 0; }},
       {"too many ESCs", [](Config& c) { c.esc_count = 21; }},
       {"a throttle beyond the message", [](Config& c) { c.throttle_max = 8192; }},
       {"no rise", [](Config& c) { c.rise_per_s = 0; }},
       {"no time for a beat", [](Config& c) { c.beat_timeout = Nanos{0}; }}});
}

TEST(PackageReleaseConfigDeathTest, OnlyValidOnesAreMade) {
  using Config = PackageRelease::Config;
  test::expect_only_valid_configs<Config>({},
                                          [](const Config& config) {
                                            test::RecordingBus bus;
                                            TransmitGate gate({}, bus);
                                            const PackageRelease sut(config, gate, nullptr);
                                          },
                                          {{"no dwell", [](Config& c) { c.steady = Nanos{0}; }},
                                           {"no height", [](Config& c) { c.height_max_m = 0.0; }},
                                           {"too fast", [](Config& c) { c.speed_max_mps = 2.1; }}});
}

TEST(NodeConfigDeathTest, OnlyValidOnesAreMade) {
  using Config = dronecan::Node::Config;
  test::expect_only_valid_configs<Config>(
      {},
      [](const Config& config) {
        test::RecordingBus bus;
        TransmitGate gate({}, bus);
        std::array<dronecan::Reassembler::Session, 4> sessions;
        const dronecan::Node sut(config, gate, bus, sessions);
      },
      {{"no identity", [](Config& c) { c.node_id = 0; }},
       {"no node id", [](Config& c) { c.node_id = 128; }},
       {"no ESC", [](Config& c) { c.esc_count = 0; }},
       {"commands faster than the gate lets through", [](Config& c) { c.command_period = milliseconds{2}; }},
       {"no frame", [](Config& c) { c.most_frames_a_step = 0; }}});
}

}  // namespace
}  // namespace roborun::firmware_if
