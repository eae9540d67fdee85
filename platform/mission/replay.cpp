#include "platform/mission/replay.hpp"

#include <fmt/format.h>

#include <memory>
#include <vector>

#include "platform/flight/lockstep_flight.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/json_reader.hpp"
#include "platform/log/crc32.hpp"
#include "platform/log/flight_log.hpp"
#include "platform/mission/decision_values.hpp"
#include "platform/mission/flight_memory.hpp"
#include "platform/mission/flight_records.hpp"
#include "platform/mission/flight_setup.hpp"

namespace roborun::mission {

Recording::Recording(const std::string& path) : path_(path), reader_(path) {
  bool found = false;
  for (log::Message message; !found && reader_.next(message);) found = read_configuration(message);
  if (!found)
    throw InputError(reader_.damage().empty()
                         ? fmt::format("{}: no log of a flight: it holds no configuration", path)
                         : reader_.damage());
  next();
}

bool Recording::read_configuration(const log::Message& message) {
  if (message.channel->topic != "/configuration") return false;
  std::string why;
  try {
    configuration_ = message.data;
    const nlohmann::ordered_json json = input::parse_json(message.data);
    why = json.at("replay").get<std::string>();
    if (why.empty()) flight_ = recorded_flight_from(json.at("flight").dump());
  } catch (const std::exception& error) {
    throw InputError(fmt::format("{}: no log of a flight of this program: {}", path_, error.what()));
  }
  if (!why.empty()) throw InputError(fmt::format("{}: holds no inputs to replay: {}", path_, why));
  return true;
}

void Recording::break_off(const std::string& why) {
  damage_ = why;
  kind_ = RecordKind::kEnd;
  payload_ = {};
}

void Recording::read_message() {
  for (log::Message message; reader_.next(message);) {
    if (message.channel->message_encoding != log::FlightLog::kInputsEncoding) continue;
    if (message.sequence != sequence_++)
      return break_off(fmt::format("{}: inputs are missing before {:.3f} s: they were not written", path_,
                                   1e-9 * static_cast<double>(message.log_ns)));
    try {
      inputs_ = records_from(message.data);
    } catch (const InputError& error) {
      return break_off(fmt::format("{}: at {:.3f} s: {}", path_, 1e-9 * static_cast<double>(message.log_ns),
                                   error.what()));
    }
    at_ = 0;
    chunk_at_ = reader_.chunk_at();
    crc_ = log::crc32(message.data);
    if (!inputs_.records.empty()) return;
  }
  break_off(reader_.damage().empty() ? fmt::format("{}: the inputs end before the flight", path_)
                                     : reader_.damage());
}

InputsPosition Recording::position() const noexcept {
  return {chunk_at_, sequence_ - 1, crc_, static_cast<std::uint32_t>(at_ - 1)};
}

bool Recording::skip_to(const InputsPosition& position) {
  try {
    reader_.skip_to(position.chunk_at);
  } catch (const InputError&) {
    return false;
  }
  for (log::Message message; reader_.next(message);) {
    if (message.channel->message_encoding != log::FlightLog::kInputsEncoding ||
        message.sequence < position.sequence)
      continue;
    if (message.sequence != position.sequence || log::crc32(message.data) != position.crc) return false;
    inputs_ = records_from(message.data);
    if (position.record >= inputs_.records.size()) return false;
    sequence_ = position.sequence + 1;
    chunk_at_ = position.chunk_at;
    crc_ = position.crc;
    at_ = position.record;
    next();
    return true;
  }
  return false;
}

void Recording::end() {
  GetField get(payload_);
  each_field(get, totals_);
  if (at_ < inputs_.records.size())
    return break_off(fmt::format("{}: inputs behind the end of the flight", path_));
  for (log::Message message; reader_.next(message);) {
  }
  damage_ = reader_.damage();
}

void Recording::next() {
  if (kind_ == RecordKind::kEnd) return;
  if (at_ == inputs_.records.size()) read_message();
  if (kind_ == RecordKind::kEnd) return;
  const InputRecord& record = inputs_.records[at_++];
  kind_ = record.kind;
  payload_ = std::string_view(inputs_.payloads).substr(record.at, record.bytes);
  if (kind_ == RecordKind::kEnd) end();
}

namespace {

/// The first difference of a replay, if there is one by now.
class Comparison {
 public:
  explicit Comparison(Recording& recording) : recording_(recording) {}
  void differ(std::string stage, std::string what, std::string recorded, std::string replayed) {
    if (!first_)
      first_ = {0, 0.0, std::move(stage), std::move(what), std::move(recorded), std::move(replayed)};
  }
  /// The flight did this now: was it recorded, too? Then its payload is read next.
  [[nodiscard]] bool expects(RecordKind kind, const char* stage, const char* what) {
    if (recording_.kind() == kind) return true;
    differ(stage, what, "none", "one");
    return false;
  }
  void motors(const firmware_if::MotorCommand& command) {
    if (first_ || !expects(RecordKind::kMotors, "track", "motor command")) return;
    MotorsCheck recorded;
    each_field(GetField(recording_.payload()), recorded);
    const MotorsCheck replayed = check_of(command);
    for (std::size_t i = 0; i < recorded.ratio.size() && !first_; ++i)
      if (recorded.ratio[i] != replayed.ratio[i])
        differ("track", fmt::format("motor {}", i + 1),
               fmt::format("{:.3f}", recorded.ratio[i] / MotorsCheck::kMost),
               fmt::format("{:.3f}", replayed.ratio[i] / MotorsCheck::kMost));
    if (!first_ && recorded.crc != replayed.crc)
      differ("track", "motor command", fmt::format("CRC-32 {:08x}", recorded.crc),
             fmt::format("CRC-32 {:08x}, the same to two digits", replayed.crc));
    recording_.next();
  }
  void motors_off() {
    if (!first_ && expects(RecordKind::kMotorsOff, "track", "motors off")) recording_.next();
  }
  void decision(const flight::DecisionOutput& decision) {
    if (first_ || !expects(RecordKind::kDecision, "gather", "decision")) return;
    GetField get(recording_.payload());
    const DecisionValues replayed = values_of(decision);
    for (std::size_t i = 0; i < replayed.size(); ++i) {
      std::uint64_t recorded = 0;
      get(recorded);
      if (recorded != replayed[i])
        differ(name_of_value(i).stage, name_of_value(i).name, text_of_value(i, recorded),
               text_of_value(i, replayed[i]));
    }
    recording_.next();
  }
  /// At the end of a minor frame: what was recorded of it is used up.
  void frame_done() {
    const RecordKind kind = recording_.kind();
    if (kind == RecordKind::kFrame || kind == RecordKind::kGoals || kind == RecordKind::kEnd) return;
    const bool decision = kind == RecordKind::kDecision;
    const bool motors = kind == RecordKind::kMotors || kind == RecordKind::kMotorsOff;
    differ(decision ? "gather"
           : motors ? "track"
                    : "inputs",
           decision ? "decision"
           : motors ? "motor command"
                    : "a record",
           decision || motors ? "one" : "read", decision || motors ? "none" : "not read");
  }
  [[nodiscard]] std::optional<ReplayDifference>& first() noexcept { return first_; }

 private:
  Recording& recording_;
  std::optional<ReplayDifference> first_;
};

template <typename Device, typename Sample>
class ReplayedSensor final : public Device {
 public:
  explicit ReplayedSensor(Recording& recording) : recording_(recording) {}
  [[nodiscard]] Status read(Sample& sample) noexcept override {
    if (recording_.kind() != kind_of(&sample)) return Status::kNotReady;
    each_field(GetField(recording_.payload()), sample);
    recording_.next();
    return Status::kOk;
  }

 private:
  Recording& recording_;
};

/// As many as there are, in `memory`, which grows for those of a frame larger than its device makes alone.
template <typename Pixel>
std::span<const Pixel> pixels_of(std::string_view bytes, std::vector<Pixel>& memory) {
  const std::size_t count = bytes.size() / sizeof(Pixel);
  if (count > memory.size()) memory.resize(count);
  std::memcpy(memory.data(), bytes.data(), count * sizeof(Pixel));
  return std::span(memory).first(count);
}

class ReplayedCamera final : public firmware_if::DepthCamera {
 public:
  ReplayedCamera(Recording& recording, std::uint32_t index)
      : recording_(recording), index_(index), mount_(recording.flight().mounts[index]) {
    const CameraSpec& camera = recording.flight().sensors.cameras[index];
    depth_m_.resize(std::size_t{camera.width} * camera.height);
  }
  [[nodiscard]] Status read(firmware_if::DepthFrame& frame) noexcept override {
    if (recording_.kind() != RecordKind::kDepth) return Status::kNotReady;
    GetField get(recording_.payload());
    std::uint32_t index = 0;
    get(index);
    if (index != index_) return Status::kNotReady;
    each_field(get, frame);
    // A size that does not fit the pixels is for the stages to refuse, as from any driver.
    frame.depth_m = pixels_of(get.rest(), depth_m_);
    recording_.next();
    return Status::kOk;
  }
  [[nodiscard]] const firmware_if::CameraMount& mount() const noexcept override { return mount_; }
  /// What the flight may still point at.
  [[nodiscard]] std::span<const std::byte> memory() const noexcept {
    return std::as_bytes(std::span(depth_m_));
  }

 private:
  Recording& recording_;
  std::uint32_t index_;
  firmware_if::CameraMount mount_;
  std::vector<float> depth_m_;
};

class ReplayedLidar final : public firmware_if::Lidar {
 public:
  ReplayedLidar(Recording& recording, std::uint32_t index)
      : recording_(recording), index_(index), mount_(recording.flight().lidar_mounts[index]) {
    const LidarSpec& lidar = recording.flight().sensors.lidars[index];
    point_L_m_.resize(std::size_t{lidar.rings} * lidar.columns);
  }
  [[nodiscard]] Status read(firmware_if::LidarSweep& sweep) noexcept override {
    if (recording_.kind() != RecordKind::kLidar) return Status::kNotReady;
    GetField get(recording_.payload());
    std::uint32_t index = 0;
    get(index);
    if (index != index_) return Status::kNotReady;
    each_field(get, sweep);
    sweep.points_L_m = pixels_of(get.rest(), point_L_m_);
    recording_.next();
    return Status::kOk;
  }
  [[nodiscard]] const firmware_if::CameraMount& mount() const noexcept override { return mount_; }
  [[nodiscard]] std::span<const std::byte> memory() const noexcept {
    return std::as_bytes(std::span(point_L_m_));
  }

 private:
  Recording& recording_;
  std::uint32_t index_;
  firmware_if::CameraMount mount_;
  std::vector<std::array<float, 3>> point_L_m_;
};

class ReplayedAircraft final : public flight::Aircraft, private firmware_if::Motors {
 public:
  ReplayedAircraft(Recording& recording, FlightDigest& digest, Comparison& comparison)
      : recording_(recording),
        digest_(digest),
        comparison_(comparison),
        imu_(recording),
        gnss_(recording),
        barometer_(recording),
        odometry_(recording) {}
  void begin_frame(MonotonicTime now) noexcept override {
    MonotonicTime recorded;
    each_field(GetField(recording_.payload()), recorded);
    if (recorded != now)
      comparison_.differ("inputs", "instant of the minor frame", text_of(recorded), text_of(now));
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
      each_field(GetField(recording_.payload()), health);
      recording_.next();
    } else {
      comparison_.differ("inputs", "health", "not asked for", "asked for");
    }
    return health;
  }
  void terminate() noexcept override { off(); }
  void disarm() noexcept override { off(); }
  void end_frame(MonotonicTime) noexcept override {}

 private:
  [[nodiscard]] static std::string text_of(MonotonicTime time) {
    return fmt::format("{:.6f} s", seconds(time.time_since_epoch()));
  }
  [[nodiscard]] Status command(const firmware_if::MotorCommand& command) noexcept override {
    digest_.add(command);
    comparison_.motors(command);
    return Status::kOk;
  }
  void off() {
    digest_.add_motors_off();
    comparison_.motors_off();
  }
  Recording& recording_;
  FlightDigest& digest_;
  Comparison& comparison_;
  ReplayedSensor<firmware_if::Imu, firmware_if::ImuSample> imu_;
  ReplayedSensor<firmware_if::Gnss, firmware_if::GnssFix> gnss_;
  ReplayedSensor<firmware_if::Barometer, firmware_if::BarometerSample> barometer_;
  ReplayedSensor<firmware_if::Odometry, firmware_if::OdometrySample> odometry_;
};

/// The recorded devices of a kind, and pointers to them.
template <typename Replayed, typename Device>
struct Devices {
  Devices(Recording& recording, std::size_t count) {
    device.reserve(count);
    for (std::uint32_t i = 0; i < count; ++i) device.emplace_back(recording, i);
    for (Replayed& one : device) pointers.push_back(&one);
  }
  std::vector<Replayed> device;
  std::vector<Device*> pointers;
};

class Replay {
 public:
  Replay(const std::string& path, const ReplayStart& start);
  /// To the latest keyframe before what was asked for, if there is one. False: it is of another log, and nothing may follow.
  [[nodiscard]] bool begin(double until_s);
  ReplayResult run(const std::function<void(double)>& progress, double until_s,
                   const std::function<void(const log::DecisionEntry&)>& decided);

 private:
  void give_goals();
  void keep_keyframe();
  void step(const std::function<void(const log::DecisionEntry&)>& decided);

  Recording recording_;
  FlightDigest digest_;
  Comparison comparison_;
  ReplayedAircraft aircraft_;
  Devices<ReplayedCamera, firmware_if::DepthCamera> cameras_;
  Devices<ReplayedLidar, firmware_if::Lidar> lidars_;
  bool changed_{false};  ///< The governor's settings.
  FlightSetup setup_;
  flight::LockstepFlight flight_;
  ReplayResult result_;
  FlightMemory memory_;
  ReplayStart start_;
  Keyframes keyframes_;
  std::uint64_t next_keyframe_{std::numeric_limits<std::uint64_t>::max()};  ///< Minor frames before it.
};

Replay::Replay(const std::string& path, const ReplayStart& start)
    : recording_(path),
      comparison_(recording_),
      aircraft_(recording_, digest_, comparison_),
      cameras_(recording_, recording_.flight().mounts.size()),
      lidars_(recording_, recording_.flight().lidar_mounts.size()),
      setup_(recording_.flight().flight, recording_.flight().backends,
             board::image_limits(recording_.flight().sensors, recording_.flight().flight.vehicle,
                                 lattice_of(recording_.flight().flight)),
             parts_of({}, recording_.flight().change, changed_), Pages::kHuge),
      flight_(recording_.flight().flight, aircraft_, cameras_.pointers, setup_.parts(), setup_.arena(),
              lidars_.pointers),
      start_(start),
      keyframes_(setup_.add_to(memory_) ? start.keyframes : std::string(), recording_.configuration()) {
  setup_.check();
  memory_.add_object(flight_);
  memory_.add_object(digest_);
  memory_.add_object(result_.replayed);
  for (const ReplayedCamera& camera : cameras_.device) memory_.add_data(camera.memory());
  for (const ReplayedLidar& lidar : lidars_.device) memory_.add_data(lidar.memory());
}

bool Replay::begin(double until_s) {
  if (!keyframes_.are_kept()) return true;
  const Nanos minor_frame = recording_.flight().flight.minor_frame;
  const std::optional<Keyframe> keyframe =
      keyframes_.before(static_cast<std::uint64_t>(start_.from_s / seconds(minor_frame)));
  next_keyframe_ = (keyframe ? keyframe->frames : 0) + static_cast<std::uint64_t>(start_.every / minor_frame);
  // Before the keyframe: changes are those since the flight was made.
  if (seconds(next_keyframe_ * minor_frame) < until_s) memory_.begin();
  if (!keyframe) return true;
  if (!recording_.skip_to(keyframe->position)) return false;
  try {
    memory_.apply(keyframe->changes);
  } catch (const InputError&) {
    return false;
  }
  result_.keyframe_s = seconds(flight_.now().time_since_epoch());
  return recording_.kind() == RecordKind::kFrame && result_.replayed.minor_frames == keyframe->frames;
}

void Replay::keep_keyframe() {
  if (!keyframes_.has(next_keyframe_))
    keyframes_.keep({result_.replayed.minor_frames, recording_.position(), memory_.changes()});
  next_keyframe_ += static_cast<std::uint64_t>(start_.every / recording_.flight().flight.minor_frame);
}

void Replay::give_goals() {
  GetField get(recording_.payload());
  std::vector<Vector3> goals_W;
  while (get.rest().size() >= kGoal_bytes && goals_W.size() < flight::GoalQueue::kMost) {
    Vector3& p_W = goals_W.emplace_back();
    for (int i = 0; i < 3; ++i) get(p_W[i]);
  }
  (void)flight_.system().decision_program().give_goals(goals_W);
  recording_.next();
}

void Replay::step(const std::function<void(const log::DecisionEntry&)>& decided) {
  const RecordedFlight& recorded = recording_.flight();
  ++result_.replayed.minor_frames;
  const MonotonicTime now = flight_.now() + recorded.flight.minor_frame;
  changed_ = recorded.change.is_due(now);
  if (const flight::DecisionOutput* decision = flight_.step({.slower = recorded.slow_down.slower(now)})) {
    ++result_.replayed.decisions;
    digest_.add(*decision);
    comparison_.decision(*decision);
    if (decided && !comparison_.first()) {
      log::DecisionEntry entry = decision_entry(flight_.system(), *decision, lattice_of(recorded.flight),
                                                result_.replayed.decisions, now, {});
      stages::EstimatedState state;
      if (flight_.system().control().estimator().state(state) == Status::kOk) {
        entry.p_WB = log::numbers_of(state.p_WB);
        entry.speed_mps = state.v_WB.norm();
      }
      decided(entry);
    }
  }
  if (recording_.kind() == RecordKind::kNearBrake) {
    flight_.system().flight_program().brake_for_near();
    recording_.next();
  }
  if (recording_.kind() == RecordKind::kGiveUp) {
    flight_.system().decision_program().give_up();
    recording_.next();
  }
  comparison_.frame_done();
  result_.seconds = seconds(flight_.now().time_since_epoch());
}

ReplayResult Replay::run(const std::function<void(double)>& progress, double until_s,
                         const std::function<void(const log::DecisionEntry&)>& decided) {
  double told_s = 0.0;
  // Goals come before the frame from which on they are there.
  while (recording_.kind() == RecordKind::kFrame || recording_.kind() == RecordKind::kGoals) {
    if (recording_.kind() == RecordKind::kGoals) {
      give_goals();
      continue;
    }
    if (seconds((flight_.now() + recording_.flight().flight.minor_frame).time_since_epoch()) > until_s) break;
    if (result_.replayed.minor_frames == next_keyframe_) keep_keyframe();
    step(decided);
    if (comparison_.first()) break;
    if (progress && result_.seconds >= told_s + 1.0) progress(told_s = result_.seconds);
  }
  result_.difference = std::move(comparison_.first());
  if (result_.difference) {
    result_.difference->minor_frame = result_.replayed.minor_frames;
    result_.difference->time_s = result_.seconds;
  }
  result_.damage = recording_.damage();
  const bool compares_all =
      recording_.kind() == RecordKind::kEnd && recording_.is_whole() && !result_.difference;
  if (compares_all) result_.replayed.digest = digest_.value(flight_.system().map());
  result_.recorded = compares_all ? recording_.totals() : result_.replayed;
  return std::move(result_);
}

}  // namespace

ReplayResult replay_flight(const std::string& path, const std::function<void(double)>& progress,
                           double until_s, const std::function<void(const log::DecisionEntry&)>& decided,
                           const ReplayStart& start) {
  std::uint64_t told = 0;
  const auto tell_once = [&](const log::DecisionEntry& entry) {
    if (entry.number <= told) return;
    told = entry.number;
    decided(entry);
  };
  const std::function<void(const log::DecisionEntry&)> tell =
      decided ? tell_once : std::function<void(const log::DecisionEntry&)>();
  if (!start.keyframes.empty()) {
    const auto replay = std::make_unique<Replay>(path, start);
    if (replay->begin(until_s)) {
      ReplayResult result = replay->run(progress, until_s, tell);
      if (result.same() || result.keyframe_s == 0.0) return result;
    }
  }
  // No keyframe is believed against the log: what differs behind one is replayed from the beginning.
  return std::make_unique<Replay>(path, ReplayStart{})->run(progress, until_s, tell);
}

}  // namespace roborun::mission
