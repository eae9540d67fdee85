/// One decision: depth images in, a committed trajectory out. The only place where governor and stages meet.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "core/executive/frame_table.hpp"
#include "core/executive/stage_budget.hpp"
#include "core/executive/stage_meter.hpp"
#include "core/geometry/fence.hpp"
#include "core/geometry/vector.hpp"
#include "core/memory/static_vector.hpp"
#include "core/precision.hpp"
#include "core/sensor_rig.hpp"
#include "core/trajectory.hpp"
#include "core/vehicle_model.hpp"
#include "governor/policy/decision_policy.hpp"
#include "platform/flight/body_tracks.hpp"
#include "platform/flight/gaze.hpp"
#include "platform/flight/motion_watch.hpp"
#include "platform/flight/trail.hpp"
#include "platform/flight/viewpoints.hpp"
#include "stages/perception/cloud_images.hpp"
#include "stages/perception/occupancy_map.hpp"
#include "stages/perception/point_cloud.hpp"
#include "stages/perception/space_profiler.hpp"
#include "stages/planning/planner.hpp"
#include "stages/planning/smoother.hpp"
#include "stages/planning/ways.hpp"

namespace roborun::flight {

struct PipelineConfig {
  Aabb flight_bounds_W{};  ///< The vehicle's centre stays inside.
  VehicleModel vehicle{};
  /// The sensors together see every direction; false: what they do not see may be anything.
  bool sees_all_around{true};
  bool turns{};                  ///< GazeConfig::follows: it sees where it looks.
  double level_view_ratio{1.0};  ///< FlightConfig::level_view_ratio.
  double too_near_m{};           ///< FlightConfig::too_near_m.
  PrecisionLattice lattice{};
  double horizon_m{24.0};  ///< No way-point farther than this: one metre less than the cameras see.
  core::Fence fence{};     ///< What it forbids is occupied for planner and smoother.
  Nanos minor_frame{core::kMinorFrame};  ///< Of the flight lane: no stop takes over sooner.
  bool stops_straight{};                 ///< FlightConfig::stops_straight.
  Aabb map_bounds_W{};  ///< What the map stores; its heights limit what counts as seen volume.
};

/// Images of one decision: each camera's, and six of each LiDAR's cloud.
inline constexpr std::size_t kMostImages = kMostCameras + kMostLidars * stages::CloudImages::kImages;

struct DecisionInput {
  MonotonicTime now{};  ///< Start of the decision.
  std::span<const stages::PosedDepthFrame> frames{};
  /// How many of the frames, in their order, go into the map together; empty: all. A cloud's go alone.
  core::StaticVector<std::size_t, 1 + kMostLidars> scans{};
  const Trajectory* committed{};  ///< What the flight lane flies now.
  bool climbing{false};           ///< To the first hover: looks around as precisely as it can.
  Vector3 p_WB = Vector3::Zero();
  Vector3 v_WB = Vector3::Zero();
  Vector3 goal_W = Vector3::Zero();
  std::uint64_t seed{};
};

/// What the flight lane is to do with the result.
enum class DecisionKind : std::uint8_t {
  kKeep,   ///< Nothing better: fly on, the committed trajectory ends in a stop.
  kNew,    ///< `trajectory` takes over at its start time.
  kBrake,  ///< The committed trajectory is no longer free: `trajectory` is the stop.
};

struct DecisionOutput {
  DecisionKind kind{DecisionKind::kKeep};
  Trajectory trajectory{};
  /// Right after the map: what is flown is blocked in it, and the rest of the decision would be too long to
  /// wait. Whoever flies this stop gives it as in.committed to the stages that follow.
  std::optional<Trajectory> early_stop{};
  Status planner_status{Status::kNotReady};
  Status smoother_status{Status::kNotReady};
  SpaceProfile profile{};
  governor::Decision decision{};
  core::StageArray<core::Work> work{};
  core::StageArray<Nanos> cost{};
  Status ways_status{
      Status::kNotReady};  ///< Of Ways::look() or solve(); kNotReady: nothing remembers ways here.
  double
      way_m{};  ///< Length of the way to the goal if ways_status is kOk: what is unknown on it counts kUnknownWeight times.
  bool motion{};                            ///< Something was seen to move nearby, not long ago.
  std::optional<GazeTarget> gaze_target{};  ///< DecisionReport::gaze_target.
  Nanos latency{};  ///< Sum of the costs: when the result is there, counted from input.now.
};

/// Runs the stages in the order of the frame table, each under the budget that the governor granted it.
/// Memory: everything is taken from the arena at construction. One thread.
class DecisionPipeline {
 public:
  /// Policy, map and planner are given from outside, so that any backend flies with any design.
  DecisionPipeline(const PipelineConfig& config, core::StageMeter& meter, governor::DecisionPolicy& policy,
                   stages::PointCloud& cloud, stages::OccupancyMap& map, stages::Planner& planner,
                   stages::Smoother& smoother, stages::Ways* ways = nullptr) noexcept;

  /// One stage of a decision; all of them in order make one. `out` is begun by the first (kPointCloud) and
  /// complete after the last (kSmoother). Where the path leaves the smoother no room, kSmoother plans once
  /// more, as tight as the vehicle can fly; that time is the planner's.
  /// RT-safe: no allocation; bounded by the stages' budgets.
  void run(core::StageId id, const DecisionInput& in, DecisionOutput& out) noexcept;
  /// Nothing is known any more: what was seen lies elsewhere. To be called between decisions. What is flown is then not free, so
  /// that the next one brakes; hovering, the vehicle takes as much to be free around itself as at the top of its climb.
  void forget() noexcept;
  /// Of the map, as the planner sees it but for the fence.
  [[nodiscard]] const stages::MapView& view() const noexcept { return map_.view(); }
  [[nodiscard]] const stages::OccupancyMap& map() const noexcept { return map_; }
  /// What plans keep free around the vehicle.
  [[nodiscard]] double radius_m() const noexcept { return planned_radius_m(config_.vehicle); }

 private:
  /// The vehicle's limits, at this speed, and what it can follow of them.
  [[nodiscard]] stages::MotionLimits limits(double speed_mps) const noexcept;
  /// The quickest stop from there, as far as the vehicle can follow it.
  [[nodiscard]] Status brake(const TrajectoryPoint& start, MonotonicTime start_time,
                             Trajectory& stop) const noexcept {
    return smoother_.brake(start, start_time, limits(config_.vehicle.speed_mps), stop);
  }
  /// How what flies this trajectory from then on meets bodies, with the room that plans keep.
  [[nodiscard]] BodyTracks::Meeting meets(const Trajectory& trajectory, MonotonicTime from,
                                          core::Work& work) const noexcept;
  /// The map, with the fence around it: what is planned in.
  class Permitted;
  /// The same at its finest: what is flown is checked in it. While the vehicle leaves a place
  /// without room, the box where it is does not hold it.
  class Known;
  /// What the planner's slot leaves to the smoother's.
  struct Draft {
    bool begun{};  ///< False: nothing is planned in this decision.
    MonotonicTime takes_over{};
    TrajectoryPoint start{};     ///< Where the new trajectory begins.
    double committed_until_s{};  ///< How long what is flown stays free; +inf: to its end.
    std::optional<core::MeteredBudget> planner_budget{};
    core::Work planner_work{}, smoother_work{};
    Trajectory trajectory{};
    bool is_narrow{};  ///< With the room of slow flight.
    bool leaves{};     ///< The trajectory leaves a place without room.
    bool replaces{};   ///< What is flown meets a body, the trajectory later or not at all.
    bool dodges{};     ///< The trajectory goes aside, out of the way of a body.
    /// Nothing is better than what is flown: it comes to rest at the goal, goes aside already, or meets a body latest.
    bool keeps{};
    /// What is flown may be flown until the next decision can brake it: always, of motors of our own.
    bool stops{};
  };

  void charge(core::StageId id, const core::Work& work, DecisionOutput& out) noexcept;
  void perceive(const DecisionInput& in, DecisionOutput& out) noexcept;
  void govern(const DecisionInput& in, DecisionOutput& out) noexcept;
  void integrate(const DecisionInput& in, DecisionOutput& out) noexcept;
  /// So many pixels of this decision's images show something thin.
  void note_thin(const DecisionInput& in, std::uint32_t pixels) noexcept;
  /// Something thin was seen lately, or near here.
  [[nodiscard]] bool is_among_thin(const DecisionInput& in) const noexcept;
  /// Half edges of the box that a vehicle at the top of its climb takes to be free (IntegrationRequest).
  [[nodiscard]] Vector3 assumed_half_m(const DecisionInput& in) const noexcept;
  /// What is flown, on the map that just got its images.
  void check_committed(const DecisionInput& in, DecisionOutput& out) noexcept;
  /// The stop that takes over as soon as it can, if it stays free until `free_until` at least: a straight
  /// stop out of a descent meets the ground sooner than what it replaces.
  [[nodiscard]] std::optional<Trajectory> stop_before(const DecisionInput& in, MonotonicTime free_until,
                                                      const stages::MapView& known, core::Work& work,
                                                      Nanos latency) const noexcept;
  void export_map(const DecisionInput& in, DecisionOutput& out) noexcept;
  /// Where the vehicle stands by then, a decision need not last as long as was expected once the map is done: of what is in view holes are a part, of
  /// which nobody knows beforehand how much of it the map can take. Brings the deadline forward.
  void hasten(const DecisionInput& in, DecisionOutput& out) const noexcept;
  void plan(const DecisionInput& in, DecisionOutput& out) noexcept;
  void smooth(const DecisionInput& in, DecisionOutput& out) noexcept;
  /// What is known of the ways, from here.
  void remember(const DecisionInput& in, DecisionOutput& out) noexcept;
  /// When the vehicle would be at the goal, counted from in.now.
  [[nodiscard]] double arrival_s(const Trajectory& trajectory, const DecisionInput& in) const noexcept;
  /// One search, with this radius kept free; the path goes to kept_W_.
  void search(const DecisionInput& in, double radius_m, DecisionOutput& out) noexcept;
  /// The same to another place than the goal.
  void search_to(const Vector3& goal_W, const DecisionInput& in, double radius_m,
                 DecisionOutput& out) noexcept;
  /// The path of the last search as a trajectory.
  void fit(core::StageBudget& budget, double radius_m, double speed_mps, DecisionOutput& out) noexcept;
  /// From everywhere on it the vehicle may stop straight on, as far as its stopping model says: from `from` on until the decision
  /// after this one can brake, and while it brakes.
  [[nodiscard]] bool stops_free(const Trajectory& trajectory, MonotonicTime from, const DecisionOutput& out,
                                const stages::MapView& view, core::Work& work) const noexcept;
  /// The same of this part of it.
  [[nodiscard]] bool stops_free(const Trajectory& trajectory, MonotonicTime from, MonotonicTime until,
                                const stages::MapView& view, core::Work& work) const noexcept;
  /// Where what is flown would be kept, but stops too far (stops_free()): the same way, slower.
  void slow_down(const DecisionInput& in, const stages::MapView& known, core::StageBudget& budget,
                 DecisionOutput& out) noexcept;
  /// Slow enough for the room of slow flight, if that is less.
  [[nodiscard]] bool may_squeeze() const noexcept;
  /// The path of the last search, slowly and with the room that this takes.
  void fit_narrow(core::StageBudget& budget, DecisionOutput& out) noexcept;
  /// From the search of plan() on, with less and less room.
  void find_trajectory(const DecisionInput& in, core::StageBudget& budget, DecisionOutput& out) noexcept;
  /// Where the trajectory that was found with all room gets no nearer to the goal, slowly and with less room if that does: else the
  /// vehicle would go back and forth between two ways, on each of which only a narrow place is left.
  void squeeze_on(const DecisionInput& in, core::StageBudget& budget, DecisionOutput& out) noexcept;
  /// From rest, out of where no search has room to where `room_m` is free: slowly, with the vehicle's own radius.
  void leave(double room_m, core::StageBudget& budget, DecisionOutput& out) noexcept;
  /// The same where it is shut in: what it flew through was free, and looks of later made the surfaces there thicker. Back to where it
  /// came from, if it is nearer to the goal from there.
  void go_back(const DecisionInput& in, core::StageBudget& budget, DecisionOutput& out) noexcept;
  /// Of a vehicle that turns: where no way is found, it looks at what is unknown on the way, and after a while from elsewhere.
  void look_on(const DecisionInput& in, core::StageBudget& budget, DecisionOutput& out) noexcept;
  /// Where the known part of the way to the goal ends.
  [[nodiscard]] std::optional<Vector3> known_end_W() const noexcept;
  /// What it looks at: that place, or from there on the goal.
  [[nodiscard]] Vector3 undecided_W(const DecisionInput& in) const noexcept;
  /// Where it goes to see more, and what it looks at from there.
  struct Look {
    Vector3 from_W, at_W;
  };
  /// Whence most is seen of what is unknown around known_end_W(), or else from farther off.
  [[nodiscard]] std::optional<Look> find_look(const DecisionInput& in) noexcept;
  /// Where what was found meets a body that moves: slower, a stop, or to the side, whatever meets none, or the latest.
  void give_way(const DecisionInput& in, core::StageBudget& budget, DecisionOutput& out) noexcept;
  /// Aside, a few metres in eight directions: the one that meets nothing and ends nearest to the goal. It begins where
  /// the vehicle can stop. `best_score` is that of what is best so far (BodyTracks::Meeting).
  void dodge(const DecisionInput& in, core::StageBudget& budget, double& best_score,
             Trajectory& best) noexcept;
  /// A stop instead of what is flown, if that is too fast where something moves, or meets a body before it could stop, and
  /// the stop meets one later. What is too fast is stopped in any case, but where only the stop would be touched.
  [[nodiscard]] std::optional<Trajectory> stop_before_body(const DecisionInput& in, bool too_fast,
                                                           const stages::MapView& known, core::Work& work,
                                                           Nanos latency) const noexcept;
  /// What is flown arrives no later than the new trajectory, and does not begin to brake before the next decision can replace it.
  [[nodiscard]] bool is_kept(const DecisionInput& in, const DecisionOutput& out) const noexcept;
  /// Between the new trajectory, what is flown, and a stop.
  void choose(const DecisionInput& in, DecisionOutput& out) noexcept;
  /// What is left of the deadline for this stage, when the stages after it get what was predicted for them.
  [[nodiscard]] core::MeteredBudget budget_of(core::StageId id, const DecisionOutput& out) noexcept;
  /// For the stages that the governor does not shape: the frame table's.
  [[nodiscard]] core::MeteredBudget table_budget_of(core::StageId id) noexcept;

  static constexpr double kAtRest_mps =
      0.05;  ///< What is flown stands, and does not begin to move: m/s2, too.

  /// A stop from there takes little more than the room, and is not looked at.
  static constexpr double kCrawl_mps = 0.45;

  PipelineConfig config_;
  core::StageMeter& meter_;
  governor::DecisionPolicy& policy_;
  stages::PointCloud& cloud_;
  stages::OccupancyMap& map_;
  stages::Planner& planner_;
  stages::Smoother& smoother_;
  stages::Ways* ways_;      ///< Null: the planner knows its horizon alone.
  bool ways_known_{false};  ///< In this decision.
  stages::Path kept_W_;     ///< What was planned last.
  MotionWatch motion_;
  BodyTracks bodies_;
  bool has_planned_{false};  ///< A plan was found since the take-off.
  MonotonicTime leaves_at_ =
      MonotonicTime::min();          ///< Start of the last trajectory that leaves a place without room.
  std::optional<Vector3> left_W_{};  ///< Where that began.
  MonotonicTime dodges_at_ = MonotonicTime::min();  ///< The same of the last one that goes aside.
  Draft draft_;
  std::array<double, kPrecisionLevels> searched_s_{};  ///< By level of p1: what the planner took lately.
  std::optional<GazeTarget> gaze_target_{};            ///< Where the known way ends, or what it goes to see.
  std::optional<Look> looks_next_{};                   ///< No path to it was found yet.
  MonotonicTime blocked_since_{};  ///< Standing without a way, and the looks so far led nowhere.
  MonotonicTime back_until_{};     ///< It goes to see more: nothing else is planned.
  Viewpoints viewpoints_;
  Trail trail_;
  MonotonicTime shut_in_since_{};  ///< It stands, a way is known, and the planner answers that there is none.
  MonotonicTime thin_until_{};     ///< Something thin was seen less than kThinLasts before,
  std::optional<Vector3> thin_from_W_{};  ///< the last time from here.
  bool is_narrow_{false};                 ///< What is flown was planned so.
  /// The fastest that a plan was lately, of which a straight stop was free everywhere (stops_free()).
  double stopped_mps_ = std::numeric_limits<double>::infinity();
  int failures_{0};  ///< Decisions in a row without a trajectory.
};

}  // namespace roborun::flight
