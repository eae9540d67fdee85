#include "platform/mission/recording.hpp"

#include "platform/mission/decision_values.hpp"

namespace roborun::mission {
namespace {

/// A message of inputs spans so much of the flight.
constexpr Nanos kBatch{100'000'000};
/// ... or holds about so much.
constexpr std::size_t kMostBatch_bytes = 1U << 20U;

}  // namespace

std::string why_not_replayed(const MissionConfig& config) {
  if (config.autopilot) return "inputs are sensors, and an autopilot flew it";
  if (config.route) return "inputs hold goals, and a route sets speeds too";
  if (!config.own.empty() || uses_plugin(config.backends))
    return "map, planner, policy or ways were code of others";
  for (const TimedFault& f : config.faults) {
    for (const sitl::Component component :
         {sitl::Component::kCpu, sitl::Component::kPlanner, sitl::Component::kMap}) {
      if (f.fault.component == component) return "it had a fault of cpu, planner or map, which is no input";
    }
  }
  return {};
}

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
  hash_.add(hash_of(d.trajectory));
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
      each_field(PutField(recorder_.payload_), sample);
      recorder_.add(kind_of(&sample));
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
    PutField put(recorder_.payload_);
    put(index_);
    each_field(put, frame);
    for (const float depth_m : frame.depth_m) put(depth_m);
    recorder_.add(RecordKind::kDepth);
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
    PutField put(recorder_.payload_);
    put(index_);
    each_field(put, sweep);
    for (const auto& point : sweep.points_L_m)
      for (const float x : point) put(x);
    recorder_.add(RecordKind::kLidar);
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
  TappedMotors(FlightRecorder& recorder, firmware_if::Motors& motors)
      : recorder_(recorder), motors_(motors) {}
  [[nodiscard]] Status command(const firmware_if::MotorCommand& command) noexcept override {
    recorder_.digest_.add(command);
    MotorsCheck check = check_of(command);
    each_field(PutField(recorder_.payload_), check);
    recorder_.add(RecordKind::kMotors);
    return motors_.command(command);
  }

 private:
  FlightRecorder& recorder_;
  firmware_if::Motors& motors_;
};

FlightRecorder::FlightRecorder(log::FlightLog& log, flight::Aircraft& aircraft,
                               std::span<firmware_if::DepthCamera* const> cameras,
                               std::span<firmware_if::Lidar* const> lidars)
    : log_(log), aircraft_(aircraft) {
  imu_ = std::make_unique<Tap<firmware_if::Imu, firmware_if::ImuSample>>(*this, aircraft.imu());
  gnss_ = std::make_unique<Tap<firmware_if::Gnss, firmware_if::GnssFix>>(*this, aircraft.gnss());
  barometer_ = std::make_unique<Tap<firmware_if::Barometer, firmware_if::BarometerSample>>(
      *this, aircraft.barometer());
  if (firmware_if::Odometry* odometry = aircraft.odometry())
    odometry_ = std::make_unique<Tap<firmware_if::Odometry, firmware_if::OdometrySample>>(*this, *odometry);
  motors_ = std::make_unique<TappedMotors>(*this, aircraft.motors());
  for (firmware_if::DepthCamera* camera : cameras) {
    camera_.push_back(
        std::make_unique<TappedCamera>(*this, *camera, static_cast<std::uint32_t>(camera_.size())));
    cameras_.push_back(camera_.back().get());
  }
  for (firmware_if::Lidar* lidar : lidars) {
    lidar_.push_back(std::make_unique<TappedLidar>(*this, *lidar, static_cast<std::uint32_t>(lidar_.size())));
    lidars_.push_back(lidar_.back().get());
  }
}

flight::AircraftHealth FlightRecorder::health(MonotonicTime now) noexcept {
  flight::AircraftHealth health = aircraft_.health(now);
  each_field(PutField(payload_), health);
  add(RecordKind::kHealth);
  return health;
}

void FlightRecorder::terminate() noexcept {
  digest_.add_motors_off();
  add(RecordKind::kMotorsOff);
  aircraft_.terminate();
}

void FlightRecorder::disarm() noexcept {
  digest_.add_motors_off();
  add(RecordKind::kMotorsOff);
  aircraft_.disarm();
}

void FlightRecorder::begin_frame(MonotonicTime now) noexcept {
  aircraft_.begin_frame(now);
  // Whole frames: a log that is cut replays to the end of one.
  if (now - batch_begin_ >= kBatch || batch_.bytes() >= kMostBatch_bytes) {
    flush();
    batch_begin_ = now;
  }
  now_ = now;
  ++totals_.minor_frames;
  each_field(PutField(payload_), now);
  add(RecordKind::kFrame);
}

void FlightRecorder::gave_goals(std::span<const Vector3> goals_W) noexcept {
  PutField put(payload_);
  for (const Vector3& p_W : goals_W)
    for (int i = 0; i < 3; ++i) put(p_W[i]);
  add(RecordKind::kGoals);
}

void FlightRecorder::decided(const flight::DecisionOutput& decision) noexcept {
  ++totals_.decisions;
  digest_.add(decision);
  PutField put(payload_);
  for (const std::uint64_t value : values_of(decision)) put(value);
  add(RecordKind::kDecision);
}

void FlightRecorder::add(RecordKind kind) noexcept {
  batch_.add(kind, payload_);
  payload_.clear();
}

void FlightRecorder::flush() noexcept {
  if (!batch_.is_empty()) log_.inputs(now_.time_since_epoch().count(), batch_.take());
}

void FlightRecorder::finish(const stages::OccupancyMap& map) noexcept {
  totals_.digest = digest_.value(map);
  each_field(PutField(payload_), totals_);
  add(RecordKind::kEnd);
  flush();
}

}  // namespace roborun::mission
