#include "platform/mission/recording.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "platform/board/board_profile.hpp"
#include "platform/input/input_error.hpp"
#include "platform/mission/flight_setup.hpp"
#include "platform/mission/mission.hpp"
#include "platform/mission/replay.hpp"
#include "platform/sitl/aircraft/camera_rig.hpp"
#include "platform/sitl/world/world_file.hpp"
#include "platform/vehicle/vehicle_file.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::mission {
namespace {

std::string read(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}
void write(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

/// A flight past two pillars, given up after a while.
class Replay : public ::testing::Test {
 protected:
  Replay() : world_(sitl::load_world(std::string(ROBORUN_TEST_DATA) + "/worlds/two_pillars.toml", {})) {
    config_.flight.costs = board::paper().costs;
    config_.flight.model = board::paper().model;
    config_.simulator.camera.pixels = 32;
    config_.judge.time_limit_s = 20.0;
  }
  /// Returns the path of the recording.
  std::string record() {
    config_.record = test::scratch("good.rec");
    recorded_ = fly_mission(world_, config_, {}).result;
    return config_.record;
  }
  /// The one line with which a file of these bytes is refused; empty if it is not.
  static std::string refusal(const std::string& bytes) {
    const std::string path = test::scratch("bad.rec");
    write(path, bytes);
    try {
      (void)replay_flight(path, {});
    } catch (const InputError& error) {
      return error.what();
    }
    return {};
  }
  sitl::World world_;
  MissionConfig config_;
  report::MissionResult recorded_;
};

TEST_F(Replay, IsTheSameFlightFromItsInputsAlone) {
  const ReplayResult r = replay_flight(record(), {});
  EXPECT_GE(recorded_.decisions, 4U);
  EXPECT_EQ(r.replayed.decisions, recorded_.decisions);
  EXPECT_GT(r.replayed.minor_frames, 8000U);
  EXPECT_NE(r.replayed.digest, 0U);
  EXPECT_EQ(r.replayed.digest, r.recorded.digest);
  EXPECT_TRUE(r.same());
  config_.record.clear();
  EXPECT_EQ(fly_mission(world_, config_, {}).result.state_hash, recorded_.state_hash)
      << "recording changed the flight";
}

/// A camera of any optics in front, a square one that looks down behind, a LiDAR on top.
SensorRig two_cameras_and_a_lidar() {
  SensorRig rig;
  CameraSpec camera;
  camera.width = 64;
  camera.height = 40;
  camera.tan_half_width = rig_detail::tan_of_half_deg(87.0);
  camera.tan_half_height = rig_detail::tan_of_half_deg(58.0);
  camera.range_min_m = 0.2;
  camera.range_m = 12.0;
  camera.rate_Hz = 30.0;
  camera.mount = {0.1, 0.0, 0.3, 0.0, 5.0, 0.0};
  (void)rig.cameras.push_back(camera);
  CameraSpec behind;
  behind.width = behind.height = 32;
  behind.mount = {-0.1, 0.02, 0.3, 180.0, 33.3, 1.0};
  (void)rig.cameras.push_back(behind);
  LidarSpec lidar;
  lidar.columns = 180;
  lidar.mount.z_m = 0.2;
  (void)rig.lidars.push_back(lidar);
  return rig;
}

TEST_F(Replay, HoldsDifferentCamerasAndALidar) {
  config_.simulator.rig = two_cameras_and_a_lidar();
  const ReplayResult r = replay_flight(record(), {});
  EXPECT_GE(recorded_.decisions, 4U);
  EXPECT_TRUE(r.same()) << "frame " << r.diverged_in << " of " << r.recorded.minor_frames;
  const RecordedFlight flight = Recording(config_.record).flight();
  ASSERT_EQ(flight.mounts.size(), 2U);
  ASSERT_EQ(flight.lidar_mounts.size(), 1U);
  for (std::size_t i = 0; i < 2; ++i)
    EXPECT_EQ(flight.mounts[i].R_BC, camera_mount(config_.simulator.rig->cameras[i].mount).R_BC);
  EXPECT_EQ(flight.lidar_mounts[0].p_BC_m, (std::array<double, 3>{0.0, 0.0, 0.2}));
  EXPECT_EQ(flight.sensors.cameras[0].width, 64);
  EXPECT_EQ(flight.sensors.cameras[0].height, 40);
  EXPECT_EQ(flight.sensors.cameras[0].range_min_m, 0.2);
  EXPECT_NEAR(flight.sensors.cameras[0].tan_half_width, config_.simulator.rig->cameras[0].tan_half_width,
              1e-12);
  EXPECT_EQ(flight.sensors.cameras[1].mount.pitch_deg, 33.3);
  EXPECT_EQ(flight.sensors.lidars[0].columns, 180);
  EXPECT_EQ(flight.flight.camera_range_m, 12.0);
  int images = 0, sweeps = 0;
  for (Recording recording(config_.record); recording.kind() != RecordKind::kEnd; recording.next()) {
    images += recording.kind() == RecordKind::kDepth ? 1 : 0;
    sweeps += recording.kind() == RecordKind::kLidar ? 1 : 0;
  }
  EXPECT_GT(images, 4);
  EXPECT_GT(sweeps, 3);
  config_.record.clear();
  EXPECT_EQ(fly_mission(world_, config_, {}).result.state_hash, recorded_.state_hash)
      << "recording changed the flight";
}

TEST_F(Replay, HoldsTheModelsOfItsSensors) {
  config_.simulator.rig = two_cameras_and_a_lidar();
  config_.simulator.rig->cameras[0].model = CameraModel::kD455;
  config_.simulator.rig->lidars[0].model = LidarModel::kMid360;
  config_.simulator.sensors.imu = ImuModel::kMems;
  config_.simulator.sensors.gnss = GnssModel::kM9n;
  const ReplayResult r = replay_flight(record(), {});
  EXPECT_TRUE(r.same()) << "frame " << r.diverged_in << " of " << r.recorded.minor_frames;
  const RecordedFlight flight = Recording(config_.record).flight();
  EXPECT_EQ(flight.sensors.cameras[0].model, CameraModel::kD455);
  EXPECT_EQ(flight.sensors.cameras[1].model, CameraModel::kClean);
  EXPECT_EQ(flight.sensors.lidars[0].model, LidarModel::kMid360);
}

TEST_F(Replay, HoldsAVehicleWhoseStoppingNobodyMeasured) {
  set_vehicle(config_, vehicle::load_vehicle("x500"));
  ASSERT_FALSE(config_.flight.vehicle.measured_stopping.has_value()) << "else nothing is tested";
  const ReplayResult r = replay_flight(record(), {});
  EXPECT_TRUE(r.same()) << "frame " << r.diverged_in << " of " << r.recorded.minor_frames;
}

TEST_F(Replay, AnswersToFaultsAndKeepsTheFenceAsTheRecordedFlightDid) {
  ASSERT_EQ(config_.flight.fence.set_altitude(-5.0, 9.0), core::FenceFault::kNone);
  ASSERT_EQ(config_.flight.fence.add_circle(core::FenceSide::kKeepIn, {20.0, 0.0}, 500.0),
            core::FenceFault::kNone);
  config_.judge.time_limit_s = 60.0;
  for (const sitl::Fault& fault : {sitl::Fault{sitl::Component::kBattery, sitl::FaultKind::kWrong},
                                   sitl::Fault{sitl::Component::kLink, sitl::FaultKind::kOff},
                                   sitl::Fault{sitl::Component::kEscStatus, sitl::FaultKind::kOff},
                                   sitl::Fault{sitl::Component::kKillSwitch, sitl::FaultKind::kOn}}) {
    config_.faults = {{fault, governor::Phase::kMission, 1.0}};
    config_.record.clear();
    const report::MissionReport without = fly_mission(world_, config_, {});
    EXPECT_FALSE(without.safety.actions.empty()) << "no answer: nothing was tested";
    const ReplayResult r = replay_flight(record(), {});
    EXPECT_EQ(recorded_.state_hash, without.result.state_hash) << "recording changed the flight";
    EXPECT_TRUE(r.same()) << recorded_.reason << ", frame " << r.diverged_in << " of "
                          << r.recorded.minor_frames;
  }
}

TEST_F(Replay, AFlightWithAFaultOfTheComputerIsNotRecorded) {
  for (const sitl::Component component :
       {sitl::Component::kCpu, sitl::Component::kPlanner, sitl::Component::kMap}) {
    config_.faults = {{{component, sitl::FaultKind::kOff}, governor::Phase::kMission, 1.0}};
    EXPECT_THROW((void)record(), InputError);
  }
}

TEST_F(Replay, RefusesAFileThatIsCutOffAnywhere) {
  const std::string whole = read(record());
  ASSERT_GT(whole.size(), 100'000U);
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{5}, std::size_t{100}, whole.size() / 3, whole.size() - 1}) {
    const std::string line = refusal(whole.substr(0, size));
    EXPECT_NE(line.find("cut off"), std::string::npos) << size << ": " << line;
    EXPECT_EQ(line.find('\n'), std::string::npos);
  }
  EXPECT_NE(refusal(whole + "x").find("something follows"), std::string::npos);
}

TEST_F(Replay, RefusesAFileInWhichOneBitWasChanged) {
  const std::string whole = read(record());
  for (std::size_t i = 1; i <= 12; ++i) {
    std::string bad = whole;
    char& byte = bad[i * (whole.size() / 13)];
    byte = static_cast<char>(byte ^ (1 << (i % 8)));
    EXPECT_NE(refusal(bad), "") << i;
  }
}

TEST_F(Replay, RefusesWhatIsNoRecording) {
  EXPECT_NE(refusal("[world]\nbounds = [[0,0,0],[9,9,9]]\n").find("no record of a flight"),
            std::string::npos);
  // A length that nobody has memory for.
  EXPECT_NE(refusal(std::string("\x05\0\0\0\xff\xff\xff\xff", 8) + std::string(64, 'x')).find("no record"),
            std::string::npos);
  EXPECT_THROW((void)replay_flight(test::scratch("not_there.rec"), {}), InputError);
}

TEST_F(Replay, AFlightThatWasNotFinishedLeavesTheRecordingBefore) {
  const std::string before = record();
  const std::string bytes = read(before);
  sitl::CameraRig rig(world_, config_.simulator, 1);
  sitl::SimulatedAircraft aircraft(config_.flight.vehicle, config_.simulator, ground_below(world_), 1,
                                   core::kMinorFrame, rig);
  { FlightRecorder recorder(before, flight_config_of(world_, config_), config_, aircraft, rig.cameras()); }
  EXPECT_EQ(read(before), bytes);
}

TEST_F(Replay, RefusesAConfigurationThatNobodyWrote) {
  // The checksum is no secret: whoever makes a file can make it fit. What is in it is checked all the same.
  const auto refused = [&](const char* wanted, const MissionConfig& config) {
    const std::string path = test::scratch("config.rec");
    sitl::CameraRig rig(world_, config_.simulator, 1);
    sitl::SimulatedAircraft aircraft(config_.flight.vehicle, config_.simulator, ground_below(world_), 1,
                                     core::kMinorFrame, rig);
    flight::FlightConfig written = flight_config_of(world_, config_);
    written.vehicle = config.flight.vehicle;
    written.minor_frame = config.flight.minor_frame;
    written.costs = config.flight.costs;
    FlightSetup setup(flight_config_of(world_, config_), config_.backends, image_limits(config_));
    FlightRecorder recorder(path, written, config, aircraft, rig.cameras());
    recorder.finish(setup.parts().map);
    constexpr std::uintmax_t kEnd_bytes = 8 + 24 + 8;
    std::filesystem::resize_file(path, std::filesystem::file_size(path) - kEnd_bytes);
    try {
      (void)replay_flight(path, {});
      FAIL() << wanted;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(wanted), std::string::npos) << error.what();
    }
  };
  refused("cut off", config_);  // nothing but a configuration
  MissionConfig bad = config_;
  bad.flight.minor_frame = Nanos{1};
  refused("minor_frame_ns", bad);
  bad = config_;
  bad.flight.vehicle.speed_mps = 1e9;
  refused("speed_mps", bad);
  bad = config_;
  bad.flight.costs.stage[2].fixed_s[1] = -1.0;
  refused("fixed_s", bad);
  bad = config_;
  bad.backends.map = "nope";
  refused("nope", bad);
}

}  // namespace
}  // namespace roborun::mission
