/// Where the vehicle is: an error-state Kalman filter over IMU, odometry, GNSS and barometer.
/// Source: J. Sola, "Quaternion kinematics for the error-state Kalman filter" (2017), attitude error in the
/// world frame.
#pragma once

#include <cstdint>
#include <optional>

#include "core/geometry/vector.hpp"
#include "firmware_if/assert.hpp"
#include "firmware_if/autopilot.hpp"
#include "firmware_if/barometer.hpp"
#include "firmware_if/gnss.hpp"
#include "firmware_if/imu.hpp"
#include "firmware_if/odometry.hpp"
#include "firmware_if/status.hpp"
#include "stages/control/frame_shift.hpp"
#include "stages/control/odometry_anchor.hpp"
#include "stages/control/past_states.hpp"
#include "stages/control/witness.hpp"

namespace roborun::stages {

struct EstimatedState {
  MonotonicTime stamp{};
  Vector3 p_WB = Vector3::Zero();
  Vector3 v_WB = Vector3::Zero();
  Quaternion q_WB = Quaternion::Identity();
  Vector3 w_WB_B = Vector3::Zero();
  double
      position_sigma_m{};  ///< Largest standard deviation of the three axes, on the earth: with odometry's drift.
  /// Add to a place in W, the frame that is flown and mapped in: where satellite navigation says that it is.
  Vector3 shift_W = Vector3::Zero();
  /// Of p_WB and q_WB against what was mapped a moment ago: the largest of each three axes.
  double map_sigma_m{}, map_sigma_rad{};
  double
      drift_ratio{};  ///< By which the flown frame drifts, per metre flown; 0 where nothing but GNSS holds it.
  /// Another number: nobody knows how far the vehicle is from where what was mapped before says.
  std::uint32_t map_number{};
};

/// 15 error states: position, velocity, attitude, gyro bias, accelerometer bias. A fix that arrives late is
/// compared with the state at its own instant and its correction applied to the present: at 100 ms and these
/// rates the error of doing so is far below the receiver's noise.
///
/// Order of trust, each taking over where the one before is lost, without a jump of the state:
///  1. the IMU, always: whatever else jumps against it is not followed;
///  2. odometry, where it is heard: fixes then only say where the flown frame lies on the earth (FrameShift), the heading
///     of fixes only at the start, and the barometer nothing;
///  3. fixes, less the shift known by then, with their heading. Those coarser than kMapLost_m wander by more than a cell: their
///     speed and heading are followed, and their position moves the shift alone, so that the map stays where it is;
///  4. the barometer, for the height alone.
/// A vehicle that hears odometry for kFixPatience and no fix with a heading starts without: W is then O. Odometry that begins
/// anew (reset_counter), that comes back, or that jumps without a word is anchored where the vehicle is by then, once its
/// samples agreed for kAnchorPatience: the state and the map stay. If the state has become uncertain by more than
/// kMapLost_m meanwhile, or fixes jump against odometry and nobody knows which of both it was, map_number changes.
///
/// What was spoilt is noticed: where IMU samples are missing or leap, the covariance grows by what may have happened meanwhile; and
/// if a source agrees with itself for Witness::kPatience while the state fits neither that nor another one, the state begins anew
/// where that source says (resets, map_number). One source against the inertial sensors: nobody knows which of both was wrong, so
/// the source is believed, and the map is not. Fixes that drift against odometry faster than odometry may are not followed.
class Estimator {
 public:
  struct Config {
    double gyro_noise_radps{0.0012};    ///< One sigma a sample. (0, 1]
    double accel_noise_mps2{0.05};      ///< One sigma a sample, vibration included. (0, 10]
    double gyro_bias_walk_radps{2e-5};  ///< Per sqrt(s). (0, 1]
    double accel_bias_walk_mps2{2e-4};  ///< Per sqrt(s). (0, 1]
    double barometer_sigma_m{0.6};      ///< Noise and drift of the sensor. (0, 100]
    double gate_sigma{6.0};             ///< Innovations beyond this are refused. [3, 20]
    double drift_ratio{0.01};           ///< Of the odometry, per metre flown. (0, 0.2]
    Nanos imu_lost_after{25'000'000};   ///< Ten samples at 400 Hz.
    Nanos oldest_fix{450'000'000};      ///< What the ring of past states covers.
    [[nodiscard]] constexpr Status validate() const noexcept {
      const bool ok = gyro_noise_radps > 0 && gyro_noise_radps <= 1 && accel_noise_mps2 > 0 &&
                      accel_noise_mps2 <= 10 && gyro_bias_walk_radps > 0 && gyro_bias_walk_radps <= 1 &&
                      accel_bias_walk_mps2 > 0 && accel_bias_walk_mps2 <= 1 && barometer_sigma_m > 0 &&
                      barometer_sigma_m <= 100 && gate_sigma >= 3 && gate_sigma <= 20 && drift_ratio > 0 &&
                      drift_ratio <= 0.2 && imu_lost_after > Nanos{0} && oldest_fix > Nanos{0};
      return ok ? Status::kOk : Status::kInvalidArgument;
    }
  };
  /// Never decrease.
  struct Counters {
    std::uint64_t imu{}, gnss{}, barometer{}, odometry{};  ///< Accepted.
    std::uint64_t refused_not_finite{}, refused_stamp{}, refused_gate{};
    std::uint64_t anchored{};  ///< How often odometry began, began anew, came back or jumped.
    std::uint64_t jumps{};     ///< Of fixes, that were believed.
    std::uint64_t
        resets{};  ///< The state was poisoned: begun anew from the next fix, or from a source that agrees with itself.
    std::uint64_t clock_resets{};  ///< Of the IMU's clock, that were believed.
  };

  static constexpr Nanos kFixPatience{2'000'000'000};
  static constexpr Nanos kAnchorPatience{200'000'000};
  static constexpr Nanos kOdometryLost{500'000'000};  ///< Since the last accepted sample.
  static constexpr Nanos kLongestGap{500'000'000};
  static constexpr Nanos kClockPatience{100'000'000};
  static constexpr double kMapLost_m = 0.3;  ///< A published finest cell.

  /// Precondition, asserted: config.validate() is kOk.
  explicit Estimator(const Config& config) noexcept : config_(config), past_(config.oldest_fix) {
    ROBORUN_ASSERT(config.validate() == Status::kOk);
  }

  /// One IMU sample, in order. Refused (kInvalidArgument, kStale) if not finite, not newer than the one before or newer by more
  /// than kLongestGap, unless all others are so for kClockPatience: then the clock is another one, or the sensor is back.
  /// RT-safe: O(1), about 2 us, every fourth call 5 us more for the covariance.
  [[nodiscard]] Status predict(const firmware_if::ImuSample& sample) noexcept;
  /// A fix, possibly late. The first one, once IMU samples flow, starts the filter (at rest, level).
  /// kNotReady before.
  [[nodiscard]] Status update(const firmware_if::GnssFix& fix) noexcept;
  [[nodiscard]] Status update(const firmware_if::BarometerSample& sample) noexcept;
  /// kOk: believed. kNotReady: not yet, see above. RT-safe: O(1).
  [[nodiscard]] Status update(const firmware_if::OdometrySample& sample) noexcept;

  /// The state of an autopilot's estimator in the place of this one, carried on to `now` with its velocity and rates: for
  /// vehicles without sensors of their own; not mixed with the calls above. kStale: older than kOldestState, or the time
  /// does not rise; nothing changes. Where its frame jumps (frame_number), ours goes on, shift_W tells the difference, and
  /// map_number changes if the jump turned it, too, or nobody knows what was flown meanwhile. Without `hold_frame`, for a vehicle
  /// that stands, ours jumps with it. RT-safe: O(1).
  static constexpr Nanos kOldestState{200'000'000};
  [[nodiscard]] Status follow(const firmware_if::AutopilotState& sample, MonotonicTime now,
                              bool hold_frame) noexcept;

  /// kNotReady before the start.
  [[nodiscard]] Status state(EstimatedState& out) const noexcept;
  /// As estimated then: a late fix corrects the present only.
  [[nodiscard]] const PastStates& past() const noexcept { return past_; }
  /// True if no IMU sample came for config.imu_lost_after.
  [[nodiscard]] bool imu_lost(MonotonicTime now) const noexcept {
    return now - state_.stamp > config_.imu_lost_after;
  }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  static constexpr int kStates = 15, kPosition = 0, kVelocity = 3, kAttitude = 6, kGyroBias = 9,
                       kAccelBias = 12;
  static constexpr double kLongStep_s = 0.02;  ///< Longer than in any flight: between two samples of the IMU.
  using Covariance = Eigen::Matrix<double, kStates, kStates>;

  /// A frame of the odometry that is not believed yet.
  struct Candidate {
    OdometryAnchor anchor{};
    MonotonicTime since{};
  };
  /// What a sample of the odometry says besides what was estimated for its instant; world frame.
  struct Innovation {
    Vector3 p_m, angle_rad, v_mps;
    double sigma_p_m, sigma_rad, sigma_mps;
  };

  /// Whether the time of a sample may be so; a clock that was set is followed.
  [[nodiscard]] bool is_next(MonotonicTime stamp) noexcept;
  /// One step of the state over dt_s.
  void integrate(const Vector3& rate_B_radps, const Vector3& force_B_mps2, double dt_s) noexcept;
  /// The covariance grows by what two samples in a row leave open: time without samples, or a leap between them.
  void grow_between(const Vector3& leap_radps, const Vector3& leap_mps2, double dt_s) noexcept;
  /// While the attitude is uncertain, one measurement changes much. One that was made before the last correction does not know of
  /// it, and would have it made twice: it is left out.
  [[nodiscard]] bool is_settling(MonotonicTime stamp) noexcept;
  /// True if all of a fix was believed. `moves_alike`: fits_in_motion().
  [[nodiscard]] bool take(const firmware_if::GnssFix& fix, const PastStates::Past& then,
                          bool moves_alike) noexcept;
  /// A fix that was refused: is it right, and the state wrong?
  void weigh(const firmware_if::GnssFix& fix, const PastStates::Past& then, bool moves_alike) noexcept;
  /// Of an error state that is as uncertain as that, whatever the others are.
  void set_sigma(int index, double sigma) noexcept;
  /// The heading alone.
  void turn_again(double turn_rad, double sigma_rad) noexcept;
  /// In flight, by a witness, `age` ago.
  void begin_again(const Vector3& p_WB, const Vector3& v_WB, const Quaternion& q_WB, Nanos age) noexcept;
  void begin_again(const firmware_if::GnssFix& fix) noexcept;
  void begin_again(const firmware_if::OdometrySample& sample, const OdometryState& in_O,
                   const PastStates::Past& then) noexcept;
  [[nodiscard]] bool fits(int first, const Vector3& innovation, double sigma) const noexcept;
  [[nodiscard]] bool fits_in_motion(const firmware_if::GnssFix& fix,
                                    const PastStates::Past& then) const noexcept;
  /// Odometry agrees with itself, and the state with nothing.
  [[nodiscard]] bool is_lost_to(const firmware_if::OdometrySample& sample,
                                const OdometryState& in_O) noexcept;
  /// Of a first sample: nothing later may be refused because of it.
  [[nodiscard]] bool is_recent(MonotonicTime stamp) const noexcept {
    return stamp <= state_.stamp && state_.stamp - stamp <= config_.oldest_fix;
  }
  void start(const firmware_if::GnssFix& fix) noexcept;
  void start(const firmware_if::OdometrySample& sample, const OdometryState& in_O) noexcept;
  /// At rest in every respect but the state, which is there.
  void begin_filter() noexcept;
  /// The autopilot's frame jumped: `next` is what it says now.
  void move_frame(const EstimatedState& next, bool hold) noexcept;
  [[nodiscard]] bool follows_odometry(MonotonicTime at) const noexcept {
    return anchor_ && at - last_odometry_ <= kOdometryLost;
  }
  [[nodiscard]] static Innovation innovation_of(const firmware_if::OdometrySample& sample,
                                                const OdometryState& in_W,
                                                const PastStates::Past& then) noexcept;
  [[nodiscard]] bool fits(const Innovation& innovation) const noexcept;
  void correct_by(Innovation innovation) noexcept;
  /// Odometry that is not followed: true if it is from now on.
  bool try_anchor(const firmware_if::OdometrySample& sample, const OdometryState& in_O,
                  const PastStates::Past& then) noexcept;
  /// What a fix says of the flown frame while odometry holds it.
  [[nodiscard]] bool place_frame(const firmware_if::GnssFix& fix, const Vector3& innovation_m) noexcept;
  /// A fix that is coarser than the map's cells, without odometry: true if all of it was believed.
  [[nodiscard]] bool place_coarsely(const firmware_if::GnssFix& fix, const Vector3& dp_m,
                                    const Vector3& dv_mps, double yaw_rad) noexcept;
  /// Of three error states from `first` on.
  [[nodiscard]] double largest_sigma(int first) const noexcept;
  void propagate_covariance(double dt_s) noexcept;
  /// One scalar measurement of error state `index`; false if gated out.
  bool correct(int index, double innovation, double sigma) noexcept;
  /// All measurements of a fix, given its innovations of position and velocity and the yaw estimated then;
  /// false if one of them is gated out.
  bool correct_by(const firmware_if::GnssFix& fix, const Vector3& dp, const Vector3& dv,
                  double yaw_rad) noexcept;
  void reset_if_broken() noexcept;

  Config config_;
  Counters counters_{};
  bool started_{false};
  EstimatedState state_{};
  Vector3 gyro_bias_B_ = Vector3::Zero();
  Vector3 accel_bias_B_ = Vector3::Zero();
  Vector3 force_W_ = Vector3::Zero();
  Vector3 last_rate_B_ = Vector3::Zero();
  Vector3 last_force_B_ = Vector3::Zero();
  Vector3 mean_force_B_ = Vector3::Zero();  ///< Of 50 ms.
  MonotonicTime odd_since_{}, odd_last_{};  ///< IMU samples whose time is none that is expected.
  Covariance P_ = Covariance::Zero();
  int since_covariance_{0};
  double covariance_dt_s_{0.0};
  MonotonicTime last_gnss_{};
  MonotonicTime last_barometer_{};
  PastStates past_;
  std::optional<OdometryAnchor> anchor_;
  std::optional<Candidate> candidate_;
  MonotonicTime first_odometry_{}, last_odometry_{}, odometry_stamp_{};  ///< Heard, accepted, newest.
  FrameShift shift_;
  Witness fix_witness_, odometry_witness_;
  double last_heading_rad_{0.0},
      last_turn_rad_{0.0};  ///< Of a fix that was refused: what it said, and said besides.
  int headings_alike_{0};
  bool lost_{false};               ///< The state is none: the IMU's clock was set.
  MonotonicTime corrected_{};      ///< While settling: when last.
  MonotonicTime fix_agreed_{};     ///< The last fix that the speed and heading of the state fit.
  bool fixes_agreed_{false};       ///< Since the start: only then one that differs is a jump.
  double barometer_shift_m_{0.0};  ///< Its altitude less the height, while odometry holds that.
  bool barometer_placed_{true};
  std::uint32_t map_number_{0};
  std::uint32_t followed_frame_{0};
  Vector3 followed_shift_W_ = Vector3::Zero();  ///< From our frame to the autopilot's.
};

}  // namespace roborun::stages
