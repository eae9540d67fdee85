#include "platform/mission/replay.hpp"

#include <fmt/format.h>

#include "platform/flight/lockstep_flight.hpp"
#include "platform/input/input_error.hpp"
#include "platform/mission/flight_setup.hpp"
#include "platform/mission/recording_format.hpp"

namespace roborun::mission {
namespace {

constexpr std::uint32_t kMostStart = 1U << 16U;
constexpr std::uint32_t kDepthHead = 4 + 8 + 4 + 2 + 2 + 4 * 4;
constexpr std::uint32_t kMostDepth = kDepthHead + 1280 * 1280 * 4;
constexpr std::uint32_t kLidarHead = 4 + 8 + 4 + 2 * 4;
constexpr std::uint32_t kMostLidar = kLidarHead + 256 * 4096 * 12;
struct Size {
  std::uint32_t least, most;
};
constexpr std::array<Size, kRecordKinds> kSizes{{{2, kMostStart},
                                                 {8, 8},
                                                 {60, 60},
                                                 {100, 100},
                                                 {20, 20},
                                                 {18, 18},
                                                 {kDepthHead, kMostDepth},
                                                 {0, 0},
                                                 {24, 24},
                                                 {kLidarHead, kMostLidar},
                                                 {117, 117}}};

}  // namespace

Recording::Recording(const std::string& path) : path_(path), file_(path, "a file of roborun fly --record") {
  read_record();
  if (!error_.empty()) throw InputError(error_);
  try {
    if (kind_ != RecordKind::kStart) throw InputError("it does not begin with a configuration");
    flight_ = recorded_flight_from(payload_);
  } catch (const std::exception& error) {
    throw InputError(fmt::format("{}: no recording of this program: {}", path, error.what()));
  }
  next();
}

void Recording::break_off(const std::string& why) {
  error_ = fmt::format("{}: byte {}: {}", path_, position_, why);
  kind_ = RecordKind::kEnd;
  payload_.clear();
}

void Recording::read_record() noexcept {
  try {
    try_to_read_record();
  } catch (const std::exception& error) {  // the file, or memory
    break_off(error.what());
  }
}

void Recording::try_to_read_record() {
  std::array<std::uint32_t, 2> head{};
  const auto read = [this](void* to, std::size_t bytes) {
    return file_.read({static_cast<char*>(to), bytes}) == bytes;
  };
  if (!read(head.data(), sizeof head)) return break_off("cut off: the recording has no end");
  const auto [kind, bytes] = head;
  if (kind >= kRecordKinds || bytes < kSizes[kind].least || bytes > kSizes[kind].most)
    return break_off("this is no record of a flight");
  kind_ = static_cast<RecordKind>(kind);
  payload_.resize(bytes);
  std::uint64_t sum = 0;
  if (!read(payload_.data(), bytes) || !read(&sum, sizeof sum))
    return break_off("cut off in the middle of a record");
  checksum_ = checksum(checksum_, kind_, payload_);
  if (sum != checksum_) return break_off("damaged: the checksum differs");
  char more = 0;
  if (kind_ == RecordKind::kEnd && read(&more, 1)) {
    position_ += sizeof head + bytes + sizeof sum;
    return break_off("something follows the end of the recording");
  }
  position_ += sizeof head + bytes + sizeof sum;
}

void Recording::next() noexcept {
  if (kind_ != RecordKind::kEnd) read_record();
}

FlightTotals Recording::totals() const noexcept {
  FlightTotals totals;
  each_field(Get(payload_), totals);
  return totals;
}

namespace {

template <typename Device, typename Sample>
class ReplayedSensor final : public Device {
 public:
  explicit ReplayedSensor(Recording& recording) : recording_(recording) {}
  [[nodiscard]] Status read(Sample& sample) noexcept override {
    if (recording_.kind() != kind_of(&sample)) return Status::kNotReady;
    each_field(Get(recording_.payload()), sample);
    recording_.next();
    return Status::kOk;
  }

 private:
  Recording& recording_;
};

class ReplayedCamera final : public firmware_if::DepthCamera {
 public:
  ReplayedCamera(Recording& recording, std::uint32_t index)
      : recording_(recording), index_(index), mount_(recording.flight().mounts[index]) {}
  [[nodiscard]] Status read(firmware_if::DepthFrame& frame) noexcept override {
    if (recording_.kind() != RecordKind::kDepth) return Status::kNotReady;
    Get get(recording_.payload());
    std::uint32_t index = 0;
    get(index);
    if (index != index_) return Status::kNotReady;
    each_field(get, frame);
    // A size that does not fit the pixels is for the stages to refuse, as from any driver.
    depth_m_.resize(get.rest().size() / sizeof(float));
    std::memcpy(depth_m_.data(), get.rest().data(), depth_m_.size() * sizeof(float));
    frame.depth_m = depth_m_;
    recording_.next();
    return Status::kOk;
  }
  [[nodiscard]] const firmware_if::CameraMount& mount() const noexcept override { return mount_; }

 private:
  Recording& recording_;
  std::uint32_t index_;
  firmware_if::CameraMount mount_;
  std::vector<float> depth_m_;
};

class ReplayedLidar final : public firmware_if::Lidar {
 public:
  ReplayedLidar(Recording& recording, std::uint32_t index)
      : recording_(recording), index_(index), mount_(recording.flight().lidar_mounts[index]) {}
  [[nodiscard]] Status read(firmware_if::LidarSweep& sweep) noexcept override {
    if (recording_.kind() != RecordKind::kLidar) return Status::kNotReady;
    Get get(recording_.payload());
    std::uint32_t index = 0;
    get(index);
    if (index != index_) return Status::kNotReady;
    each_field(get, sweep);
    point_L_m_.resize(get.rest().size() / sizeof(point_L_m_[0]));
    std::memcpy(point_L_m_.data(), get.rest().data(), point_L_m_.size() * sizeof(point_L_m_[0]));
    sweep.points_L_m = point_L_m_;
    recording_.next();
    return Status::kOk;
  }
  [[nodiscard]] const firmware_if::CameraMount& mount() const noexcept override { return mount_; }

 private:
  Recording& recording_;
  std::uint32_t index_;
  firmware_if::CameraMount mount_;
  std::vector<std::array<float, 3>> point_L_m_;
};

class ReplayedAircraft final : public flight::Aircraft, private firmware_if::Motors {
 public:
  ReplayedAircraft(Recording& recording, FlightDigest& digest)
      : recording_(recording), digest_(digest), imu_(recording), gnss_(recording), barometer_(recording), odometry_(recording) {}
  void begin_frame(MonotonicTime now) noexcept override {
    MonotonicTime recorded;
    each_field(Get(recording_.payload()), recorded);
    same_inputs = recorded == now;
    recording_.next();
  }
  [[nodiscard]] firmware_if::Imu& imu() noexcept override { return imu_; }
  [[nodiscard]] firmware_if::Gnss& gnss() noexcept override { return gnss_; }
  [[nodiscard]] firmware_if::Barometer& barometer() noexcept override { return barometer_; }
  /// Where none was read, there is none to read.
  [[nodiscard]] firmware_if::Odometry* odometry() noexcept override { return &odometry_; }
  [[nodiscard]] firmware_if::Motors& motors() noexcept override { return *this; }
  [[nodiscard]] flight::AircraftHealth health(MonotonicTime) noexcept override {
    flight::AircraftHealth health;
    if (recording_.kind() == RecordKind::kHealth) {
      each_field(Get(recording_.payload()), health);
      recording_.next();
    } else {
      same_inputs = false;
    }
    return health;
  }
  void terminate() noexcept override { digest_.add_motors_off(); }
  void disarm() noexcept override { digest_.add_motors_off(); }
  void end_frame(MonotonicTime) noexcept override {}
  bool same_inputs{true};  ///< As far as this minor frame got.

 private:
  [[nodiscard]] Status command(const firmware_if::MotorCommand& command) noexcept override {
    digest_.add(command);
    return Status::kOk;
  }
  Recording& recording_;
  FlightDigest& digest_;
  ReplayedSensor<firmware_if::Imu, firmware_if::ImuSample> imu_;
  ReplayedSensor<firmware_if::Gnss, firmware_if::GnssFix> gnss_;
  ReplayedSensor<firmware_if::Barometer, firmware_if::BarometerSample> barometer_;
  ReplayedSensor<firmware_if::Odometry, firmware_if::OdometrySample> odometry_;
};

}  // namespace

ReplayResult replay_flight(const std::string& path, const std::function<void(double)>& progress) {
  Recording recording(path);
  FlightDigest digest;
  ReplayedAircraft aircraft(recording, digest);
  const RecordedFlight& recorded = recording.flight();
  std::vector<ReplayedCamera> camera;
  camera.reserve(recorded.mounts.size());
  for (std::uint32_t i = 0; i < recorded.mounts.size(); ++i) camera.emplace_back(recording, i);
  std::vector<firmware_if::DepthCamera*> cameras;
  cameras.reserve(camera.size());
  for (ReplayedCamera& c : camera) cameras.push_back(&c);
  std::vector<ReplayedLidar> lidar;
  lidar.reserve(recorded.lidar_mounts.size());
  for (std::uint32_t i = 0; i < recorded.lidar_mounts.size(); ++i) lidar.emplace_back(recording, i);
  std::vector<firmware_if::Lidar*> lidars;
  lidars.reserve(lidar.size());
  for (ReplayedLidar& l : lidar) lidars.push_back(&l);
  FlightSetup setup(
      recorded.flight, recorded.backends,
      board::image_limits(recorded.sensors, recorded.flight.vehicle, lattice_of(recorded.flight)));
  const auto flight = std::make_unique<flight::LockstepFlight>(recorded.flight, aircraft, cameras,
                                                               setup.parts(), setup.arena(), lidars);
  setup.check();
  ReplayResult result;
  double told_s = 0.0;
  while (recording.kind() == RecordKind::kFrame) {
    ++result.replayed.minor_frames;
    if (const flight::DecisionOutput* decision = flight->step(
            {.slower = recorded.slow_down.slower(flight->now() + recorded.flight.minor_frame)})) {
      ++result.replayed.decisions;
      digest.add(*decision);
    }
    if (recording.kind() == RecordKind::kGiveUp) {
      flight->system().decision_program().give_up();
      recording.next();
    }
    if (!recording.error().empty()) throw InputError(recording.error());
    const bool all_read = recording.kind() == RecordKind::kFrame || recording.kind() == RecordKind::kEnd;
    if (!all_read || !aircraft.same_inputs) {
      result.diverged_in = result.replayed.minor_frames;
      break;
    }
    result.seconds = seconds(flight->now().time_since_epoch());
    if (progress && result.seconds >= told_s + 1.0) progress(told_s = result.seconds);
  }
  if (result.diverged_in != 0) return result;
  if (!recording.error().empty()) throw InputError(recording.error());
  result.recorded = recording.totals();
  result.replayed.digest = digest.value(flight->system().map());
  return result;
}

}  // namespace roborun::mission
