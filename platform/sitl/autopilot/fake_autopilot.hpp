/// A PX4 or ArduCopter that is none: it obeys their written and measured rules for a companion computer, deterministic and
/// in lockstep, on top of the simulated vehicle. Nothing of theirs is in it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "core/vehicle_model.hpp"
#include "firmware_if/mavlink/dialect.hpp"
#include "firmware_if/mavlink/flight_messages.hpp"
#include "firmware_if/mavlink/receiver.hpp"
#include "platform/flight/aircraft.hpp"
#include "platform/sitl/autopilot/set_point_shaper.hpp"
#include "stages/control/estimator.hpp"
#include "stages/control/tracker.hpp"

namespace roborun::sitl {

using firmware_if::mavlink::AutopilotKind;

/// Which rules, of MAVLink set-points: local NED (frame 1) alone. What else:
///  - PX4: Offboard is refused without a stream of set-points, and arming in it too; COM_OF_LOSS_T without one ends in what
///    COM_OBL_RC_ACT says (5: Hold, else Return, as without a transmitter). Set-points go to the controller unshaped.
///  - ArduCopter: set-points are ignored on the ground; NAV_TAKEOFF within 10 s of arming or it disarms. One ignored axis
///    ignores its triple; nothing valid, a wrong frame, NaN or more than 1000 m/s stops it. After GUID_TIMEOUT velocity and
///    acceleration become zero, positions stay. Set-points are shaped (SetPointShaper). Yaw that is ignored turns the nose
///    into the flight.
/// Its world is the simulator's: the local origin is the world's, until it jumps.
class FakeAutopilot {
 public:
  enum class Mode : std::uint8_t { kManual, kGuided, kHold, kReturn, kLand };
  struct Counters {
    std::uint64_t set_points{}, refused_set_points{}, ignored_set_points{}, timeouts{}, not_sent{};
    std::uint64_t refused_disarms{}, releases{};
    std::uint64_t lost_frames{}, doubled_frames{};  ///< Of its companion, by their sequence numbers.
  };
  static constexpr double kBoot_s = 3.0;  ///< 42 s measured, shortened: until then it cannot be armed.

  /// Signer and verifier null: nothing is signed and nothing is demanded. They outlive it.
  FakeAutopilot(AutopilotKind kind, const VehicleModel& vehicle, Nanos minor_frame,
                firmware_if::mavlink::Signer* signer = nullptr,
                firmware_if::mavlink::Verifier* verifier = nullptr) noexcept;
  FakeAutopilot(const FakeAutopilot&) = delete;
  FakeAutopilot& operator=(const FakeAutopilot&) = delete;

  /// Bytes that arrived. Acted upon at once. No allocation.
  void receive(MonotonicTime now, std::span<const std::uint8_t> bytes) noexcept;
  /// One minor frame: sensors of `body`, its motors, and what is to be sent.
  void step(MonotonicTime now, flight::Aircraft& body, bool on_ground, double battery_ratio) noexcept;
  [[nodiscard]] std::span<const std::uint8_t> outgoing() const noexcept {
    return std::span<const std::uint8_t>(out_).first(out_bytes_);
  }
  void sent_all() noexcept { out_bytes_ = 0; }

  /// The pilot's switch.
  void pilot_takes(Mode mode) noexcept { set_mode(mode); }
  void pilot_disarms() noexcept { armed_ = false; }
  bool never_arms{false};                          ///< Its checks before arming fail.
  bool refuses_set_points{false};                  ///< Of any content.
  std::optional<std::uint8_t> landed_state;        ///< It says this of itself, whatever is true.
  bool is_mute_of_landing{false};                  ///< No EXTENDED_SYS_STATE.
  firmware_if::mavlink::GpsGlobalOrigin origin{};  ///< Of its local frame, as it tells it.
  Nanos late{};  ///< Times of messages, but not of TIMESYNC: a queue in its line.
  /// Power cycle in flight of its computer alone: clock, parameters' streams and mode begin anew.
  void reboot(MonotonicTime now) noexcept;
  /// Its estimator is reset: the same place has other coordinates from now on, and what it was told last does not know.
  void move_origin(const Vector3& by_W) noexcept {
    origin_W_ += by_W;
    target_.p_W += by_W;
    ++resets_;
  }
  /// A parameter as a user has set it. False: unknown.
  bool set_parameter(std::string_view name, double value) noexcept;
  [[nodiscard]] double parameter(std::string_view name) const noexcept;

  [[nodiscard]] Mode mode() const noexcept { return mode_; }
  [[nodiscard]] bool armed() const noexcept { return armed_; }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }
  [[nodiscard]] const stages::Estimator& estimator() const noexcept { return estimator_; }
  /// What is flown now.
  [[nodiscard]] const TrajectoryPoint& reference() const noexcept { return reference_; }

 private:
  struct Parameter {
    const char* name;
    double value;
    bool is_integer;
  };
  struct Stream {
    std::uint32_t msgid;
    Nanos interval;  ///< 0: off.
    MonotonicTime next;
  };

  template <typename T>
  void send(const T& message) noexcept;
  void say(std::string_view text) noexcept;
  void send_stream(MonotonicTime now, std::uint32_t msgid, double battery_ratio) noexcept;
  void send_heartbeat() noexcept;
  void send_odometry(MonotonicTime now) noexcept;
  void send_position(MonotonicTime now) noexcept;
  void send_attitude(MonotonicTime now) noexcept;
  void send_parameter(const Parameter& parameter) noexcept;

  void count(const firmware_if::mavlink::FrameHeader& header) noexcept;
  void on_frame(MonotonicTime now, const firmware_if::mavlink::Frame& frame) noexcept;
  void on_command(MonotonicTime now, const firmware_if::mavlink::CommandLong& command) noexcept;
  [[nodiscard]] std::uint8_t arm(MonotonicTime now, bool on) noexcept;
  [[nodiscard]] std::uint8_t change_mode(MonotonicTime now, double number) noexcept;
  [[nodiscard]] std::uint8_t set_interval(MonotonicTime now, std::uint32_t msgid,
                                          double interval_us) noexcept;
  void on_set_point(MonotonicTime now,
                    const firmware_if::mavlink::SetPositionTargetLocalNed& message) noexcept;
  [[nodiscard]] bool take_axes(const firmware_if::mavlink::SetPositionTargetLocalNed& message,
                               Target& target) const noexcept;
  void set_mode(Mode mode) noexcept;
  [[nodiscard]] std::uint32_t custom_mode() const noexcept;

  void sense(flight::Aircraft& body) noexcept;
  void check_time_outs(MonotonicTime now) noexcept;
  void lead(double dt_s) noexcept;
  void lead_yaw(double dt_s) noexcept;
  [[nodiscard]] ShaperLimits shaper_limits() const noexcept;
  [[nodiscard]] std::int64_t boot_ns(MonotonicTime now) const noexcept { return (now - booted_at_).count(); }
  [[nodiscard]] bool is_px4() const noexcept { return kind_ == AutopilotKind::kPx4; }

  AutopilotKind kind_;
  VehicleModel vehicle_;
  Nanos minor_frame_;
  stages::Estimator estimator_;
  stages::Tracker tracker_;
  firmware_if::mavlink::Signer* signer_;
  firmware_if::mavlink::Receiver receiver_;
  std::array<std::uint8_t, 4096> out_{};
  std::size_t out_bytes_{0};
  std::uint8_t seq_{0};
  std::optional<firmware_if::mavlink::FrameHeader> heard_;  ///< Of its companion, the newest.
  std::array<Parameter, 9> parameters_;
  std::array<Stream, 8> streams_;
  MonotonicTime asked_at_{};
  MonotonicTime booted_at_{Nanos{-11'300'400'500}};  ///< Its clock is not ours.
  Nanos ready_after_;

  Mode mode_{Mode::kManual};
  bool armed_{false};
  bool on_ground_{true};
  std::optional<MonotonicTime> rises_at_;  ///< Of a take-off that was commanded.
  double rise_m_{0.0};
  bool has_risen_{false};  ///< A take-off was begun: set-points count.
  MonotonicTime armed_at_{}, grounded_at_{};
  stages::EstimatedState state_{};
  bool has_state_{false};

  Target target_ = Target::stop();
  Vector3 origin_W_ = Vector3::Zero();  ///< Of its local frame.
  std::uint8_t resets_{0};
  bool is_led_{false};  ///< A set-point came since the mode began; PX4: what is flown is it, unshaped.
  bool has_yaw_{false}, has_yaw_rate_{false};
  double yaw_rad_{0.0}, yaw_rate_radps_{0.0};
  std::optional<MonotonicTime> set_point_at_;
  bool timed_out_{false};
  SetPointShaper shaper_;
  YawShaper yaw_;
  Vector3 lagged_W_mps2_ = Vector3::Zero();
  Vector3 home_W_ = Vector3::Zero();
  TrajectoryPoint reference_{};
  firmware_if::MotorCommand motors_{};
  Counters counters_{};
};

template <typename T>
void FakeAutopilot::send(const T& message) noexcept {
  const auto length =
      firmware_if::mavlink::write_frame(T::kType, {seq_, 1, 1}, firmware_if::mavlink::pack(message), signer_,
                                        std::span<std::uint8_t>(out_).subspan(out_bytes_));
  if (!length.ok()) {
    ++counters_.not_sent;
    return;
  }
  ++seq_;
  out_bytes_ += length.value();
}

}  // namespace roborun::sitl
