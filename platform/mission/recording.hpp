/// The recording of a flight: every input that crossed the boundary (`firmware_if`), in the order in which
/// the lanes read it, and the digest of what they did with it. A file of records:
///   u32 kind | u32 bytes | payload | u64 checksum over all three and the checksum before
/// in the byte order of x86-64 and AArch64. Records: kStart (configuration as JSON), for each minor frame
/// kFrame (its instant) and the samples, health, images and sweeps read in it, kGiveUp, kEnd (digest, minor frames,
/// decisions). Faults of sensors, battery, link, ESCs, bus, kill switch and wind are in what was read; faults
/// of the computer itself (cpu, planner, map) are no input, and such a flight is refused.
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
#include "platform/input/output_file.hpp"
#include "platform/mission/mission_config.hpp"
#include "stages/perception/occupancy_map.hpp"

namespace roborun::mission {

enum class RecordKind : std::uint32_t {
  kStart,
  kFrame,
  kImu,
  kGnss,
  kBarometer,
  kHealth,
  kDepth,
  kGiveUp,
  kEnd,
  kLidar,
  kOdometry
};
inline constexpr std::size_t kRecordKinds = 11;

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

struct FlightTotals {
  std::uint64_t digest{}, minor_frames{}, decisions{};
  bool operator==(const FlightTotals&) const = default;
};

/// Stands between a flight and its aircraft and cameras, and writes what passes. The constructor and finish()
/// throw InputError if the file cannot be written, or the flight has a fault that no recording holds.
class FlightRecorder final : private flight::Aircraft {
 public:
  FlightRecorder(const std::string& path, const flight::FlightConfig& flight, const MissionConfig& config,
                 flight::Aircraft& aircraft, std::span<firmware_if::DepthCamera* const> cameras,
                 std::span<firmware_if::Lidar* const> lidars = {});

  [[nodiscard]] flight::Aircraft& aircraft() noexcept { return *this; }
  [[nodiscard]] std::span<firmware_if::DepthCamera* const> cameras() noexcept { return cameras_; }
  [[nodiscard]] std::span<firmware_if::Lidar* const> lidars() noexcept { return lidars_; }
  void decided(const flight::DecisionOutput& decision) noexcept;
  void gave_up() noexcept { write(RecordKind::kGiveUp); }
  /// Throws InputError if anything could not be written so far.
  void check() const { file_.check(); }
  /// Only now the file has its name: without this call the file before stays.
  void finish(const stages::OccupancyMap& map);

 private:
  template <typename Device, typename Sample>
  class Tap;
  class TappedCamera;
  class TappedLidar;
  class TappedMotors;

  void begin_frame(MonotonicTime now) noexcept override;
  [[nodiscard]] firmware_if::Imu& imu() noexcept override;
  [[nodiscard]] firmware_if::Gnss& gnss() noexcept override;
  [[nodiscard]] firmware_if::Barometer& barometer() noexcept override;
  [[nodiscard]] firmware_if::Odometry* odometry() noexcept override { return odometry_.get(); }
  [[nodiscard]] firmware_if::Motors& motors() noexcept override;
  [[nodiscard]] flight::AircraftHealth health(MonotonicTime now) noexcept override;
  void terminate() noexcept override;
  void disarm() noexcept override;
  void end_frame(MonotonicTime now) noexcept override { aircraft_.end_frame(now); }
  /// Ends the record that was put together since the one before.
  void write(RecordKind kind) noexcept;

  input::OutputFile file_;
  flight::Aircraft& aircraft_;
  std::vector<std::byte> payload_;
  std::uint64_t checksum_{0};
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
