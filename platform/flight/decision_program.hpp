/// What runs in the slots of the decision lane, whether time is real or virtual.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <span>

#include "core/depth_error.hpp"
#include "core/executive/frame_table.hpp"
#include "core/executive/lane_executive.hpp"
#include "core/geometry/fence.hpp"
#include "core/memory/static_vector.hpp"
#include "firmware_if/depth_camera.hpp"
#include "firmware_if/lidar.hpp"
#include "platform/flight/decision_pipeline.hpp"
#include "platform/flight/flight_config.hpp"
#include "platform/flight/goal_queue.hpp"
#include "platform/flight/lane_mail.hpp"
#include "stages/perception/cloud_images.hpp"

namespace roborun::flight {

/// What the estimate adds to the error of an image (DepthError), as far as it matters against the map: never the error on the
/// earth, which moves map and vehicle alike.
///  - place_m, angle_rad: what the filter says of its state against what was mapped a moment ago. The first kSureWithin_m and
///    kSureWithin_rad of it are in the margins already: those were chosen with a fix of centimetres.
///  - angle_rad: the drift per metre. What is z metres away is passed z metres of flight later at the soonest, and has moved
///    against the vehicle by drift_ratio z then: as an error of direction. What is older than that was left behind, and is
///    looked at again, with fresh images, before it is flown through.
[[nodiscard]] DepthError place_error(const stages::EstimatedState& state) noexcept;
inline constexpr double kSureWithin_m = 0.06;
inline constexpr double kSureWithin_rad = 0.025;

/// An image that was not believed.
struct RefusedImage {
  std::size_t sensor{};  ///< A camera, or kMostCameras + a LiDAR.
  stages::FrameFault fault{};
};
/// How many, by sensor and FrameFault; never decrease.
using RefusedCounts =
    std::array<std::array<std::uint64_t, static_cast<std::size_t>(stages::FrameFault::kTurned) + 1>,
               kMostCameras + kMostLidars>;

class DecisionProgram final : public core::LaneProgram {
 public:
  struct Config {
    Vector3 goal_W = Vector3::Zero();  ///< The first one; others are given in flight.
    std::uint64_t seed{1};
    core::Fence fence{};
    Aabb bounds_W{};                                     ///< Of goals.
    Nanos minor_frame{core::kMinorFrame};                ///< Of the flight lane.
    std::array<DepthError, kMostCameras> depth_error{};  ///< FlightConfig::depth_error.
  };
  DecisionProgram(const Config& config, DecisionPipeline& pipeline,
                  std::span<firmware_if::DepthCamera* const> cameras, LaneMail& mail,
                  std::span<firmware_if::Lidar* const> lidars,
                  const std::array<std::uint16_t, kMostLidars>& cloud_pixels, core::Arena& arena) noexcept;
  void run(core::SlotId slot, core::LaneExecutive& lane) noexcept override;

  /// No more decisions from here on; any thread.
  void give_up() noexcept { given_up_.store(true, std::memory_order_release); }
  /// The newest decision: complete once the smoother's slot has run.
  [[nodiscard]] const DecisionOutput& output() const noexcept { return out_; }
  [[nodiscard]] std::uint64_t decisions() const noexcept { return decisions_; }
  /// So many decisions in a row, hovering on the way to the goal without anything better to do, answer it.
  static constexpr std::uint64_t kProof = 5;
  /// Of those that found no way to it, or no room at it.
  [[nodiscard]] bool has_no_way() const noexcept { return no_way_ >= kProof; }
  [[nodiscard]] bool is_goal_blocked() const noexcept { return goal_blocked_ >= kProof; }
  /// Goals in the place of those that are not answered yet (GoalQueue::give); one thread.
  [[nodiscard]] Status give_goals(std::span<const Vector3> goals_W) noexcept { return goals_.give(goals_W); }
  /// For the decision lane's thread, or between the frames of a flight in lockstep.
  [[nodiscard]] const GoalQueue& goals() const noexcept { return goals_; }
  /// Of the newest look; a sensor that was silent is not among them.
  [[nodiscard]] std::span<const RefusedImage> refused_now() const noexcept {
    return {refused_now_.begin(), refused_now_.size()};
  }
  [[nodiscard]] const RefusedCounts& refused() const noexcept { return refused_; }
  /// How often the map was dropped: what was seen lay elsewhere; never decreases.
  [[nodiscard]] std::uint64_t map_drops() const noexcept { return map_drops_; }
  /// Trajectories that came too late for their own start; never decreases.
  [[nodiscard]] std::uint64_t too_late() const noexcept { return too_late_; }

 private:
  void gather(core::LaneExecutive& lane) noexcept;
  /// Reads all sensors: frames_ are the images that may be used, and the depth's age is that of the sensor
  /// that is worst off.
  void look(const FlightReport& report, MonotonicTime now) noexcept;
  /// fault_ of what was read. Images of a camera whose disagreement with the map a turn explains are not believed. If several
  /// cameras disagree, explained or not, and none agrees, it is the estimate: the map is dropped.
  void judge_frames(bool airborne) noexcept;
  void drop_map() noexcept;
  /// Notes what became of an image: a sensor is out of use since its last image that was usable, or, if its newest ones are
  /// refused, since the first of those. A decision may take longer than the failsafe waits: one refused image is no lost sensor.
  void note(std::size_t frame, bool airborne, MonotonicTime now) noexcept;
  /// The sensor that is worst off, for the failsafe.
  void report_depth(MonotonicTime now) noexcept;
  /// Adds the newest images of all cameras, or those of a LiDAR's newest sweep.
  void look_through_cameras(MonotonicTime now) noexcept;
  void look_through_lidar(std::size_t lidar, MonotonicTime now) noexcept;
  /// The vehicle's pose then. False: nobody knows it; if only because states were missing then, that is no fault of a sensor whose image
  /// is in time: silence has a condition of its own (Condition::kGnss).
  [[nodiscard]] bool place(std::size_t sensor, MonotonicTime stamp, MonotonicTime now, Pose& X_WB) noexcept;
  void publish(MonotonicTime due) noexcept;
  /// The estimate's share of what the map keeps away from what it saw: see place_error().
  void blur(const stages::EstimatedState& state) noexcept;
  void choose_site() noexcept;
  void judge() noexcept;
  /// The goal of this decision.
  [[nodiscard]] const Vector3& choose_goal(MonotonicTime now, const FlightReport& report) noexcept;
  /// False if it is too late for it.
  bool hand_over(const Trajectory& trajectory, bool is_stop, const core::LaneExecutive& lane) noexcept;
  /// What the flight lane flies at `now`. What was handed over counts from its start on: the report of that
  /// very frame may not be there yet.
  [[nodiscard]] const Trajectory& flown(MonotonicTime now) const noexcept;

  Config config_;
  GoalQueue goals_;
  DecisionPipeline& pipeline_;
  core::StaticVector<firmware_if::DepthCamera*, kMostCameras> cameras_;
  LaneMail& mail_;
  core::StaticVector<firmware_if::Lidar*, kMostLidars> lidars_;
  std::array<std::optional<stages::CloudImages>, kMostLidars> clouds_{};
  core::StaticVector<stages::PosedDepthFrame, kMostImages> frames_;
  std::array<std::size_t, kMostImages> sensor_of_{};  ///< By frame: a camera, or kMostCameras + a LiDAR.
  DecisionInput in_{};
  DecisionOutput out_{};
  std::uint64_t decisions_{0};
  std::uint64_t too_late_{0};
  std::uint64_t no_way_{0};        ///< Decisions in a row ...
  std::uint64_t goal_blocked_{0};  ///< ... and these.
  std::atomic<bool> given_up_{false};
  Trajectory handed_over_{};
  DecisionReport report_{};
  stages::FrameGuard guard_{};
  std::array<MonotonicTime, kMostCameras + kMostLidars> last_usable_{};  ///< By sensor: see note().
  std::array<stages::FrameFault, kMostCameras + kMostLidars>
      last_fault_{};                                     ///< The same, of its newest image.
  std::array<stages::FrameFault, kMostImages> fault_{};  ///< By frame.
  core::StaticVector<RefusedImage, kMostImages> refused_now_;
  RefusedCounts refused_{};
  std::uint64_t map_drops_{0};
  std::uint64_t refusals_before_{0};
  std::uint32_t map_number_{0};  ///< EstimatedState::map_number of what is in the map.
};

}  // namespace roborun::flight
