#include "platform/live/guard.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <thread>

#include "core/geometry/math.hpp"
#include "core/geometry/yaw.hpp"
#include "firmware_if/mavlink/flight_messages.hpp"
#include "firmware_if/mavlink/ned.hpp"
#include "firmware_if/mavlink/receiver.hpp"
#include "platform/input/input_error.hpp"
#include "platform/live/obstacle_sectors.hpp"
#include "platform/live/port_pictures.hpp"
#include "platform/rt/monotonic_clock.hpp"

namespace roborun::live {
namespace {

using namespace firmware_if::mavlink;  // NOLINT(google-build-using-namespace): messages by the dozen

constexpr std::uint8_t kObstacleAvoidance = 196;  // MAV_COMP_ID
constexpr Nanos kPeriod{100'000'000};
constexpr Nanos kBeat{1'000'000'000};
constexpr Nanos kOldAttitude{500'000'000};

/// FRD in NED, rad.
struct Attitude {
  static constexpr MessageType kType = kAttitude;
  std::uint32_t time_boot_ms{};
  float roll{}, pitch{}, yaw{}, rollspeed{}, pitchspeed{}, yawspeed{};
  static constexpr std::tuple kMembers{Member<&Attitude::time_boot_ms>{"time_boot_ms"},
                                       Member<&Attitude::roll>{"roll"},
                                       Member<&Attitude::pitch>{"pitch"},
                                       Member<&Attitude::yaw>{"yaw"},
                                       Member<&Attitude::rollspeed>{"rollspeed"},
                                       Member<&Attitude::pitchspeed>{"pitchspeed"},
                                       Member<&Attitude::yawspeed>{"yawspeed"}};
};

class Guard {
 public:
  explicit Guard(const GuardConfig& config)
      : config_(config),
        pictures_(sensor_port::VehiclePorts(config.link.name), config.rig, {clock_.epoch()}),
        sectors_(config.rig.cameras.size(), config.band_m),
        link_(*config.link.mavlink) {}

  GuardReport run(const std::function<void(double, double)>& progress) {
    GuardReport report;
    const MonotonicTime begin = clock_.now();
    for (;;) {
      report.needs.clear();
      pictures_.look(clock_.now(), report.needs);
      report.ready = std::all_of(report.needs.begin(), report.needs.end(),
                                 [](const Need& n) { return n.lacks.empty(); });
      const bool over = (config_.stop && config_.stop()) || seconds(clock_.now() - begin) > config_.wait_s;
      if (report.ready || over) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    if (!report.ready) return report;
    report.nearest_m = std::numeric_limits<double>::infinity();
    const MonotonicTime start = clock_.now();
    MonotonicTime due = start, beat = start, told = start;
    while (!(config_.stop && config_.stop()) && seconds(clock_.now() - start) < config_.seconds) {
      const MonotonicTime now = clock_.now();
      hear(now);
      if (now >= due) {
        due = std::max(due + kPeriod, now);
        see(now);
        const ObstacleDistance around = sectors_.message(now);
        send(around, now, report);
        if (config_.limit) limit(around, now, report);
        const double nearest_m = sectors_.nearest_m(now);
        report.nearest_m = std::min(report.nearest_m, nearest_m);
        if (progress && now >= told) {
          told = now + 2 * kPeriod;
          progress(seconds(now - start), nearest_m);
        }
      }
      if (now >= beat) {
        beat += kBeat;
        send(Heartbeat{18, 8, 0, 0, 4, 3}, now, report);
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    report.time_s = seconds(clock_.now() - start);
    report.messages = messages_;
    pictures_.use(clock_.now(), report.ports);
    return report;
  }

 private:
  void see(MonotonicTime now) {
    const bool leans = now - leans_at_ <= kOldAttitude;
    const Matrix3 R_LB = leans ? R_LB_ : Matrix3(Matrix3::Identity());
    firmware_if::DepthFrame frame;
    for (std::size_t i = 0; i < pictures_.cameras().size(); ++i)
      if (pictures_.cameras()[i]->read(frame) == Status::kOk)
        sectors_.see(i, frame, pictures_.cameras()[i]->mount(), R_LB);
  }

  /// Once a second, and at once where it falls. It holds in the modes that follow DO_CHANGE_SPEED: missions and guided flight.
  void limit(const ObstacleDistance& around, MonotonicTime now, GuardReport& report) {
    constexpr std::uint16_t kChangeSpeed = 178;
    constexpr std::uint8_t kAutopilot = 1;
    constexpr float kOverGround = 1.0F, kSameThrottle = -1.0F;
    constexpr double kFell_mps = 0.5, kStands_mps = 0.5, kAhead_rad = 45.0 * core::kDegree;
    if (sysid_ == 0) return;
    const bool moves = now - moved_at_ <= kOldAttitude && now - leans_at_ <= kOldAttitude &&
                       core::hypot2(north_mps_, east_mps_) > kStands_mps;
    const double toward_rad = moves ? core::atan2(east_mps_, north_mps_) - yaw_rad_ : 0.0;
    const double speed_mps = config_.limit->speed_mps(
        ObstacleSectors::clear_m(around, toward_rad, moves ? kAhead_rad : core::kPi));
    const bool falls = report.limit_mps && speed_mps < *report.limit_mps - kFell_mps;
    if (!falls && now < limit_due_) return;
    limit_due_ = now + kBeat;
    report.limit_mps = speed_mps;
    ++report.limits;
    send(CommandLong{sysid_, kAutopilot, kChangeSpeed, 0, kOverGround, static_cast<float>(speed_mps),
                     kSameThrottle},
         now, report);
  }

  /// The system that is guarded is that of the first autopilot. Its clock's questions are answered, and what it says of its
  /// attitude without being asked is believed.
  void hear(MonotonicTime now) {
    constexpr int kMost = 64;
    std::size_t count = 0;
    for (int i = 0; i < kMost && (count = link_.read(now, bytes_)) > 0; ++i) {
      auto bytes = std::span<const std::uint8_t>(bytes_).first(count);
      while (!bytes.empty()) {
        bytes = bytes.subspan(receiver_.push(bytes));
        Frame frame;
        Event event = Event::kNothing;
        while ((event = receiver_.next(frame)) != Event::kNothing)
          if (event == Event::kFrame) take(now, frame);
      }
    }
  }

  void take(MonotonicTime now, const Frame& frame) {
    constexpr std::uint8_t kAutopilot = 1, kInvalid = 8;
    if (frame.header.compid != kAutopilot) return;
    if (frame.msgid == kHeartbeat.id && sysid_ == 0 && unpack<Heartbeat>(frame.payload).autopilot != kInvalid)
      sysid_ = frame.header.sysid;
    if (frame.header.sysid != sysid_) return;
    if (frame.msgid == kAttitude.id) {
      const auto m = unpack<Attitude>(frame.payload);
      lean(now, level_of(static_cast<double>(m.roll), static_cast<double>(m.pitch)),
           static_cast<double>(m.yaw));
    }
    if (frame.msgid == kAttitudeQuaternion.id) {
      const auto m = unpack<AttitudeQuaternion>(frame.payload);
      const auto v = wide(m.q2, m.q3, m.q4);
      const std::array q{static_cast<double>(m.q1), v[0], v[1], v[2]};
      lean(now, level_of(q), core::yaw_of(Quaternion(q[0], q[1], q[2], q[3])));
    }
    if (frame.msgid == kLocalPositionNed.id) {
      const auto m = unpack<LocalPositionNed>(frame.payload);
      if (std::isfinite(m.vx) && std::isfinite(m.vy)) {
        north_mps_ = static_cast<double>(m.vx);
        east_mps_ = static_cast<double>(m.vy);
        moved_at_ = now;
      }
    }
    if (frame.msgid != kTimesync.id) return;
    const auto question = unpack<Timesync>(frame.payload);
    GuardReport none;
    if (question.tc1 == 0)
      send(Timesync{now.time_since_epoch().count(), question.ts1, sysid_, kAutopilot}, now, none);
  }

  void lean(MonotonicTime now, const Matrix3& R_LB, double yaw_rad) {
    if (!R_LB.allFinite() || !std::isfinite(yaw_rad)) return;
    R_LB_ = R_LB;
    yaw_rad_ = yaw_rad;
    leans_at_ = now;
  }

  template <typename T>
  void send(const T& message, MonotonicTime now, GuardReport& report) {
    std::array<std::uint8_t, kMostFrame_bytes> frame{};
    const auto length =
        write_frame(T::kType, {seq_++, sysid_ != 0 ? sysid_ : std::uint8_t{1}, kObstacleAvoidance},
                    pack(message), nullptr, frame);
    const std::size_t left = link_.write(now, std::span<const std::uint8_t>(frame).first(length.value()));
    if (left < length.value()) ++report.not_sent;
    if (left == length.value() && T::kType.id == kObstacleDistance.id) ++messages_;
  }

  const GuardConfig& config_;
  rt::MonotonicClock clock_;
  PortPictures pictures_;
  ObstacleSectors sectors_;
  mavlink::Link link_;
  Receiver receiver_;
  std::array<std::uint8_t, 4096> bytes_{};
  std::uint8_t seq_{0}, sysid_{0};
  std::uint64_t messages_{0};
  Matrix3 R_LB_ = Matrix3::Identity();
  double yaw_rad_{0.0}, north_mps_{0.0}, east_mps_{0.0};  ///< Clockwise from north; over ground.
  MonotonicTime leans_at_{-2 * kOldAttitude}, moved_at_{-2 * kOldAttitude}, limit_due_{};
};

}  // namespace

double GuardSpeedLimit::speed_mps(double clear_m) const noexcept {
  // Where the distance of the stop is that of what is clear: a x^2 + b x + c = 0.
  const double a = stopping.quadratic_s2pm, b = stopping.linear_s + kLatency_s;
  const double c = stopping.constant_m - std::max(clear_m - radius_m, 0.0);
  const double under = b * b - 4.0 * a * c;
  // The root that also holds where it does not brake (a is 0).
  const double speed_mps = under > 0.0 ? -2.0 * c / (b + std::sqrt(under)) : 0.0;
  return std::clamp(speed_mps, std::min(kLeast_mps, v_max_mps), v_max_mps);
}

GuardReport run_guard(const GuardConfig& config,
                      const std::function<void(double time_s, double nearest_m)>& progress) {
  if (config.rig.cameras.empty()) throw InputError("--vehicle: has no camera: a guard needs depth images");
  Guard guard(config);
  return guard.run(progress);
}

}  // namespace roborun::live
