/// The inputs of a flight on their way into its log: every input that crossed the boundary (`firmware_if`), in the order in
/// which the lanes read it, and what they did with it. Faults of sensors, battery, link, ESCs, bus, kill switch and wind are in what
/// was read; faults of the computer itself (cpu, planner, map) are no input: the log of such a flight holds none.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/record/state_hash.hpp"
#include "firmware_if/depth_camera.hpp"
#include "firmware_if/lidar.hpp"
#include "platform/flight/aircraft.hpp"
#include "platform/flight/decision_pipeline.hpp"
#include "platform/log/flight_log.hpp"
#include "platform/mission/inputs_format.hpp"
#include "platform/mission/mission_config.hpp"
#include "stages/perception/occupancy_map.hpp"

namespace roborun::mission {

/// What a flight did: every motor command, "motors off" and decision as they came, the map in the end.
class FlightDigest {
 public:
  void add(const firmware_if::MotorCommand& command) noexcept;
  void add(const flight::DecisionOutput& decision) noexcept;
  void add_motors_off() noexcept;
  [[nodiscard]] std::uint64_t value(const stages::OccupancyMap& map) const noexcept;

 private:
  core::StateHash hash_;
};

/// Empty, or why a flight cannot be flown again from inputs alone.
[[nodiscard]] std::string why_not_replayed(const MissionConfig& config);

/// Stands between a flight and its aircraft and cameras, and writes what passes into `log`, which outlives it.
class FlightRecorder final : private flight::Aircraft {
 public:
  FlightRecorder(log::FlightLog& log, flight::Aircraft& aircraft,
                 std::span<firmware_if::DepthCamera* const> cameras,
                 std::span<firmware_if::Lidar* const> lidars = {});

  /// What is left, of a flight that was broken off.
  ~FlightRecorder() override { flush(); }
  FlightRecorder(const FlightRecorder&) = delete;
  FlightRecorder& operator=(const FlightRecorder&) = delete;

  [[nodiscard]] flight::Aircraft& aircraft() noexcept { return *this; }
  [[nodiscard]] std::span<firmware_if::DepthCamera* const> cameras() noexcept { return cameras_; }
  [[nodiscard]] std::span<firmware_if::Lidar* const> lidars() noexcept { return lidars_; }
  void decided(const flight::DecisionOutput& decision) noexcept;
  void braked() noexcept { add(RecordKind::kNearBrake); }
  void gave_up() noexcept { add(RecordKind::kGiveUp); }
  void gave_goals(std::span<const Vector3> goals_W) noexcept;
  /// What is left, and the totals. Nothing may follow.
  void finish(const stages::OccupancyMap& map) noexcept;

 private:
  template <typename Device, typename Sample>
  class Tap;
  class TappedCamera;
  class TappedLidar;
  class TappedMotors;

  void begin_frame(MonotonicTime now) noexcept override;
  [[nodiscard]] firmware_if::Imu& imu() noexcept override { return *imu_; }
  [[nodiscard]] firmware_if::Gnss& gnss() noexcept override { return *gnss_; }
  [[nodiscard]] firmware_if::Barometer& barometer() noexcept override { return *barometer_; }
  [[nodiscard]] firmware_if::Odometry* odometry() noexcept override { return odometry_.get(); }
  [[nodiscard]] firmware_if::Motors& motors() noexcept override { return *motors_; }
  [[nodiscard]] flight::AircraftHealth health(MonotonicTime now) noexcept override;
  void terminate() noexcept override;
  void disarm() noexcept override;
  void end_frame(MonotonicTime now) noexcept override { aircraft_.end_frame(now); }
  /// Ends the record that was put together since the one before.
  void add(RecordKind kind) noexcept;
  void flush() noexcept;

  log::FlightLog& log_;
  flight::Aircraft& aircraft_;
  InputBatch batch_;
  MonotonicTime batch_begin_{}, now_{};
  std::string payload_;
  FlightDigest digest_;
  FlightTotals totals_;
  std::unique_ptr<firmware_if::Imu> imu_;
  std::unique_ptr<firmware_if::Gnss> gnss_;
  std::unique_ptr<firmware_if::Barometer> barometer_;
  std::unique_ptr<firmware_if::Odometry> odometry_;  ///< Null: the aircraft has none.
  std::unique_ptr<firmware_if::Motors> motors_;
  std::vector<std::unique_ptr<firmware_if::DepthCamera>> camera_;
  std::vector<firmware_if::DepthCamera*> cameras_;
  std::vector<std::unique_ptr<firmware_if::Lidar>> lidar_;
  std::vector<firmware_if::Lidar*> lidars_;
};

}  // namespace roborun::mission
