/// An autopilot that flies the vehicle itself: its state comes in, set-points go out. Frames: world ENU, body FLU; what
/// the autopilot's own protocol has instead (NED, FRD) stays behind this boundary.
#pragma once

#include <array>
#include <cstdint>

#include "firmware_if/status.hpp"
#include "firmware_if/time.hpp"

namespace roborun::firmware_if {

/// What its estimator says. The world is its local frame.
struct AutopilotState {
  MonotonicTime stamp{};  ///< Instant of validity, on our clock.
  std::uint32_t sequence{};
  std::uint32_t
      frame_number{};  ///< Another number: the local frame jumped; what was mapped before lies elsewhere.
  std::array<double, 3> p_WB_m{};
  std::array<double, 3> v_WB_mps{};
  std::array<double, 4> q_WB{1.0, 0.0, 0.0, 0.0};  ///< w, x, y, z.
  std::array<double, 3> w_WB_B_radps{};
};

/// Where it is to be, now. All of it is valid; what the autopilot cannot use is left out behind this boundary.
struct AutopilotSetPoint {
  std::array<double, 3> p_W_m{};
  std::array<double, 3> v_W_mps{};
  std::array<double, 3> a_W_mps2{};
  double yaw_rad{};  ///< From East, counter-clockwise.
};

/// How it moves while it follows set-points and when they end: read from it before the take-off.
struct AutopilotLimits {
  double silence_s{};  ///< From the last set-point until it begins to stop by itself ...
  double delay_s{};    ///< ... and from then on until the vehicle answers.
  double stop_mps2{};  ///< How hard it stops then ...
  double stop_jerk_mps3{};
  double acceleration_mps2{};  ///< What it follows of set-points; +infinity: as much as the vehicle can.
  double jerk_mps3{};
  double speed_mps{};
  double climb_mps{};
  double descent_mps{};
};

enum class AutopilotStage : std::uint8_t {
  kSilent,    ///< No autopilot was heard yet.
  kChecking,  ///< Heard; its answers to our questions are not complete.
  kRefused,   ///< It is not what the plans need: `reason` says why. For good.
  kReady,     ///< It may be taken over: take_command(). Withdrawn by silence.
  kTaking,    ///< Asked for; mode, arming and take-off are under way.
  kOurs,      ///< It follows our set-points.
  kPilots,  ///< It was ours or was being taken, and somebody else changed its mode or disarmed it. For good: nothing more is sent.
  kLost,    ///< It was ours, and is silent or stale. Nothing is sent until it is heard again in our mode.
};
[[nodiscard]] constexpr const char* to_string(AutopilotStage stage) noexcept {
  constexpr std::array<const char*, 8> kNames{"silent", "checking", "refused",     "ready",
                                              "taking", "ours",     "the pilot's", "lost"};
  return kNames[static_cast<std::size_t>(stage)];
}

struct AutopilotReport {
  AutopilotStage stage{AutopilotStage::kSilent};
  const char* reason{""};   ///< Why it is not further, in words. Of static storage.
  const char* subject{""};  ///< The parameter, message or command in question. Of static storage.
  bool armed{};
  bool in_air{};           ///< Armed, and not known by a young message to stand on the ground.
  double battery_ratio{};  ///< NaN: unknown.
};

/// Contract:
///  1. No call blocks or allocates; each is O(1) but for step(), which is bounded by what one call may read.
///  2. All calls come from one thread, the one that flies; step() once per minor frame, before the others. The sign of life
///  towards the autopilot is sent by step() and command() alone: a sick loop falls silent.
///  3. read() hands out the newest state that was not read yet; kNotReady: none. Stamps ascend. No state is handed out
///  before the clocks are matched.
///  4. command() is called in every minor frame, from before take_command() on (the stream has to run before the mode);
///  it sends at its own rate. kOk: taken; kNotReady: not now (nothing is sent); kInvalidArgument: not finite.
///  5. Nothing that comes in gives a command, and nothing of another sender than the one autopilot that was latched
///  changes a state.
///  6. A mode that we did not ask for ends our set-points with the frame that tells it, for good (kPilots). So does
///  an autopilot that was ours and restarts. The same while it is being taken: what was reached and is gone again is not
///  asked for a second time.
///  7. take_command() is remembered. It is obeyed once the stage is kReady. Without a heartbeat or with an old state kReady and
///  kTaking are taken back to kChecking until both are there again.
class Autopilot {
 public:
  virtual ~Autopilot() = default;
  virtual void step(MonotonicTime now) noexcept = 0;
  [[nodiscard]] virtual Status read(AutopilotState& state) noexcept = 0;
  virtual Status command(MonotonicTime now, const AutopilotSetPoint& set_point) noexcept = 0;
  /// Mode, arming, and the take-off where set-points do not do it, to `height_m` over the ground it stands on. Again with
  /// zero: from where it is in the air now, in the middle of its own take-off.
  virtual void take_command(double height_m) noexcept = 0;
  /// Nothing more is sent, for good: the autopilot does what it does when set-points end.
  virtual void let_go() noexcept = 0;
  /// For a vehicle that has landed: nothing else is sent from now on, and this by step() until it is disarmed or the pilot's,
  /// at most 10 times. Only if it is ours or being taken.
  virtual void disarm() noexcept = 0;
  /// For a vehicle that does not follow our descent: down by the autopilot's own landing. Asked for like disarm(), until its mode
  /// has changed; nothing else is sent.
  virtual void land() noexcept = 0;
  /// Motors off, also in the air: asked for like disarm(). One that is lost or the pilot's is only let go.
  virtual void terminate() noexcept = 0;
  [[nodiscard]] virtual AutopilotReport report() const noexcept = 0;
  /// As read; before that what the plans assume.
  [[nodiscard]] virtual const AutopilotLimits& limits() const noexcept = 0;
};

}  // namespace roborun::firmware_if
