#include "platform/mission/recording.hpp"

#include <fmt/format.h>

#include "platform/input/input_error.hpp"
#include "platform/mission/recorded_flight.hpp"
#include "platform/mission/recording_format.hpp"

namespace roborun::mission {
namespace {

/// Throws if the flight depends on what does not cross the boundary.
const std::string& recordable(const std::string& path, const MissionConfig& config) {
  if (!config.own.empty() || uses_plugin(config.backends))
    throw InputError(
        fmt::format("{}: a recording is flown again without code of others: must be a flight with map, "
                    "planner and ways by name",
                    path));
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

void FlightDigest::add(const flight::DecisionOutput& d) noexcept {
  hash_.add(static_cast<std::uint64_t>(d.kind));
  hash_.add(static_cast<std::uint64_t>(d.latency.count()));
  const OperatingPoint& point = d.decision.point;
  hash_.add(static_cast<std::uint64_t>(point.deadline.count()));
  hash_.add(static_cast<std::uint64_t>(point.p0_level));
  hash_.add(static_cast<std::uint64_t>(point.p1_level));
  hash_.add(point.speed_limit_mps);
  if (d.kind == flight::DecisionKind::kKeep) return;
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

class FlightRecorder::TappedLidar final : public firmware_if::Lidar {
 public:
  TappedLidar(FlightRecorder& recorder, firmware_if::Lidar& lidar, std::uint32_t index)
      : recorder_(recorder), lidar_(lidar), index_(index) {}
  [[nodiscard]] Status read(firmware_if::LidarSweep& sweep) noexcept override {
    const Status status = lidar_.read(sweep);
    if (status != Status::kOk) return status;
    Put put(recorder_.payload_);
    put(index_);
    each_field(put, sweep);
    for (const auto& point : sweep.points_L_m)
      for (const float x : point) put(x);
    recorder_.write(RecordKind::kLidar);
    return status;
  }
  [[nodiscard]] const firmware_if::CameraMount& mount() const noexcept override { return lidar_.mount(); }

 private:
  FlightRecorder& recorder_;
  firmware_if::Lidar& lidar_;
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

FlightRecorder::FlightRecorder(const std::string& path, const flight::FlightConfig& flight,
                               const MissionConfig& config, flight::Aircraft& aircraft,
                               std::span<firmware_if::DepthCamera* const> cameras,
                               std::span<firmware_if::Lidar* const> lidars)
    : file_(recordable(path, config)), aircraft_(aircraft) {
  imu_ = std::make_unique<Tap<firmware_if::Imu, firmware_if::ImuSample>>(*this, aircraft.imu());
  gnss_ = std::make_unique<Tap<firmware_if::Gnss, firmware_if::GnssFix>>(*this, aircraft.gnss());
  barometer_ = std::make_unique<Tap<firmware_if::Barometer, firmware_if::BarometerSample>>(
      *this, aircraft.barometer());
  if (firmware_if::Odometry* odometry = aircraft.odometry())
    odometry_ = std::make_unique<Tap<firmware_if::Odometry, firmware_if::OdometrySample>>(*this, *odometry);
  motors_ = std::make_unique<TappedMotors>(digest_, aircraft.motors());
  RecordedFlight recorded{flight, config.backends, config.slow_down, sitl::rig_of(config.simulator), {}, {}};
  for (firmware_if::DepthCamera* camera : cameras) {
    camera_.push_back(
        std::make_unique<TappedCamera>(*this, *camera, static_cast<std::uint32_t>(camera_.size())));
    cameras_.push_back(camera_.back().get());
    recorded.mounts.push_back(camera->mount());
  }
  for (firmware_if::Lidar* lidar : lidars) {
    lidar_.push_back(std::make_unique<TappedLidar>(*this, *lidar, static_cast<std::uint32_t>(lidar_.size())));
    lidars_.push_back(lidar_.back().get());
    recorded.lidar_mounts.push_back(lidar->mount());
  }
  const std::string start = to_json(recorded);
  const auto* bytes = reinterpret_cast<const std::byte*>(start.data());
  payload_.assign(bytes, bytes + start.size());
  write(RecordKind::kStart);
}

firmware_if::Imu& FlightRecorder::imu() noexcept { return *imu_; }
firmware_if::Gnss& FlightRecorder::gnss() noexcept { return *gnss_; }
firmware_if::Barometer& FlightRecorder::barometer() noexcept { return *barometer_; }
firmware_if::Motors& FlightRecorder::motors() noexcept { return *motors_; }

flight::AircraftHealth FlightRecorder::health(MonotonicTime now) noexcept {
  flight::AircraftHealth health = aircraft_.health(now);
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

void FlightRecorder::begin_frame(MonotonicTime now) noexcept {
  aircraft_.begin_frame(now);
  ++totals_.minor_frames;
  each_field(Put(payload_), now);
  write(RecordKind::kFrame);
}

void FlightRecorder::gave_goals(std::span<const Vector3> goals_W) noexcept {
  Put put(payload_);
  for (const Vector3& p_W : goals_W)
    for (int i = 0; i < 3; ++i) put(p_W[i]);
  write(RecordKind::kGoals);
}

void FlightRecorder::decided(const flight::DecisionOutput& decision) noexcept {
  ++totals_.decisions;
  digest_.add(decision);
}

void FlightRecorder::write(RecordKind kind) noexcept {
  const std::array<std::uint32_t, 2> head{static_cast<std::uint32_t>(kind),
                                          static_cast<std::uint32_t>(payload_.size())};
  checksum_ = checksum(checksum_, kind, payload_);
  file_.write({reinterpret_cast<const char*>(head.data()), sizeof head});
  file_.write({reinterpret_cast<const char*>(payload_.data()), payload_.size()});
  file_.write({reinterpret_cast<const char*>(&checksum_), sizeof checksum_});
  payload_.clear();
}

void FlightRecorder::finish(const stages::OccupancyMap& map) {
  totals_.digest = digest_.value(map);
  each_field(Put(payload_), totals_);
  write(RecordKind::kEnd);
  file_.commit();
}

}  // namespace roborun::mission
