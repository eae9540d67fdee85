/// The recording of a flight: every input that crossed the boundary (`firmware_if`), in the order in which
/// the lanes read it, and the digest of what they did with it. A file of records:
///   u32 kind | u32 bytes | payload | u64 checksum over all three and the checksum before
/// in the byte order of x86-64 and AArch64. Records: kStart (configuration as JSON), for each minor frame
/// kFrame (its instant) and the samples, health and images read in it, kGiveUp, kEnd (digest, minor frames,
/// decisions). Faults of sensors, battery, link, ESCs, bus, kill switch and wind are in what was read; faults
/// of the computer itself (cpu, planner, map) are no input, and such a flight is refused.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "core/record/state_hash.hpp"
#include "firmware_if/depth_camera.hpp"
#include "platform/app/aircraft.hpp"
#include "platform/app/camera_rig.hpp"
#include "platform/app/decision_pipeline.hpp"
#include "platform/app/mission.hpp"
#include "stages/perception/occupancy_map.hpp"

namespace roborun::app {

enum class RecordKind : std::uint32_t {
  kStart,
  kFrame,
  kImu,
  kGnss,
  kBarometer,
  kHealth,
  kDepth,
  kGiveUp,
  kEnd
};
inline constexpr std::size_t kRecordKinds = 9;

/// What a flight did: every motor command, "motors off" and decision as they came, the map in the end.
class FlightDigest {
 public:
  void add(const firmware_if::MotorCommand& command) noexcept;
  void add(const DecisionOutput& decision) noexcept;
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
/// throw sitl::InputError if the file cannot be written, or the flight has a fault that no recording holds.
class FlightRecorder final : private Aircraft {
 public:
  FlightRecorder(const std::string& path, const sitl::World& world, const MissionConfig& config,
                 Aircraft& aircraft, const std::array<firmware_if::DepthCamera*, kCameras>& cameras);

  [[nodiscard]] Aircraft& aircraft() noexcept { return *this; }
  [[nodiscard]] std::array<firmware_if::DepthCamera*, kCameras> cameras() noexcept;
  void decided(const DecisionOutput& decision) noexcept;
  void gave_up() noexcept { write(RecordKind::kGiveUp); }
  void finish(const stages::OccupancyMap& map);

 private:
  template <typename Device, typename Sample>
  class Tap;
  class TappedCamera;
  class TappedMotors;

  void begin_frame(MonotonicTime now) noexcept override;
  [[nodiscard]] firmware_if::Imu& imu() noexcept override;
  [[nodiscard]] firmware_if::Gnss& gnss() noexcept override;
  [[nodiscard]] firmware_if::Barometer& barometer() noexcept override;
  [[nodiscard]] firmware_if::Motors& motors() noexcept override;
  [[nodiscard]] AircraftHealth health(MonotonicTime now) noexcept override;
  void terminate() noexcept override;
  void disarm() noexcept override;
  void end_frame(MonotonicTime now) noexcept override { aircraft_.end_frame(now); }
  /// Ends the record that was put together since the one before.
  void write(RecordKind kind) noexcept;

  std::string path_;
  std::ofstream file_;
  Aircraft& aircraft_;
  std::vector<std::byte> payload_;
  std::uint64_t checksum_{0};
  FlightDigest digest_;
  FlightTotals totals_;
  std::unique_ptr<firmware_if::Imu> imu_;
  std::unique_ptr<firmware_if::Gnss> gnss_;
  std::unique_ptr<firmware_if::Barometer> barometer_;
  std::unique_ptr<firmware_if::Motors> motors_;
  std::array<std::unique_ptr<firmware_if::DepthCamera>, kCameras> camera_;
};

/// Reads a recording, record by record. Whatever is wrong with the file becomes one line.
class Recording {
 public:
  /// Reads the configuration. Throws sitl::InputError.
  explicit Recording(const std::string& path);

  [[nodiscard]] const MissionConfig& config() const noexcept { return config_; }
  /// Bounds, start and goal, no obstacles.
  [[nodiscard]] const sitl::World& world() const noexcept { return *world_; }
  [[nodiscard]] RecordKind kind() const noexcept { return kind_; }
  [[nodiscard]] std::span<const std::byte> payload() const noexcept { return payload_; }
  /// On to the next record. At the end and in a broken file nothing follows: kind() is kEnd.
  void next() noexcept;
  /// Empty, or what is wrong with the file and where.
  [[nodiscard]] const std::string& error() const noexcept { return error_; }
  /// Of the recorded flight. Only at the end.
  [[nodiscard]] FlightTotals totals() const noexcept;

 private:
  void read_record();
  void break_off(const std::string& why);

  std::string path_;
  std::ifstream file_;
  std::uint64_t position_{0};
  std::uint64_t checksum_{0};
  RecordKind kind_{};
  std::vector<std::byte> payload_;
  std::string error_;
  MissionConfig config_;
  std::unique_ptr<sitl::World> world_;
};

struct ReplayResult {
  FlightTotals recorded, replayed;
  double seconds{};  ///< Of the flight.
  /// Of the replayed flight: the minor frame in which it first wanted other inputs than the recorded one.
  std::uint64_t diverged_in{};
  [[nodiscard]] bool same() const noexcept { return diverged_in == 0 && recorded == replayed; }
};

/// Flies on recorded inputs alone, through the same executive, programs and stages. Throws sitl::InputError
/// for a file that is no recording, is cut off or was changed. `progress` (may be empty) gets the seconds
/// done, once a second of flight.
[[nodiscard]] ReplayResult replay_flight(const std::string& path,
                                         const std::function<void(double)>& progress);

}  // namespace roborun::app
