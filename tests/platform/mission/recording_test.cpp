#include "platform/mission/recording.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "platform/board/board_profile.hpp"
#include "platform/input/input_error.hpp"
#include "platform/log/mcap_reader.hpp"
#include "platform/log/mcap_writer.hpp"
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
    config_.log = test::scratch("good.mcap");
    recorded_ = fly_mission(world_, config_, {}).result;
    return config_.log;
  }
  /// The one line that is said of a file of these bytes, refused or replayed to its damage; empty: nothing is.
  static std::string complaint(const std::string& bytes, ReplayResult* result = nullptr) {
    const std::string path = test::scratch("bad.mcap");
    write(path, bytes);
    try {
      const ReplayResult r = replay_flight(path, {});
      if (result != nullptr) *result = r;
      EXPECT_TRUE(r.same()) << "a damaged log was read wrongly: "
                            << (r.difference ? r.difference->what : r.damage);
      return r.damage;
    } catch (const InputError& error) {
      return error.what();
    }
  }
  sitl::World world_;
  MissionConfig config_;
  report::MissionResult recorded_;
};

TEST_F(Replay, IsTheSameFlightFromItsInputsAlone) {
  const ReplayResult r = replay_flight(record(), {});
  EXPECT_GE(recorded_.decisions, 4U);
  EXPECT_EQ(r.replayed.decisions, recorded_.decisions);
  EXPECT_GT(r.replayed.minor_frames, 7000U);
  EXPECT_NE(r.replayed.digest, 0U);
  EXPECT_EQ(r.replayed.digest, r.recorded.digest);
  EXPECT_TRUE(r.same());
  EXPECT_EQ(r.damage, "");
  config_.log.clear();
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
  EXPECT_TRUE(r.same()) << "frame " << r.replayed.minor_frames << " of " << recorded_.mission_time_s << " s";
  const RecordedFlight flight = Recording(config_.log).flight();
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
  for (Recording recording(config_.log); recording.kind() != RecordKind::kEnd; recording.next()) {
    images += recording.kind() == RecordKind::kDepth ? 1 : 0;
    sweeps += recording.kind() == RecordKind::kLidar ? 1 : 0;
  }
  EXPECT_GT(images, 4);
  EXPECT_GT(sweeps, 3);
  config_.log.clear();
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
  EXPECT_TRUE(r.same()) << "frame " << r.replayed.minor_frames << " of " << recorded_.mission_time_s << " s";
  const RecordedFlight flight = Recording(config_.log).flight();
  EXPECT_EQ(flight.sensors.cameras[0].model, CameraModel::kD455);
  EXPECT_EQ(flight.sensors.cameras[1].model, CameraModel::kClean);
  EXPECT_EQ(flight.sensors.lidars[0].model, LidarModel::kMid360);
}

TEST_F(Replay, HoldsAVehicleWhoseStoppingNobodyMeasured) {
  set_vehicle(config_, vehicle::load_vehicle("x500"));
  ASSERT_FALSE(config_.flight.vehicle.measured_stopping.has_value()) << "else nothing is tested";
  const ReplayResult r = replay_flight(record(), {});
  EXPECT_TRUE(r.same()) << "frame " << r.replayed.minor_frames << " of " << recorded_.mission_time_s << " s";
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
    config_.log.clear();
    const report::MissionReport without = fly_mission(world_, config_, {});
    EXPECT_FALSE(without.safety.actions.empty()) << "no answer: nothing was tested";
    const ReplayResult r = replay_flight(record(), {});
    EXPECT_EQ(recorded_.state_hash, without.result.state_hash) << "recording changed the flight";
    EXPECT_TRUE(r.same()) << recorded_.reason << ", frame " << r.replayed.minor_frames << " of "
                          << recorded_.mission_time_s;
  }
}

TEST_F(Replay, TheLogOfAFlightWithAFaultOfTheComputerSaysThatItHoldsNoInputs) {
  config_.judge.time_limit_s = 1.0;
  for (const sitl::Component component :
       {sitl::Component::kCpu, sitl::Component::kPlanner, sitl::Component::kMap}) {
    config_.faults = {{{component, sitl::FaultKind::kOff}, governor::Phase::kMission, 1.0}};
    const std::string path = record();
    try {
      (void)replay_flight(path, {});
      FAIL();
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("holds no inputs to replay: it had a fault"),
                std::string::npos);
    }
  }
}

TEST_F(Replay, ReplaysALogThatIsCutOffAnywhereToTheCut) {
  const std::string whole = read(record());
  ASSERT_GT(whole.size(), 300'000U);
  double before_s = -1.0;
  int replayed = 0;
  for (int i = 0; i <= 12; ++i) {
    ReplayResult r;
    const std::string line =
        complaint(whole.substr(0, (whole.size() - 1) * static_cast<std::size_t>(i) / 12), &r);
    EXPECT_NE(line, "") << i;
    EXPECT_EQ(line.find('\n'), std::string::npos);
    if (r.replayed.minor_frames == 0) continue;
    ++replayed;
    EXPECT_GE(r.seconds, before_s);
    before_s = r.seconds;
  }
  EXPECT_GE(replayed, 10);
  EXPECT_GE(before_s, recorded_.mission_time_s - 0.01)
      << "without its last byte nothing of the flight is missing";
  EXPECT_NE(complaint(whole + "x").find("something follows"), std::string::npos);
}

TEST_F(Replay, LosesAtMostTheLastSecondOfAFlightThatIsCutOff) {
  const std::string path = record();
  const auto end_s = [&path] { return replay_flight(path, {}).seconds; };
  const double whole_s = end_s();
  // What is in the file when the flight is at each of these places is in it for good: take the ends of its chunks.
  log::McapReader reader(path);
  double last_s = 0.0;
  double longest_s = 0.0;
  std::uint64_t chunks = 0;
  for (log::Message message; reader.next(message);) {
    const double now_s = 1e-9 * static_cast<double>(message.log_ns);
    if (reader.chunks() != chunks) {
      longest_s = std::max(longest_s, now_s - last_s);
      chunks = reader.chunks();
      last_s = now_s;
    }
  }
  EXPECT_GE(static_cast<double>(chunks), whole_s);
  EXPECT_LE(longest_s, 1.0);
}

TEST_F(Replay, SaysOfAFileInWhichOneBitWasChangedWhereItEnds) {
  const std::string whole = read(record());
  for (std::size_t i = 1; i <= 12; ++i) {
    std::string bad = whole;
    char& byte = bad[i * (whole.size() / 13)];
    byte = static_cast<char>(byte ^ (1 << (i % 8)));
    EXPECT_NE(complaint(bad), "") << i;
  }
}

TEST_F(Replay, EndsWhereItIsAskedTo) {
  const std::string path = record();
  const ReplayResult r = replay_flight(path, {}, 5.0);
  EXPECT_TRUE(r.same());
  EXPECT_EQ(r.replayed.minor_frames, 2000U);
  EXPECT_EQ(r.damage, "");
}

/// The inputs of a log, with a change in them, as another log.
std::string changed_log(const std::string& path,
                        const std::function<bool(RecordKind, std::string&)>& change) {
  const std::string to = test::scratch("changed.mcap");
  log::LogFile file(to, false);
  log::McapWriter writer(file, "", "test");
  std::map<std::uint16_t, std::uint16_t> channels;
  log::McapReader reader(path);
  bool changed = false;
  for (log::Message message; reader.next(message);) {
    std::uint16_t& channel = channels[message.channel->id];
    if (channel == 0)
      channel = writer.add_channel(0, message.channel->topic, message.channel->message_encoding);
    std::string data(message.data);
    if (message.channel->topic == log::FlightLog::kInputsTopic) {
      const InputRecords inputs = records_from(data);
      InputBatch batch;
      for (const InputRecord& record : inputs.records) {
        std::string payload = inputs.payloads.substr(record.at, record.bytes);
        if (!changed) changed = change(record.kind, payload);
        batch.add(record.kind, payload);
      }
      data = batch.take();
    }
    writer.message(channel, message.log_ns, data);
  }
  writer.finish();
  EXPECT_TRUE(changed) << "nothing was tested";
  return to;
}

TEST_F(Replay, NamesTheFirstDifferenceWithStageAndValues) {
  const std::string path = record();
  EXPECT_TRUE(replay_flight(changed_log(path, [](RecordKind, std::string&) { return true; }), {}).same())
      << "the copy alone is another flight";
  // Another knob in the third decision.
  int decisions = 0;
  const ReplayResult knob = replay_flight(changed_log(path,
                                                      [&decisions](RecordKind kind, std::string& payload) {
                                                        if (kind != RecordKind::kDecision || ++decisions < 3)
                                                          return false;
                                                        payload[8 * 8] =
                                                            static_cast<char>(payload[8 * 8] + 1);
                                                        return true;
                                                      }),
                                          {});
  ASSERT_TRUE(knob.difference.has_value());
  const ReplayDifference& p0 = *knob.difference;
  EXPECT_EQ(p0.stage, "governor");
  EXPECT_EQ(p0.what, "p0_level");
  EXPECT_EQ(std::stoi(p0.recorded), std::stoi(p0.replayed) + 1);
  EXPECT_EQ(knob.replayed.decisions, 3U);
  EXPECT_FALSE(knob.same());
  // Another motor command at about 6 s.
  int commands = 0;
  const ReplayResult motor = replay_flight(changed_log(path,
                                                       [&commands](RecordKind kind, std::string& payload) {
                                                         if (kind != RecordKind::kMotors || ++commands < 2000)
                                                           return false;
                                                         payload[4 + 2 + 1] =
                                                             static_cast<char>(payload[4 + 2 + 1] + 8);
                                                         return true;
                                                       }),
                                           {});
  ASSERT_TRUE(motor.difference.has_value());
  EXPECT_EQ(motor.difference->stage, "track");
  EXPECT_EQ(motor.difference->what, "motor 2");
  EXPECT_GT(std::stod(motor.difference->recorded), std::stod(motor.difference->replayed));
  // Another input: what follows from it differs from what was recorded.
  int samples = 0;
  const ReplayResult imu = replay_flight(changed_log(path,
                                                     [&samples](RecordKind kind, std::string& payload) {
                                                       if (kind != RecordKind::kImu || ++samples < 2000)
                                                         return false;
                                                       payload[12 + 6] =
                                                           static_cast<char>(payload[12 + 6] ^ 0x10);
                                                       return true;
                                                     }),
                                         {});
  ASSERT_TRUE(imu.difference.has_value());
  EXPECT_EQ(imu.difference->stage, "track");
  EXPECT_NEAR(imu.difference->time_s, 5.0, 0.1);
}

/// A replay of what is behind 13 s, with keyframes each 3 s.
struct Tail {
  Tail(const std::string& path, const std::string& folder, double from_s = 13.0)
      : result(replay_flight(path, {}, std::numeric_limits<double>::infinity(),
                             [&](const log::DecisionEntry& entry) {
                               if (seconds(Nanos{entry.time_ns}) >= from_s)
                                 decisions.push_back(log::decision_json(entry));
                             },
                             {.from_s = from_s, .keyframes = folder, .every = Nanos{3'000'000'000}})) {}
  std::vector<std::string> decisions;
  ReplayResult result;
};

std::map<std::string, std::string> files_of(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    files[entry.path().filename().string()] = read(entry.path().string());
  return files;
}

TEST_F(Replay, FromAKeyframeIsTheSameFlight) {
  const std::string path = record();
  const std::string folder = test::scratch("keyframes");
  const Tail first(path, folder);
  ASSERT_TRUE(first.result.same());
  EXPECT_EQ(first.result.keyframe_s, 0.0);
  ASSERT_GE(first.decisions.size(), 2U);
  ASSERT_GE(files_of(folder).size(), 4U);
  const Tail again(path, folder);
  EXPECT_DOUBLE_EQ(again.result.keyframe_s, 12.0);
  EXPECT_TRUE(again.result.same()) << "its map in the end, too";
  EXPECT_EQ(again.result.replayed, first.result.replayed);
  EXPECT_NE(again.result.replayed.digest, 0U);
  EXPECT_EQ(again.decisions, first.decisions);
}

TEST_F(Replay, StartsFromAKeyframeWhereverItsMemoryIs) {
  const std::string path = record();
  const std::string folder = test::scratch("elsewhere");
  const Tail first(path, folder);
  // Flights at once cannot stand at the same place.
  std::vector<std::thread> threads;
  for (int i = 0; i < 3; ++i)
    threads.emplace_back([&] {
      const Tail again(path, folder);
      EXPECT_DOUBLE_EQ(again.result.keyframe_s, 12.0);
      EXPECT_TRUE(again.result.same());
      EXPECT_EQ(again.decisions, first.decisions);
    });
  for (std::thread& thread : threads) thread.join();
}

TEST_F(Replay, BelievesNoKeyframeAgainstTheLog) {
  const std::string path = record();
  const std::string folder = test::scratch("doubtful");
  const Tail first(path, folder);
  ASSERT_TRUE(first.result.same());
  // A log that says another motor command than the flight gave, behind the keyframe.
  int commands = 0;
  const std::string other = changed_log(path, [&commands](RecordKind kind, std::string& payload) {
    if (kind != RecordKind::kMotors || ++commands < 5500) return false;
    payload[4] = static_cast<char>(payload[4] + 8);
    return true;
  });
  const Tail differs(other, folder, 12.5);
  ASSERT_TRUE(differs.result.difference.has_value());
  EXPECT_EQ(differs.result.keyframe_s, 0.0) << "replayed from the beginning";
  EXPECT_EQ(differs.result.difference->what, "motor 1");
  EXPECT_GT(differs.result.seconds, 12.5);
  // Files that are damaged, and one of another moment under this one's name.
  const auto files = files_of(folder);
  std::string earlier;
  for (const auto& [name, bytes] : files)
    if (name.find("-2400.") != std::string::npos) earlier = bytes;
  ASSERT_FALSE(earlier.empty());
  for (const bool damaged : {true, false}) {
    for (const auto& [name, bytes] : files) {
      std::string now = damaged ? bytes : earlier;
      if (damaged) now[now.size() / 2] = static_cast<char>(now[now.size() / 2] ^ 1);
      write((std::filesystem::path(folder) / name).string(), now);
    }
    const Tail again(path, folder);
    EXPECT_EQ(again.result.keyframe_s, 0.0);
    EXPECT_TRUE(again.result.same());
    EXPECT_EQ(again.decisions, first.decisions) << "each told once";
  }
}

TEST_F(Replay, ReplaysWithoutKeyframesWhereNoneCanBeKept) {
  const std::string path = record();
  const std::string file = test::scratch("no_folder");
  write(file, "a file\n");
  for (int i = 0; i < 2; ++i) {
    const Tail tail(path, file);
    EXPECT_TRUE(tail.result.same());
    EXPECT_EQ(tail.result.keyframe_s, 0.0);
  }
  EXPECT_EQ(read(file), "a file\n");
}

TEST_F(Replay, RefusesWhatIsNoLog) {
  EXPECT_NE(complaint("[world]\nbounds = [[0,0,0],[9,9,9]]\n").find("no MCAP file"), std::string::npos);
  EXPECT_THROW((void)replay_flight(test::scratch("not_there.mcap"), {}), InputError);
}

TEST_F(Replay, AFullDiskEndsTheLogAndNotTheFlight) {
  config_.log = "/dev/full";
  const report::MissionReport flown = fly_mission(world_, config_, {});
  EXPECT_NE(flown.log_error.find("/dev/full: cannot be written: No space left on device; "),
            std::string::npos);
  config_.log.clear();
  EXPECT_EQ(fly_mission(world_, config_, {}).result.state_hash, flown.result.state_hash);
}

TEST_F(Replay, RefusesAConfigurationThatNobodyWrote) {
  // The CRC is no secret: whoever makes a file can make it fit. What is in it is checked all the same.
  const auto refused = [&](const char* wanted, const MissionConfig& config) {
    const std::string path = test::scratch("config.mcap");
    flight::FlightConfig written = flight_config_of(world_, config_);
    written.vehicle = config.flight.vehicle;
    written.minor_frame = config.flight.minor_frame;
    written.costs = config.flight.costs;
    sitl::CameraRig rig(world_, config_.simulator, 1);
    log::FlightLog log(path, false);
    log.configure(R"({"replay":"","flight":)" +
                      to_json(recorded_flight_of(written, config, rig.cameras(), rig.lidars())) + "}",
                  {});
    log.finish();
    try {
      const ReplayResult r = replay_flight(path, {});
      EXPECT_NE(r.damage.find(wanted), std::string::npos) << r.damage;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(wanted), std::string::npos) << error.what();
    }
  };
  refused("the inputs end before the flight", config_);  // nothing but a configuration
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
