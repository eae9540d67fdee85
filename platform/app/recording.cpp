#include "platform/app/recording.hpp"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "platform/app/arguments.hpp"
#include "platform/app/lockstep_flight.hpp"
#include "platform/sitl/world/input_error.hpp"

namespace roborun::app {
namespace {

using sitl::InputError;
using Json = nlohmann::ordered_json;

constexpr std::uint32_t kVersion = 1;
constexpr std::uint32_t kMostStart = 1U << 16U;
constexpr std::uint32_t kDepthHead = 4 + 8 + 4 + 2 + 2 + 4 + 4;
constexpr std::uint32_t kMostDepth = kDepthHead + 512 * 512 * 4;
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
                                                 {24, 24}}};

std::uint64_t checksum(std::uint64_t before, RecordKind kind, std::span<const std::byte> payload) noexcept {
  core::StateHash hash;
  hash.add(before);
  hash.add((std::uint64_t{static_cast<std::uint32_t>(kind)} << 32U) | payload.size());
  for (std::size_t at = 0; at < payload.size(); at += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, payload.data() + at, std::min<std::size_t>(8, payload.size() - at));
    hash.add(word);
  }
  return hash.value();
}

/// One order of the fields for writing and reading: `f` is called with each.
template <typename F>
void each_field(F&& f, MonotonicTime& time) {
  std::int64_t ns = time.time_since_epoch().count();
  f(ns);
  time = MonotonicTime{Nanos{ns}};
}
template <typename F>
void each_field(F&& f, firmware_if::ImuSample& s) {
  each_field(f, s.stamp);
  f(s.sequence);
  for (double& x : s.angular_rate_B_radps) f(x);
  for (double& x : s.specific_force_B_mps2) f(x);
}
template <typename F>
void each_field(F&& f, firmware_if::GnssFix& s) {
  each_field(f, s.stamp);
  f(s.sequence);
  for (double& x : s.p_WB_m) f(x);
  for (double& x : s.v_WB_mps) f(x);
  for (double* x :
       {&s.heading_rad, &s.sigma_horizontal_m, &s.sigma_vertical_m, &s.sigma_speed_mps, &s.sigma_heading_rad})
    f(*x);
}
template <typename F>
void each_field(F&& f, firmware_if::BarometerSample& s) {
  each_field(f, s.stamp);
  f(s.sequence);
  f(s.altitude_m);
}
template <typename F>
void each_field(F&& f, AircraftHealth& s) {
  std::int64_t silence_ns = s.esc_silence.count();
  std::uint8_t hears_operator = s.hears_operator ? 1 : 0;
  std::uint8_t killed = s.killed ? 1 : 0;
  f(s.battery_ratio);
  f(silence_ns);
  f(hears_operator);
  f(killed);
  s = {s.battery_ratio, Nanos{silence_ns}, hears_operator != 0, killed != 0};
}
template <typename F>
void each_field(F&& f, firmware_if::DepthFrame& s) {
  each_field(f, s.stamp);
  f(s.sequence);
  f(s.width);
  f(s.height);
  f(s.tan_half_fov_ratio);
  f(s.range_m);
}
template <typename F>
void each_field(F&& f, FlightTotals& t) {
  for (std::uint64_t* x : {&t.digest, &t.minor_frames, &t.decisions}) f(*x);
}

class Put {
 public:
  explicit Put(std::vector<std::byte>& to) : to_(to) {}
  template <typename T>
  void operator()(const T& value) {
    static_assert(std::is_arithmetic_v<T>);
    const auto* bytes = reinterpret_cast<const std::byte*>(&value);
    to_.insert(to_.end(), bytes, bytes + sizeof value);
  }

 private:
  std::vector<std::byte>& to_;
};

/// The sizes of records are checked when they are read: there is always enough to get.
class Get {
 public:
  explicit Get(std::span<const std::byte> from) : from_(from) {}
  template <typename T>
  void operator()(T& value) {
    static_assert(std::is_arithmetic_v<T>);
    std::memcpy(&value, from_.data(), sizeof value);
    from_ = from_.subspan(sizeof value);
  }
  [[nodiscard]] std::span<const std::byte> rest() const { return from_; }

 private:
  std::span<const std::byte> from_;
};

constexpr RecordKind kind_of(const firmware_if::ImuSample*) { return RecordKind::kImu; }
constexpr RecordKind kind_of(const firmware_if::GnssFix*) { return RecordKind::kGnss; }
constexpr RecordKind kind_of(const firmware_if::BarometerSample*) { return RecordKind::kBarometer; }

Json vector_json(const Vector3& v) { return {v.x(), v.y(), v.z()}; }

Json fence_json(const core::Fence& fence) {
  Json j = {{"areas", Json::array()}};
  if (fence.limits_altitude()) j["altitude_m"] = {fence.lowest_m(), fence.highest_m()};
  for (const core::Fence::Area& area : fence.areas()) {
    Json points = Json::array();
    for (std::size_t i = 0; i < area.count; ++i) points.push_back({area.point[i].x_m, area.point[i].y_m});
    j["areas"].push_back({{"keep_in", area.side == core::FenceSide::kKeepIn},
                          {"radius_m", area.radius_m},
                          {"points", std::move(points)}});
  }
  return j;
}

std::string start_json(const sitl::World& world, const MissionConfig& config) {
  Json j;
  j["roborun_recording"] = kVersion;
  j["min_W"] = vector_json(world.bounds_W().min_W);
  j["max_W"] = vector_json(world.bounds_W().max_W);
  j["start_W"] = vector_json(world.start_W());
  j["goal_W"] = vector_json(world.goal_W());
  j["design"] = governor::to_string(config.design);
  j["seed"] = config.seed;
  j["map"] = config.map_backend;
  j["planner"] = config.planner_backend;
  j["v_max_mps"] = config.v_max_mps;
  j["minor_frame_ns"] = config.minor_frame.count();
  j["pixels"] = config.camera.pixels;
  j["range_m"] = config.camera.range_m;
  j["slow_down_at_s"] = config.slow_down_at_s;
  j["slow_down_factor"] = config.slow_down_factor;
  j["answers"] = config.answers;
  j["fence"] = fence_json(config.fence);
  for (const core::StageCost& c : config.costs.stage)
    j["costs"].push_back({{"fixed_s", c.fixed_s}, {"per_unit_s", c.per_unit_s}, {"per_m3_s", c.per_m3_s}});
  for (const governor::LatencyModel& m : config.model)
    j["models"].push_back({{"fixed_s", m.fixed_s}, {"slope_s_per_m3", m.slope_s_per_m3}});
  return j.dump();
}

/// Throws InputError or Json::exception.
double number(const Json& json, const char* key, double least, double most) {
  const double value = json.at(key).get<double>();
  if (!(value >= least && value <= most))
    throw InputError(fmt::format("{}: {} is not within {} and {}", key, value, least, most));
  return value;
}
Vector3 vector(const Json& json, const char* key) {
  const auto v = json.at(key).get<std::array<double, 3>>();
  return {v[0], v[1], v[2]};
}
template <std::size_t N>
void numbers(const Json& json, const char* key, std::array<double, N>& to) {
  to = json.at(key).get<std::array<double, N>>();
  for (const double x : to) {
    if (!(x >= 0.0 && x <= 1e6)) throw InputError(fmt::format("{}: {} is not within 0 and 1e6", key, x));
  }
}

core::Fence read_fence(const Json& json) {
  core::Fence fence;
  const auto check = [](core::FenceFault fault) {
    if (fault != core::FenceFault::kNone) throw InputError(fmt::format("fence: {}", core::to_string(fault)));
  };
  if (json.contains("altitude_m")) {
    const auto v = json.at("altitude_m").get<std::array<double, 2>>();
    check(fence.set_altitude(v[0], v[1]));
  }
  for (const Json& area : json.at("areas")) {
    const core::FenceSide side =
        area.at("keep_in").get<bool>() ? core::FenceSide::kKeepIn : core::FenceSide::kKeepOut;
    std::vector<core::FencePoint> points;
    for (const auto& p : area.at("points").get<std::vector<std::array<double, 2>>>())
      points.push_back({p[0], p[1]});
    const double radius_m = area.at("radius_m").get<double>();
    check(radius_m > 0.0 && points.size() == 1 ? fence.add_circle(side, points.front(), radius_m)
                                               : fence.add_polygon(side, points));
  }
  return fence;
}

std::unique_ptr<sitl::World> read_start(std::span<const std::byte> payload, MissionConfig& config) {
  const Json j = Json::parse(reinterpret_cast<const char*>(payload.data()),
                             reinterpret_cast<const char*>(payload.data()) + payload.size());
  if (j.at("roborun_recording") != kVersion) throw InputError("of another version");
  sitl::WorldDescription world;
  world.bounds_W = {vector(j, "min_W"), vector(j, "max_W")};
  world.start_W = vector(j, "start_W");
  world.goal_W = vector(j, "goal_W");
  config.design = design_of("design", j.at("design").get<std::string>());
  config.seed = j.at("seed").get<std::uint64_t>();
  config.map_backend = j.at("map").get<std::string>();
  config.planner_backend = j.at("planner").get<std::string>();
  config.v_max_mps = number(j, "v_max_mps", 0.1, 30.0);
  config.minor_frame = Nanos{j.at("minor_frame_ns").get<std::int64_t>()};
  const auto rate_Hz = static_cast<int>(1e9 / number(j, "minor_frame_ns", 1e6, 1e9));
  if (!core::is_flight_rate(rate_Hz) || core::minor_frame_of(rate_Hz) != config.minor_frame)
    throw InputError("minor_frame_ns: no rate of the flight lane");
  config.camera.pixels = static_cast<std::uint16_t>(number(j, "pixels", 8, 512));
  config.camera.range_m = number(j, "range_m", 1, 200);
  config.slow_down_at_s = number(j, "slow_down_at_s", 0, 1e300);
  config.slow_down_factor = number(j, "slow_down_factor", 0.001, 1000);
  config.answers = j.at("answers").get<bool>();
  config.fence = read_fence(j.at("fence"));
  for (std::size_t i = 0; i < core::kStageCount; ++i) {
    const Json& c = j.at("costs").at(i);
    numbers(c, "fixed_s", config.costs.stage[i].fixed_s);
    config.costs.stage[i].per_unit_s = number(c, "per_unit_s", 0, 1e6);
    numbers(c, "per_m3_s", config.costs.stage[i].per_m3_s);
  }
  for (std::size_t i = 0; i < config.model.size(); ++i) {
    numbers(j.at("models").at(i), "fixed_s", config.model[i].fixed_s);
    numbers(j.at("models").at(i), "slope_s_per_m3", config.model[i].slope_s_per_m3);
  }
  return std::make_unique<sitl::World>(std::move(world));
}

/// Throws if the flight depends on what does not cross the boundary.
const std::string& recordable(const std::string& path, const MissionConfig& config) {
  for (const TimedFault& f : config.faults) {
    for (const sitl::Component component :
         {sitl::Component::kCpu, sitl::Component::kPlanner, sitl::Component::kMap}) {
      if (f.fault.component == component)
        throw InputError(
            fmt::format("{}: a recording holds inputs alone: must be a flight without faults of cpu, "
                        "planner or map",
                        path));
    }
  }
  return path;
}

}  // namespace

void FlightDigest::add_motors_off() noexcept { hash_.add(std::uint64_t{0x0FF}); }

void FlightDigest::add(const firmware_if::MotorCommand& command) noexcept {
  for (const double ratio : command.thrust_ratio) hash_.add(ratio);
}

void FlightDigest::add(const DecisionOutput& d) noexcept {
  hash_.add(static_cast<std::uint64_t>(d.kind));
  hash_.add(static_cast<std::uint64_t>(d.latency.count()));
  const OperatingPoint& point = d.decision.point;
  hash_.add(static_cast<std::uint64_t>(point.deadline.count()));
  hash_.add(static_cast<std::uint64_t>(point.p0_level));
  hash_.add(static_cast<std::uint64_t>(point.p1_level));
  hash_.add(point.speed_limit_mps);
  if (d.kind == DecisionKind::kKeep) return;
  hash_.add(static_cast<std::uint64_t>(d.trajectory.start_time.time_since_epoch().count()));
  for (std::size_t i = 0; i < d.trajectory.segment_count; ++i) {
    hash_.add(d.trajectory.segment[i].duration_s);
    for (const Vector3& c : d.trajectory.segment[i].coefficient) hash_.add(c);
  }
}

std::uint64_t FlightDigest::value(const stages::OccupancyMap& map) const noexcept {
  core::StateHash hash = hash_;
  hash.add(map.digest());
  return hash.value();
}

template <typename Device, typename Sample>
class FlightRecorder::Tap final : public Device {
 public:
  Tap(FlightRecorder& recorder, Device& device) : recorder_(recorder), device_(device) {}
  [[nodiscard]] Status read(Sample& sample) noexcept override {
    const Status status = device_.read(sample);
    if (status == Status::kOk) {
      each_field(Put(recorder_.payload_), sample);
      recorder_.write(kind_of(&sample));
    }
    return status;
  }

 private:
  FlightRecorder& recorder_;
  Device& device_;
};

class FlightRecorder::TappedCamera final : public firmware_if::DepthCamera {
 public:
  TappedCamera(FlightRecorder& recorder, firmware_if::DepthCamera& camera, std::uint32_t index)
      : recorder_(recorder), camera_(camera), index_(index) {}
  [[nodiscard]] Status read(firmware_if::DepthFrame& frame) noexcept override {
    const Status status = camera_.read(frame);
    if (status != Status::kOk) return status;
    Put put(recorder_.payload_);
    put(index_);
    each_field(put, frame);
    for (const float depth_m : frame.depth_m) put(depth_m);
    recorder_.write(RecordKind::kDepth);
    return status;
  }
  [[nodiscard]] const firmware_if::CameraMount& mount() const noexcept override { return camera_.mount(); }

 private:
  FlightRecorder& recorder_;
  firmware_if::DepthCamera& camera_;
  std::uint32_t index_;
};

class FlightRecorder::TappedMotors final : public firmware_if::Motors {
 public:
  TappedMotors(FlightDigest& digest, firmware_if::Motors& motors) : digest_(digest), motors_(motors) {}
  [[nodiscard]] Status command(const firmware_if::MotorCommand& command) noexcept override {
    digest_.add(command);
    return motors_.command(command);
  }

 private:
  FlightDigest& digest_;
  firmware_if::Motors& motors_;
};

FlightRecorder::FlightRecorder(const std::string& path, const sitl::World& world, const MissionConfig& config,
                               Aircraft& aircraft,
                               const std::array<firmware_if::DepthCamera*, kCameras>& cameras)
    : path_(recordable(path, config)), file_(path, std::ios::binary | std::ios::trunc), aircraft_(aircraft) {
  if (!file_) throw InputError(fmt::format("{}: cannot be written", path));
  imu_ = std::make_unique<Tap<firmware_if::Imu, firmware_if::ImuSample>>(*this, aircraft.imu());
  gnss_ = std::make_unique<Tap<firmware_if::Gnss, firmware_if::GnssFix>>(*this, aircraft.gnss());
  barometer_ = std::make_unique<Tap<firmware_if::Barometer, firmware_if::BarometerSample>>(
      *this, aircraft.barometer());
  motors_ = std::make_unique<TappedMotors>(digest_, aircraft.motors());
  for (std::size_t i = 0; i < kCameras; ++i)
    camera_[i] = std::make_unique<TappedCamera>(*this, *cameras[i], static_cast<std::uint32_t>(i));
  const std::string start = start_json(world, config);
  const auto* bytes = reinterpret_cast<const std::byte*>(start.data());
  payload_.assign(bytes, bytes + start.size());
  write(RecordKind::kStart);
}

firmware_if::Imu& FlightRecorder::imu() noexcept { return *imu_; }
firmware_if::Gnss& FlightRecorder::gnss() noexcept { return *gnss_; }
firmware_if::Barometer& FlightRecorder::barometer() noexcept { return *barometer_; }
firmware_if::Motors& FlightRecorder::motors() noexcept { return *motors_; }

AircraftHealth FlightRecorder::health(MonotonicTime now) noexcept {
  AircraftHealth health = aircraft_.health(now);
  each_field(Put(payload_), health);
  write(RecordKind::kHealth);
  return health;
}

void FlightRecorder::terminate() noexcept {
  digest_.add_motors_off();
  aircraft_.terminate();
}

void FlightRecorder::disarm() noexcept {
  digest_.add_motors_off();
  aircraft_.disarm();
}

std::array<firmware_if::DepthCamera*, kCameras> FlightRecorder::cameras() noexcept {
  std::array<firmware_if::DepthCamera*, kCameras> all{};
  for (std::size_t i = 0; i < kCameras; ++i) all[i] = camera_[i].get();
  return all;
}

void FlightRecorder::begin_frame(MonotonicTime now) noexcept {
  aircraft_.begin_frame(now);
  ++totals_.minor_frames;
  each_field(Put(payload_), now);
  write(RecordKind::kFrame);
}

void FlightRecorder::decided(const DecisionOutput& decision) noexcept {
  ++totals_.decisions;
  digest_.add(decision);
}

void FlightRecorder::write(RecordKind kind) noexcept {
  const std::array<std::uint32_t, 2> head{static_cast<std::uint32_t>(kind),
                                          static_cast<std::uint32_t>(payload_.size())};
  checksum_ = checksum(checksum_, kind, payload_);
  file_.write(reinterpret_cast<const char*>(head.data()), sizeof head);
  file_.write(reinterpret_cast<const char*>(payload_.data()), static_cast<std::streamsize>(payload_.size()));
  file_.write(reinterpret_cast<const char*>(&checksum_), sizeof checksum_);
  payload_.clear();
}

void FlightRecorder::finish(const stages::OccupancyMap& map) {
  totals_.digest = digest_.value(map);
  each_field(Put(payload_), totals_);
  write(RecordKind::kEnd);
  file_.close();
  if (!file_) throw InputError(fmt::format("{}: cannot be written: is the disk full?", path_));
}

Recording::Recording(const std::string& path) : path_(path), file_(path, std::ios::binary) {
  if (!file_)
    throw InputError(fmt::format("{}: cannot be opened: must be a file of roborun fly --record", path));
  read_record();
  if (!error_.empty()) throw InputError(error_);
  try {
    if (kind_ != RecordKind::kStart) throw InputError("it does not begin with a configuration");
    world_ = read_start(payload_, config_);
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

void Recording::read_record() {
  std::array<std::uint32_t, 2> head{};
  const auto read = [this](void* to, std::size_t bytes) {
    file_.read(static_cast<char*>(to), static_cast<std::streamsize>(bytes));
    return static_cast<std::size_t>(file_.gcount()) == bytes;
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
  if (kind_ == RecordKind::kEnd && file_.peek() != std::ifstream::traits_type::eof()) {
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
      : recording_(recording), index_(index), mount_(sitl::six_camera_mounts()[index]) {}
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

class ReplayedAircraft final : public Aircraft, private firmware_if::Motors {
 public:
  ReplayedAircraft(Recording& recording, FlightDigest& digest)
      : recording_(recording), digest_(digest), imu_(recording), gnss_(recording), barometer_(recording) {}
  void begin_frame(MonotonicTime now) noexcept override {
    MonotonicTime recorded;
    each_field(Get(recording_.payload()), recorded);
    same_inputs = recorded == now;
    recording_.next();
  }
  [[nodiscard]] firmware_if::Imu& imu() noexcept override { return imu_; }
  [[nodiscard]] firmware_if::Gnss& gnss() noexcept override { return gnss_; }
  [[nodiscard]] firmware_if::Barometer& barometer() noexcept override { return barometer_; }
  [[nodiscard]] firmware_if::Motors& motors() noexcept override { return *this; }
  [[nodiscard]] AircraftHealth health(MonotonicTime) noexcept override {
    AircraftHealth health;
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
};

}  // namespace

ReplayResult replay_flight(const std::string& path, const std::function<void(double)>& progress) {
  Recording recording(path);
  FlightDigest digest;
  ReplayedAircraft aircraft(recording, digest);
  std::vector<ReplayedCamera> camera;
  for (std::uint32_t i = 0; i < kCameras; ++i) camera.emplace_back(recording, i);
  std::array<firmware_if::DepthCamera*, kCameras> cameras{};
  for (std::size_t i = 0; i < kCameras; ++i) cameras[i] = &camera[i];
  const auto flight =
      std::make_unique<LockstepFlight>(recording.world(), recording.config(), aircraft, cameras);
  ReplayResult result;
  double told_s = 0.0;
  while (recording.kind() == RecordKind::kFrame) {
    ++result.replayed.minor_frames;
    if (const DecisionOutput* decision = flight->step()) {
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

}  // namespace roborun::app
