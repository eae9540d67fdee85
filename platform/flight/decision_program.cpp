#include "platform/flight/decision_program.hpp"

#include <algorithm>

#include "core/geometry/camera_pose.hpp"
#include "core/random/counter_rng.hpp"
#include "platform/flight/camera_watch.hpp"
#include "platform/flight/landing_site.hpp"

namespace roborun::flight {

using core::SlotId;
using governor::Action;

namespace {

constexpr int kReportDelay = 4;            // minor frames at most, from a commit to its report
constexpr Nanos kIdlePeriod{100'000'000};  // of reports while there is nothing to decide
constexpr double kHover_mps = 0.3;
constexpr Nanos kLatestStop{20'000'000};  // 12 cm at 6 m/s

}  // namespace

DecisionProgram::DecisionProgram(const Config& config, DecisionPipeline& pipeline,
                                 std::span<firmware_if::DepthCamera* const> cameras, LaneMail& mail,
                                 std::span<firmware_if::Lidar* const> lidars,
                                 const std::array<std::uint16_t, kMostLidars>& cloud_pixels,
                                 core::Arena& arena) noexcept
    : config_(config),
      goals_({config.bounds_W, config.fence, pipeline.radius_m()}, config.goal_W),
      pipeline_(pipeline),
      mail_(mail) {
  for (firmware_if::DepthCamera* camera : cameras) (void)cameras_.push_back(camera);
  for (firmware_if::Lidar* lidar : lidars) (void)lidars_.push_back(lidar);
  for (std::size_t i = 0; i < kMostLidars; ++i)
    if (cloud_pixels[i] > 0) clouds_[i].emplace(stages::CloudImages::Config{cloud_pixels[i]}, arena);
}

void DecisionProgram::publish(MonotonicTime due) noexcept {
  report_.heard = true;
  report_.due = due;
  mail_.decision.draft() = report_;
  mail_.decision.publish();
}

void DecisionProgram::choose_site() noexcept {
  const FlightReport& report = mail_.report.read();
  if (report.action != Action::kLand || !report.standing || report_.site_known) return;
  const auto site_W =
      landing_site_W(pipeline_.view(), config_.fence, in_.p_WB, report.ground_m, pipeline_.radius_m());
  report_.site_known = site_W.has_value();
  if (site_W) report_.site_W = *site_W;
}

void DecisionProgram::judge() noexcept {
  const bool answer = out_.planner_status == Status::kNoPath || out_.planner_status == Status::kGoalBlocked;
  // On the way home even "no way" is a failure: nothing else will bring it down.
  const bool fine = out_.smoother_status == Status::kOk || report_.site_known || in_.climbing ||
                    (answer && mail_.report.read().action != Action::kReturn);
  report_.failures = fine ? 0 : report_.failures + 1;
  const bool hovers =
      mail_.report.read().action == Action::kGoOn && !in_.climbing && in_.v_WB.norm() < kHover_mps;
  no_way_ = hovers && out_.ways_status == Status::kNoPath ? no_way_ + 1 : 0;
  const bool stays = hovers && out_.kind != DecisionKind::kNew;
  goal_blocked_ =
      stays && (out_.ways_status == Status::kGoalBlocked || out_.planner_status == Status::kGoalBlocked)
          ? goal_blocked_ + 1
          : 0;
  const std::uint64_t refusals = pipeline_.map().refusals();
  report_.map_refusals = refusals > refusals_before_ ? report_.map_refusals + 1 : 0;
  refusals_before_ = refusals;
}

bool DecisionProgram::place(std::size_t sensor, MonotonicTime stamp, MonotonicTime now, Pose& X_WB) noexcept {
  constexpr Nanos kSilent{20'000'000};
  const FlightReport& report = mail_.report.read();
  if (report.past.pose_at(stamp, X_WB) == Status::kOk) return true;
  const bool in_time =
      stamp <= now + stages::FrameGuard::kStampSpread && now <= stamp + stages::FrameGuard::kStampSpread;
  const bool silent_then = report.past.at(stamp) != nullptr;
  const bool silent_since = stamp > report.state.stamp && now - report.state.stamp > kSilent;
  if (in_time && (silent_then || silent_since)) last_usable_[sensor] = std::max(last_usable_[sensor], stamp);
  return false;
}

void DecisionProgram::look_through_cameras(MonotonicTime now) noexcept {
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    stages::PosedDepthFrame posed;
    Pose X_WB;
    if (cameras_[i]->read(posed.frame) != Status::kOk || !place(i, posed.frame.stamp, now, X_WB)) continue;
    posed.X_WC = core::camera_pose(X_WB, cameras_[i]->mount());
    posed.error = config_.depth_error[i];
    posed.p_BC_W = posed.X_WC.p_RT - X_WB.p_RT;
    sensor_of_[frames_.size()] = i;
    (void)frames_.push_back(posed);
  }
}

void DecisionProgram::look_through_lidar(std::size_t lidar, MonotonicTime now) noexcept {
  firmware_if::LidarSweep sweep;
  Pose X_WB;
  if (!clouds_[lidar] || lidars_[lidar]->read(sweep) != Status::kOk ||
      !place(kMostCameras + lidar, sweep.stamp, now, X_WB))
    return;
  const Pose X_WL = core::camera_pose(X_WB, lidars_[lidar]->mount());
  const Vector3 p_BL_W = X_WL.p_RT - X_WB.p_RT;
  stages::CloudImages& images = *clouds_[lidar];
  if (images.make({sweep.points_L_m, sweep.stamp, sweep.range_m, X_WL, p_BL_W, sweep.range_min_m}) !=
      Status::kOk)
    return;
  for (const stages::PosedDepthFrame& posed : images.frames()) {
    sensor_of_[frames_.size()] = kMostCameras + lidar;
    (void)frames_.push_back(posed);
  }
}

DepthError place_error(const stages::EstimatedState& state) noexcept {
  return {.constant_m = 0.0,
          .quadratic_per_m = 0.0,
          .place_m = std::max(state.map_sigma_m - kSureWithin_m, 0.0),
          .angle_rad = std::max(state.map_sigma_rad - kSureWithin_rad, 0.0) + state.drift_ratio};
}

void DecisionProgram::blur(const stages::EstimatedState& state) noexcept {
  const DepthError more = place_error(state);
  for (stages::PosedDepthFrame& posed : frames_) {
    posed.error.place_m += more.place_m;
    posed.error.angle_rad += more.angle_rad;
  }
}

void DecisionProgram::judge_frames(bool airborne) noexcept {
  // The same judge as in point cloud and map: what it refuses counts as not seen, for the failsafe too.
  guard_.begin({frames_.begin(), frames_.size()});
  std::array<bool, kMostImages> turned{};
  int disagree = 0, agree = 0;
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    fault_[i] = guard_.judge(frames_[i]);
    if (!airborne || fault_[i] != stages::FrameFault::kNone || frames_[i].is_cloud) continue;
    const Agreement agreement = agreement_of(frames_[i], pipeline_.view());
    turned[i] = agreement == Agreement::kTurned;
    disagree += turned[i] || agreement == Agreement::kDisagrees ? 1 : 0;
    agree += agreement == Agreement::kAgrees ? 1 : 0;
  }
  if (disagree > 1 && agree == 0) return drop_map();
  for (std::size_t i = 0; i < frames_.size(); ++i)
    if (turned[i]) fault_[i] = stages::FrameFault::kTurned;
}

void DecisionProgram::drop_map() noexcept {
  pipeline_.forget();
  ++map_drops_;
}

void DecisionProgram::note(std::size_t frame, bool airborne, MonotonicTime now) noexcept {
  const std::size_t sensor = sensor_of_[frame];
  const stages::PosedDepthFrame& posed = frames_[frame];
  const bool usable = fault_[frame] == stages::FrameFault::kNone;
  const bool was_fine = last_fault_[sensor] == stages::FrameFault::kNone;
  last_fault_[sensor] = fault_[frame];
  // On the ground and close to it a camera may see nothing: all of it is nearer than its least range, which a product has
  // whatever the frame says.
  const bool may_be_dark = !airborne && (posed.frame.range_min_m > 0.0F || posed.error.dark_sky);
  if (usable || may_be_dark)
    last_usable_[sensor] = posed.frame.stamp;
  else if (was_fine)
    last_usable_[sensor] = now;
  if (usable) return;
  (void)refused_now_.push_back({sensor, fault_[frame]});
  ++refused_[sensor][static_cast<std::size_t>(fault_[frame])];
}

void DecisionProgram::report_depth(MonotonicTime now) noexcept {
  report_.depth_age_s = 0.0;
  const auto consider = [&](std::size_t sensor) {
    const double age_s = seconds(now - last_usable_[sensor]);
    if (age_s <= report_.depth_age_s) return;
    report_.depth_age_s = age_s;
    report_.depth_sensor = static_cast<std::uint8_t>(sensor);
    report_.depth_fault = last_fault_[sensor];
  };
  report_.refused = 0;
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    consider(i);
    if (last_fault_[i] != stages::FrameFault::kNone) report_.refused |= 1U << i;
  }
  for (std::size_t i = 0; i < lidars_.size(); ++i) consider(kMostCameras + i);
}

void DecisionProgram::look(const FlightReport& report, MonotonicTime now) noexcept {
  report_.looked = now;
  frames_.clear();
  look_through_cameras(now);
  for (std::size_t i = 0; i < lidars_.size(); ++i) look_through_lidar(i, now);
  blur(report.state);
  judge_frames(report.airborne);
  std::size_t kept = 0;
  in_.scans.clear();
  refused_now_.clear();
  std::array<std::size_t, 1 + kMostLidars> scan{};
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    const std::size_t sensor = sensor_of_[i];
    note(i, report.airborne, now);
    if (fault_[i] != stages::FrameFault::kNone) continue;
    ++scan[sensor < kMostCameras ? 0 : 1 + sensor - kMostCameras];
    frames_[kept++] = frames_[i];
  }
  frames_.truncate(kept);
  for (const std::size_t images : scan)
    if (images > 0) (void)in_.scans.push_back(images);
  report_depth(now);
}

void DecisionProgram::gather(core::LaneExecutive& lane) noexcept {
  (void)mail_.report.take();
  const FlightReport& report = mail_.report.read();
  const stages::EstimatedState& state = report.state;
  if (given_up_.load(std::memory_order_acquire) || !report.flying || !report.estimated) {
    // Nobody waits for it: decisions have not begun, or are over.
    last_usable_.fill(lane.release());
    publish(lane.release() + kIdlePeriod);
    lane.end_frame();
    return;
  }
  if (state.map_number != map_number_) {
    drop_map();
    map_number_ = state.map_number;
  }
  look(report, lane.release());
  publish(lane.release() + kIdlePeriod);
  if (frames_.empty()) {
    lane.set_period(4 * core::kMinorFrame);
    lane.end_frame();
    return;
  }
  in_.now = lane.release();
  in_.frames = {frames_.begin(), frames_.size()};
  in_.committed = &flown(lane.release());
  in_.climbing = !report.airborne;
  in_.p_WB = state.p_WB;
  in_.v_WB = state.v_WB;
  const Vector3& goal_W = choose_goal(lane.release(), report);
  in_.goal_W = report.action == Action::kReturn ? report.home_W
               : report.action == Action::kLand ? state.p_WB  // close looks, slow
                                                : Vector3(goal_W - state.shift_W);
  in_.seed = core::mix64(config_.seed * 1000003ULL + ++decisions_);
}

const Vector3& DecisionProgram::choose_goal(MonotonicTime now, const FlightReport& report) noexcept {
  const stages::EstimatedState& state = report.state;
  const Vector3 p_WB = state.p_WB + state.shift_W;  // where goals are given
  bool other = goals_.take(now, p_WB);
  if (!other && report.airborne && report.action == Action::kGoOn) {
    const bool reached = is_at_goal((goals_.now_W() - p_WB).norm(), state.v_WB.norm());
    if (reached || is_goal_blocked() || has_no_way())
      other = goals_.next(reached             ? GoalAnswer::kReached
                          : is_goal_blocked() ? GoalAnswer::kBlocked
                                              : GoalAnswer::kNoWay,
                          now, p_WB);
  }
  if (other) no_way_ = goal_blocked_ = 0;
  return goals_.now_W();
}

const Trajectory& DecisionProgram::flown(MonotonicTime now) const noexcept {
  const Trajectory& reported = mail_.report.read().committed;
  const bool newer = handed_over_.start_time > reported.start_time && handed_over_.start_time <= now &&
                     now - handed_over_.start_time <= kReportDelay * config_.minor_frame;
  return newer ? handed_over_ : reported;
}

bool DecisionProgram::hand_over(const Trajectory& trajectory, bool is_stop,
                                const core::LaneExecutive& lane) noexcept {
  // Too late for its own start: the vehicle already flies its braking tail, and the result is of no use. A
  // stop is still better a little late; after a stall it would begin where the vehicle is no more.
  const Nanos latest = is_stop ? kLatestStop : Nanos{0};
  if (trajectory.start_time + latest < lane.now()) {
    ++too_late_;
    return false;
  }
  handed_over_ = trajectory;
  mail_.offer.draft() = {trajectory, is_stop};
  mail_.offer.publish();
  return true;
}

void DecisionProgram::run(SlotId slot, core::LaneExecutive& lane) noexcept {
  if (slot == SlotId::kGather) return gather(lane);
  if (slot == SlotId::kHandOver) {
    if (out_.kind != DecisionKind::kKeep)
      (void)hand_over(out_.trajectory, out_.kind == DecisionKind::kBrake, lane);
    return;
  }
  const auto stage =
      static_cast<core::StageId>(static_cast<int>(slot) - static_cast<int>(SlotId::kPointCloud));
  if (slot == SlotId::kPlanner) {
    choose_site();
    if (report_.site_known) in_.goal_W = report_.site_W;
  }
  pipeline_.run(stage, in_, out_);
  if (slot == SlotId::kMap && out_.early_stop && hand_over(*out_.early_stop, true, lane))
    in_.committed = &handed_over_;
  if (slot == SlotId::kSmoother) {
    report_.gaze_target = out_.gaze_target;
    judge();
  }
  if (slot == SlotId::kGovernor || slot == SlotId::kSmoother)
    publish(lane.release() + out_.decision.point.deadline);
  // The planner may find that less is left to do than was expected.
  if (slot == SlotId::kGovernor || slot == SlotId::kSmoother) lane.set_period(out_.decision.point.deadline);
}

}  // namespace roborun::flight
