/// The companion computer's end of a MAVLink link to a PX4 or ArduCopter vehicle: an Autopilot over bytes. It owns no
/// link and no clock.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "firmware_if/autopilot.hpp"
#include "firmware_if/mavlink/clock_match.hpp"
#include "firmware_if/mavlink/dialect.hpp"
#include "firmware_if/mavlink/flight_messages.hpp"
#include "firmware_if/mavlink/goal_request.hpp"
#include "firmware_if/mavlink/receiver.hpp"

namespace roborun::firmware_if::mavlink {

/// A contract test proves what autopilot.hpp numbers. Besides:
///  - The first heartbeat of an autopilot of the wanted kind latches its system and component; ours is the same system.
///  - receive() acts on at most kMostEvents per step(): what is behind them waits.
///  - Nobody's commands are obeyed; questions of the clock are answered, to the latched autopilot alone. What a ground station
///  behind it asks for is handed out (asked()).
class Companion final : public Autopilot {
 public:
  static constexpr int kMostEvents = 256;  ///< At most 0.2 ms of checksums, whatever comes.
  static constexpr Nanos kLost_state{1'000'000'000};
  static constexpr Nanos kLost_heartbeat{3'500'000'000};

  struct Config {
    AutopilotKind kind{AutopilotKind::kPx4};
    AutopilotLimits
        planned{};  ///< What the plans need: limits() must be as good. Default: made from the kind.
    std::uint8_t compid{191};      ///< MAV_COMP_ID_ONBOARD_COMPUTER.
    std::uint8_t ground_sysid{0};  ///< The ground station whose requests are handed out; 0: nobody's.
    bool may_set{true};            ///< Time-outs that are too long. False: such an autopilot is refused.
    bool may_tune{false};          ///< Limits of its motion that are less than planned, likewise.
    bool may_arm{false};           ///< And take the mode. False: the operator does both.
    Nanos period{
        20'000'000};  ///< Of the set-points, on average: each waits for a young state. [20 ms, 100 ms]
    double lead_s{};  ///< Set-points are of so much later: the way there, and how long each counts.
  };
  struct Counters {
    std::uint64_t frames{}, foreign{}, states{}, stale_states{}, jumps{}, reboots{};
    std::uint64_t releases{};  ///< Of packages, that it confirmed.
    std::uint64_t set_points{}, withheld{},
        not_sent{};  ///< not_sent: frames, because nobody took what was there.
  };

  [[nodiscard]] static Config config_for(AutopilotKind kind) noexcept {
    Config config;
    config.kind = kind;
    config.planned = dialect_of(kind).planned;
    config.lead_s = dialect_of(kind).lead_s;
    return config;
  }
  /// Both null: nothing is signed and nothing is demanded. They outlive this.
  explicit Companion(const Config& config, Signer* signer = nullptr, Verifier* verifier = nullptr) noexcept
      : config_(config),
        dialect_(dialect_of(config.kind)),
        signer_(signer),
        receiver_(verifier),
        limits_(config.planned) {}
  Companion(const Companion&) = delete;
  Companion& operator=(const Companion&) = delete;

  /// Bytes of the link; the result is how many were taken. RT-safe: no allocation.
  [[nodiscard]] std::size_t receive(MonotonicTime now, std::span<const std::uint8_t> bytes) noexcept;
  /// What is to be sent, whole frames; sent() takes the first of it away.
  [[nodiscard]] std::span<const std::uint8_t> outgoing() const noexcept {
    return std::span<const std::uint8_t>(out_).first(out_bytes_);
  }
  void sent(std::size_t bytes) noexcept;

  void step(MonotonicTime now) noexcept override;
  [[nodiscard]] Status read(AutopilotState& state) noexcept override;
  Status command(MonotonicTime now, const AutopilotSetPoint& set_point) noexcept override;
  void take_command(double height_m) noexcept override;
  void let_go() noexcept override { let_go_ = true; }
  void disarm() noexcept override;
  void land() noexcept override;
  void terminate() noexcept override;
  [[nodiscard]] AutopilotReport report() const noexcept override {
    return {stage_, reason_, subject_, armed_, in_air_, battery_ratio_};
  }
  [[nodiscard]] const AutopilotLimits& limits() const noexcept override { return limits_; }

  /// Its gripper lets go: asked for until it answers, at most 10 times, while it is ours.
  void release_package() noexcept { releases_left_ = 10; }
  /// The newest goal that the ground station asks for, once.
  [[nodiscard]] std::optional<GoalRequest> asked() noexcept {
    return std::exchange(asked_goal_, std::nullopt);
  }
  /// Lines and answers for whoever is behind the autopilot; not once it was let go.
  void tell(const Statustext& line) noexcept;
  void tell(const CommandAck& ack) noexcept;
  /// Where its local frame begins, as it told last.
  [[nodiscard]] const std::optional<GpsGlobalOrigin>& origin() const noexcept { return origin_; }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }
  [[nodiscard]] const ClockMatch& clock() const noexcept { return clock_; }
  [[nodiscard]] const Receiver::Counters& received() const noexcept { return receiver_.counters(); }
  /// The last line of text that the autopilot said.
  [[nodiscard]] std::string_view text() const noexcept { return {text_.data(), text_size_}; }
  /// Validity of the newest state; the beginning of time before the first.
  [[nodiscard]] MonotonicTime newest_state() const noexcept { return state_.stamp; }
  /// 0: nobody is latched.
  [[nodiscard]] std::uint8_t autopilot_sysid() const noexcept { return sysid_; }

 private:
  template <typename T>
  void send(const T& message) noexcept;
  void send_command(std::uint16_t command, float p1, float p2, float p7 = 0.0F) noexcept;
  void send_name(const char* name, bool set, float value, bool is_integer) noexcept;

  void on_frame(MonotonicTime now, const Frame& frame) noexcept;
  void on_heartbeat(MonotonicTime now, const Frame& frame) noexcept;
  void on_timesync(MonotonicTime now, const Timesync& message) noexcept;
  void on_odometry(MonotonicTime now, const Odometry& message) noexcept;
  void on_position(MonotonicTime now, const LocalPositionNed& message) noexcept;
  void on_ack(const CommandAck& ack) noexcept;
  void on_parameter(const ParamValue& value) noexcept;
  void take_state(MonotonicTime now, std::int64_t boot_ns, AutopilotState state) noexcept;
  /// True: the autopilot's time went back, it restarted.
  [[nodiscard]] bool restarted(std::int64_t boot_ns) noexcept;

  void ask(MonotonicTime now) noexcept;
  void release(MonotonicTime now) noexcept;
  void begin_taking() noexcept;
  void take(MonotonicTime now) noexcept;
  void ask_to_take(MonotonicTime now) noexcept;
  void watch_pilot() noexcept;
  /// Set-points end at once, and the command is repeated until it is disarmed, or the pilot's, or in vain.
  void end(std::uint16_t command) noexcept;
  void repeat_end(MonotonicTime now) noexcept;
  void check_silence(MonotonicTime now) noexcept;
  /// Null: its heartbeat and its state are young enough to lead it by.
  [[nodiscard]] const char* why_not_led(MonotonicTime now) const noexcept;
  /// It has said of late whether it stands on the ground.
  [[nodiscard]] bool knows_ground(MonotonicTime now) const noexcept {
    return landed_state_ != 0 && now - landed_at_ <= kLost_state;
  }
  void refuse(const char* reason, const char* subject) noexcept;
  [[nodiscard]] bool asks() const noexcept {
    return asked_ < dialect_.streams.size() + dialect_.parameters.size();
  }
  [[nodiscard]] bool in_our_mode() const noexcept { return (mode_ & dialect_.mode_mask) == dialect_.mode; }
  [[nodiscard]] bool streams() const noexcept;

  Config config_;
  const Dialect& dialect_;
  Signer* signer_;
  Receiver receiver_;
  AutopilotLimits limits_;
  ClockMatch clock_;
  Counters counters_{};

  std::array<std::uint8_t, 4096> out_{};
  std::size_t out_bytes_{0};
  std::uint8_t seq_{0};
  int events_left_{0};

  AutopilotStage stage_{AutopilotStage::kSilent};
  const char* reason_{"no autopilot was heard"};
  const char* subject_{""};
  std::uint8_t sysid_{0};
  std::uint8_t autopilot_compid_{0};
  MonotonicTime heartbeat_at_{};  ///< When it came last.
  MonotonicTime lost_at_{};
  MonotonicTime beat_at_{Nanos{-1'000'000'000}};
  std::uint32_t mode_{0};
  bool armed_{false}, in_air_{false};
  std::uint8_t landed_state_{0};  ///< MAV_LANDED_STATE, 0: undefined ...
  MonotonicTime landed_at_{};     ///< ... and when it came.
  double battery_ratio_{std::numeric_limits<double>::quiet_NaN()};
  std::int64_t boot_ns_{0};  ///< The newest time of the autopilot.
  std::array<char, 50> text_{};
  std::size_t text_size_{0};

  std::size_t asked_{0};  ///< Of streams and parameters, in this order: which one is under way.
  bool setting_{false};
  int tries_{0};
  MonotonicTime tried_at_{};

  std::optional<GpsGlobalOrigin> origin_;
  std::optional<GoalRequest> asked_goal_;
  int releases_left_{0};
  MonotonicTime release_at_{};

  bool wanted_{false}, let_go_{false}, rose_{false};
  std::uint16_t end_command_{0};  ///< 0: none.
  bool begun_{false};  ///< A take-over was, also an interrupted one: the pilot's switch counts from then on.
  bool had_mode_{false}, had_armed_{false}, had_both_{false};  ///< What was reached in it.
  double height_m_{0.0}, ground_m_{0.0};
  MonotonicTime set_point_at_{Nanos{-1'000'000'000}};

  AttitudeQuaternion attitude_{};
  bool has_attitude_{false};
  AutopilotState state_{};
  bool has_state_{false}, is_new_{false};
  std::uint64_t clock_moves_{
      0};             ///< Of the newest state: two with a move between them say nothing of a jump.
  bool came_{false};  ///< A state, since the last command().
  std::uint8_t reset_counter_{0};
};

}  // namespace roborun::firmware_if::mavlink
