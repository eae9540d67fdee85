/// What runs in the slots of the flight and the decision lane, and what the two tell each other. Neither
/// knows whether time is real or virtual.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <span>

#include "core/exchange/mailbox.hpp"
#include "core/executive/frame_table.hpp"
#include "core/executive/lane_executive.hpp"
#include "core/geometry/fence.hpp"
#include "core/memory/static_vector.hpp"
#include "firmware_if/depth_camera.hpp"
#include "governor/failsafe/arbiter.hpp"
#include "platform/app/aircraft.hpp"
#include "platform/app/decision_pipeline.hpp"
#include "platform/app/failsafe_monitor.hpp"
#include "platform/app/flight_lane.hpp"

namespace roborun::app {

/// Flight lane to decision lane, every minor frame. What is large is written only where it has changed since
/// this cell of the mailbox was written last.
struct FlightReport {
  stages::EstimatedState state{};
  bool estimated{false};  ///< There is a state.
  stages::PastStates past{Nanos{0}};
  Trajectory committed{};
  std::uint64_t committed_number{0};
  bool flying{false};
  bool airborne{false};
  governor::Action action{governor::Action::kGoOn};
  bool standing{false};
  Vector3 home_W = Vector3::Zero();
  double ground_m{};
};

/// Decision lane to flight lane, after every decision that found something.
struct Offer {
  Trajectory trajectory{};
  bool is_stop{false};  ///< Taken even while an overrun has the vehicle brake.
};

/// Decision lane to flight lane: how it is, at least once a decision.
struct DecisionReport {
  bool heard{false};
  MonotonicTime due{};  ///< When it wants to be back.
  double depth_age_s{};
  int failures{};      ///< Decisions in a row without a usable answer.
  int map_refusals{};  ///< Decisions in a row in which the map refused bricks.
  bool site_known{false};
  Vector3 site_W = Vector3::Zero();  ///< Below it everything is known to be free.
};

struct LaneMail {
  core::Mailbox<FlightReport> report;
  core::Mailbox<Offer> offer;
  core::Mailbox<DecisionReport> decision;
};

/// What the arbiter decided, and when.
struct FailsafeEvent {
  MonotonicTime time{};
  governor::Action action{};
  governor::ConditionSet conditions{};
  governor::Phase phase{};  ///< In which it was decided.
};

/// The flight lane's slots, and the failsafe: conditions to action once a minor frame, and the action flown.
class FlightProgram final : public core::LaneProgram {
 public:
  struct Config {
    core::Fence fence{};
    bool answers{true};  ///< False: conditions are seen and recorded, and nothing is done. For tests alone.
  };
  FlightProgram(const Config& config, FlightLane& flight, Aircraft& aircraft, LaneMail& mail)
      : config_(config), flight_(flight), aircraft_(aircraft), mail_(mail) {}
  /// A frame belongs to the instant of its release, however late it begins.
  void run(core::SlotId slot, core::LaneExecutive& lane) noexcept override;
  /// Offers refused because an overrun or the failsafe has the vehicle brake, or because they begin elsewhere
  /// than the committed trajectory will be; never decreases.
  [[nodiscard]] std::uint64_t offers_refused() const noexcept { return offers_refused_; }

  [[nodiscard]] governor::Phase phase() const noexcept { return phase_; }
  [[nodiscard]] governor::Action action() const noexcept { return action_; }
  [[nodiscard]] MonotonicTime action_since() const noexcept { return action_since_; }
  /// One for each change of the action; in the air at most five, because none is taken back.
  [[nodiscard]] std::span<const FailsafeEvent> events() const noexcept {
    return {events_.begin(), events_.size()};
  }
  /// The descent was over space known to be free.
  [[nodiscard]] bool site_was_known() const noexcept { return site_was_known_; }

 private:
  void take_offers(MonotonicTime now, const core::LaneExecutive& lane) noexcept;
  [[nodiscard]] FailsafeMeasures measure(MonotonicTime now) noexcept;
  void guard(MonotonicTime now) noexcept;
  void begin(governor::Action action, MonotonicTime now) noexcept;
  void come_home(MonotonicTime now) noexcept;
  void land(MonotonicTime now) noexcept;

  Config config_;
  FlightLane& flight_;
  Aircraft& aircraft_;
  LaneMail& mail_;
  std::uint64_t offers_refused_{0};
  FailsafeMonitor monitor_;
  governor::Phase phase_{governor::Phase::kGround};
  governor::Action action_{governor::Action::kGoOn};
  governor::ConditionSet conditions_{0};
  core::StaticVector<FailsafeEvent, 2 * governor::kActionCount> events_;
  MonotonicTime operator_heard_{};
  MonotonicTime action_since_{};
  bool site_was_known_{false};
};

class DecisionProgram final : public core::LaneProgram {
 public:
  struct Config {
    Vector3 goal_W = Vector3::Zero();
    std::uint64_t seed{1};
    core::Fence fence{};
    Nanos minor_frame{core::kMinorFrame};        ///< Of the flight lane.
    const std::uint64_t* map_refusals{nullptr};  ///< Grows when the map takes nothing more; may be null.
  };
  DecisionProgram(const Config& config, DecisionPipeline& pipeline,
                  std::span<firmware_if::DepthCamera* const> cameras, LaneMail& mail)
      : config_(config), pipeline_(pipeline), cameras_(cameras), mail_(mail) {}
  void run(core::SlotId slot, core::LaneExecutive& lane) noexcept override;

  /// No more decisions from here on; any thread.
  void give_up() noexcept { given_up_.store(true, std::memory_order_release); }
  /// The newest decision: complete once the planner's slot has run.
  [[nodiscard]] const DecisionOutput& output() const noexcept { return out_; }
  [[nodiscard]] std::uint64_t decisions() const noexcept { return decisions_; }
  /// Trajectories that came too late for their own start; never decreases.
  [[nodiscard]] std::uint64_t too_late() const noexcept { return too_late_; }

 private:
  void gather(core::LaneExecutive& lane) noexcept;
  /// At least a fifth of its pixels says something, and not all the same as in the image before: a camera
  /// without noise is stuck.
  [[nodiscard]] bool is_usable(std::size_t camera, const firmware_if::DepthFrame& frame) noexcept;
  void publish(MonotonicTime due) noexcept;
  void choose_site() noexcept;
  void judge() noexcept;
  /// False if there is nothing to hand over, or it is too late for it.
  bool hand_over(const core::LaneExecutive& lane) noexcept;
  /// What the flight lane flies at `now`. What was handed over counts from its start on: the report of that
  /// very frame may not be there yet.
  [[nodiscard]] const Trajectory& flown(MonotonicTime now) const noexcept;

  Config config_;
  DecisionPipeline& pipeline_;
  std::span<firmware_if::DepthCamera* const> cameras_;
  LaneMail& mail_;
  core::StaticVector<stages::PosedDepthFrame, 8> frames_;
  DecisionInput in_{};
  DecisionOutput out_{};
  std::uint64_t decisions_{0};
  std::uint64_t too_late_{0};
  std::atomic<bool> given_up_{false};
  Trajectory handed_over_{};
  DecisionReport report_{};
  std::array<MonotonicTime, 8> last_usable_{};  ///< By camera.
  std::array<std::uint64_t, 8> image_digest_{};
  std::uint64_t refusals_before_{0};
};

/// Twice in a row, so that a host which stops everything for a while does not count as a hang: a flight lane
/// that is overdue ends the run; while the decision lane is, no new trajectory is taken and the committed one
/// ends in its stop.
class WatchdogProgram final : public core::LaneProgram {
 public:
  /// Before the first frame.
  void watch(const core::LaneExecutive& flight, const core::LaneExecutive& decision) noexcept {
    flight_ = &flight;
    decision_ = &decision;
  }
  void run(core::SlotId slot, core::LaneExecutive& lane) noexcept override;
  /// Times that the decision lane hung; never decreases.
  [[nodiscard]] std::uint64_t stalls() const noexcept { return stalls_; }
  /// The slot in which it hung last.
  [[nodiscard]] std::optional<core::SlotId> stalled() const noexcept { return stalled_; }

 private:
  const core::LaneExecutive* flight_{nullptr};
  const core::LaneExecutive* decision_{nullptr};
  bool flight_late_{false};
  bool decision_late_{false};
  bool braking_{false};
  std::uint64_t stalls_{0};
  std::optional<core::SlotId> stalled_;
};

}  // namespace roborun::app
