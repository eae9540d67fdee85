/// Turns what the stages observed into what they may spend: time budget, operating point, speed limit, one
/// decision at a time. Source: RoboRun section "Governor".
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <numbers>

#include "core/executive/cost_profile.hpp"
#include "core/operating_point.hpp"
#include "core/space_profile.hpp"
#include "core/vehicle_model.hpp"
#include "governor/budget/time_budget.hpp"
#include "governor/models/latency_model.hpp"
#include "governor/policy/decision_policy.hpp"

namespace roborun::governor {

/// The three designs that are compared.
enum class Design : std::uint8_t {
  kAware,       ///< Everything is set anew at every decision.
  kStatic,      ///< The published baseline: 0.3 m, 46,000 / 150,000 / 150,000 m3, 0.5 m/s.
  kStaticFair,  ///< The same knobs; its speed comes from the same safety formula as the aware design's.
};
[[nodiscard]] const char* to_string(Design design) noexcept;

/// What a flight is to save.
enum class Aim : std::uint8_t {
  kTime,    ///< As fast as is safe.
  kEnergy,  ///< No faster than the speed that spends least per metre (core/energy_model.hpp).
};
[[nodiscard]] const char* to_string(Aim aim) noexcept;

/// The extra rules beyond Eq. 3: one field per rule.
struct Policy {
  /// A frame taken at t0 gives a trajectory that takes over at t0 + T and should last until its successor
  /// does, at t0 + 2 T. Measured, 1.5 flies fastest: the next budget is counted from a newer frame. (The
  /// authors' code divides by 2.) [1, 10]: below 1 the answer comes after the time it is for.
  double decisions_per_budget{1.5};
  /// No decision shorter than this, nor than the precision that the space asks for takes, if that is at most `fine_within`. > 0.
  Nanos shortest{100'000'000};
  /// The same while something moves nearby: how it moves is told from where it is in two decisions. > 0.
  Nanos shortest_in_motion{200'000'000};
  /// More thinking than this makes flight slower, not better, unless the precision that the space asks for
  /// takes longer. >= shortest.
  Nanos longest{100'000'000};
  Nanos longest_budget{15'000'000'000};  ///< The authors' cap: what a standing vehicle is given. >= longest.
  /// From this many failed decisions on, one level finer for each; after two at the finest anew, if those are dear. [1, 100]
  int failures_until_finer{2};
  /// So many decisions may fail on a narrow way before its finest cells count as one try among others. [0, 100]
  int narrow_tries{6};
  /// Cells finer than the space asks for are taken where a decision with them takes no longer than this; after failures and on
  /// narrow ways, than twice this. > 0.
  Nanos fine_within{200'000'000};
  int coarser_levels_per_decision{1};  ///< Precision is lost slowly and won at once. [1, kPrecisionLevels]
  /// At least so many cells between the vehicle and the nearest obstacle. [1, 100]
  double cells_to_obstacle{2.0};
  double planner_share{0.4};  ///< Of the perceived space, what a plan through it explores at most. (0, 1]
  /// With cells finer than the published ones a decision has to process this much, what is nearest (about 5 m around), and
  /// more only where there is time: they are for the narrow place that it flies in. (0, 1e9]
  double fine_volume_m3{500.0};
  double near_goal_m{8.0};          ///< Nearer than this: at most 0.6 m cells [0, 1000] ...
  double near_goal_speed_mps{2.5};  ///< ... and this speed. (0, 30]
  /// While something moves nearby: no longer thinking than precision asks for, and this speed. At 2.5 m/s,
  /// and without stopping at once what is faster, 8 of 40 crossings ended in a collision. (0, 30]
  double motion_speed_mps{1.2};
  /// Among thin things: no slower than this, whatever GovernorConfig::thin_step_m says. Of 24 flights with 0.5 four did
  /// not arrive, of 35 with 0.8 all. (0, 30]
  double thin_speed_mps{0.8};
  double reserve_ratio{0.06};  ///< Share of the deadline that is not planned for. [0, 0.5]
  [[nodiscard]] Status validate() const noexcept;
};

struct GovernorConfig {
  Design design{Design::kAware};
  Policy policy{};
  StoppingModel stopping{kSitlQuadrotorStopping};
  KnobArray<LatencyModel> model{};
  double point_cloud_s{};  ///< Fixed costs of the other stages. Each [0, 1e6].
  double governor_s{};     ///< 0 for the static designs: they have none.
  double smoother_s{};
  double v_max_mps{
      VehicleModel{}.speed_mps};  ///< RoboRun Table "Knob values"; the static design's is 0.5. (0, 30]
  /// The speed that spends least per metre: flight is no faster. +infinity: of no interest. > 0.
  double cheapest_mps{std::numeric_limits<double>::infinity()};
  /// Among thin things, the way from one look to the next on which the thinnest one is surely seen. (0, 1e3]
  double thin_step_m{1e3};
  double vehicle_width_m{2.0 * VehicleModel{}.radius_m};  ///< (0, 20]
  /// The most that the cameras can see between the height limits. (0, 1e9]
  double sensor_volume_max_m3{60e3};
  PrecisionLattice lattice{};
  int coarsest_level{3};  ///< Cells must fit several times into the flight band. [0, kPrecisionLevels)
  /// static-fair: the worst visibility of the congested zones (authors: 8 to 10 m). (0, 1000]
  double design_visibility_m{10.0};
  Nanos minor_frame{2'500'000};  ///< > 0.
  [[nodiscard]] Status validate() const noexcept;
};

/// The policy that ships. One instance per vehicle. RT-safe: O(1), no allocation.
class Governor final : public DecisionPolicy {
 public:
  /// Precondition, asserted: config.validate() is kOk.
  explicit Governor(const GovernorConfig& config) noexcept { configure(config); }
  /// From the next decision on by these limits; what it has learnt of the stages' times stays. The same precondition.
  void configure(const GovernorConfig& config) noexcept;

  [[nodiscard]] Decision decide(const SpaceProfile& profile, const Situation& situation) noexcept override;
  void observe(core::StageId id, double predicted_s, double spent_s) noexcept override;
  /// Largest v with (visible - d_stop(v)) / (decisions_per_budget * v) >= latency; 0 if none. Closed form.
  [[nodiscard]] double safe_speed_mps(double visible_m, double latency_s) const noexcept;
  struct SpeedLimit {
    double speed_mps;
    SpeedSource source;
  };
  /// Returns how fast the next trajectory may be in this situation, with decisions of this length, and what sets that.
  [[nodiscard]] SpeedLimit speed_limit(const Situation& situation, double deadline_s) const noexcept;
  /// Speed limit of the static designs; the aware design's upper bound.
  [[nodiscard]] double v_max_mps() const noexcept override { return v_max_mps_; }

 private:
  struct Task;
  struct Precision;

  [[nodiscard]] Decision decide_static(const SpaceProfile& profile) const noexcept;

  // The steps of decide().
  /// The level whose cells are nearest to the published finest one: what finds nothing there, and it alone, is worth less.
  [[nodiscard]] int published_level() const noexcept {
    return config_.lattice.coarsest_level_within(std::numbers::sqrt2 * kPublishedCell_m);
  }
  [[nodiscard]] int asked_level(const Task& task, Decision& decision) const noexcept;
  [[nodiscard]] double deadline_s(const Task& task, int asked_level, Decision& decision) const noexcept;
  [[nodiscard]] Precision in_time(const Task& task, int asked_level, double deadline_s) const noexcept;
  [[nodiscard]] SolverProblem problem_of(const Task& task, const Precision& precision, double deadline_s,
                                         double plan_m3) const noexcept;

  /// Levels finer than asked for after so many failed decisions.
  [[nodiscard]] int finer_levels(const Situation& situation) const noexcept;
  [[nodiscard]] bool near_goal(const Situation& situation) const noexcept;
  /// Returns how long a decision takes that processes all that is in view and around, but no more of it than this.
  [[nodiscard]] double needed_s(const Task& task, int level, double most_m3) const noexcept;
  /// Returns the same of as much as it must process at this level.
  [[nodiscard]] double least_s(const Task& task, int level) const noexcept;
  [[nodiscard]] double predicted_s(Knob knob, int level, double volume_m3) const noexcept;
  /// Returns the time of the stages that no knob governs.
  [[nodiscard]] double overhead_s() const noexcept;
  [[nodiscard]] double scale(core::StageId id) const noexcept { return scale_[id].value(); }
  void fill_prediction(Decision& decision) const noexcept;
  [[nodiscard]] Nanos whole_frames(double time_s) const noexcept;

  GovernorConfig config_;
  core::StageArray<DriftScale> scale_{};
  double v_max_mps_{};
  int last_level_{kPrecisionLevels - 1};
};

}  // namespace roborun::governor
