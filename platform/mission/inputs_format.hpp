/// How the inputs of a flight, and what it did with them, stand in the messages of `/inputs`.
///
/// A message holds the records of a tenth of a second, in the order in which the lanes read them, in two parts; the first as u32
/// bytes, u32 coded bytes, a frame of zstd:
///  - u32 count, one byte of kind each; for each kind of one size the heads of its records as columns (byte 0 of all, byte 1 of all,
///    ..., each byte as its difference from the one before); of the others one by one u32 bytes, head and runs (word_coding.hpp);
///  - the bits of the words behind the heads (word_coding.hpp): kinds of one size first, one by one, then the others in order.
/// All in the byte order of x86-64 and AArch64.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "firmware_if/depth_camera.hpp"
#include "firmware_if/lidar.hpp"
#include "platform/flight/aircraft.hpp"
#include "platform/flight/goal_queue.hpp"
#include "platform/log/compression.hpp"
#include "platform/log/word_coding.hpp"

namespace roborun::mission {

enum class RecordKind : std::uint8_t {
  kFrame,  ///< A minor frame begins: its instant.
  kImu,
  kGnss,
  kBarometer,
  kOdometry,
  kHealth,
  kDepth,
  kLidar,
  kGoals,   ///< Goals given in flight.
  kGiveUp,  ///< No more decisions from here on.
  // What the flight did with them.
  kMotors,     ///< MotorsCheck of a command.
  kMotorsOff,  ///< Terminated or disarmed.
  kDecision,   ///< DecisionValues.
  kEnd,        ///< FlightTotals. The last one.
  kNearBrake   ///< The flight lane's own look made it brake: its images are not kept.
};
inline constexpr std::size_t kRecordKinds = 15;

/// Bytes of a record of each kind: least, most, and those of its head. What follows the head are words.
struct RecordSize {
  std::uint32_t least, most, head;
  log::WordLayout words{1, 1};
  [[nodiscard]] constexpr bool is_fixed() const noexcept { return least == most; }
};
inline constexpr std::uint32_t kDepthWidthAt_bytes = 4 + 8 + 4;  ///< A u16.
inline constexpr std::uint32_t kDepthHead_bytes = kDepthWidthAt_bytes + 2 + 2 + 4 * 4;
inline constexpr std::uint32_t kLidarHead_bytes = 4 + 8 + 4 + 2 * 4;
inline constexpr std::uint32_t kSampleHead_bytes = 8 + 4;  ///< Stamp, sequence.
inline constexpr std::uint32_t kGoal_bytes = 24;
/// Stages of a decision, and what is compared of each: see decision_values.hpp.
inline constexpr std::size_t kDecisionValues = 27;
inline constexpr std::array<RecordSize, kRecordKinds> kRecordSizes{
    {{8, 8, 8},
     {60, 60, kSampleHead_bytes, {8, 6}},
     {100, 100, kSampleHead_bytes, {8, 11}},
     {20, 20, kSampleHead_bytes, {8, 1}},
     {117, 117, kSampleHead_bytes + 1, {8, 13}},
     {18, 18, 18},
     {kDepthHead_bytes, kDepthHead_bytes + 1280 * 1280 * 4, kDepthHead_bytes, {4, 1}},
     {kLidarHead_bytes, kLidarHead_bytes + 256 * 4096 * 12, kLidarHead_bytes, {4, 3}},
     {kGoal_bytes, flight::GoalQueue::kMost* kGoal_bytes, 0, {8, 3}},
     {0, 0, 0},
     {12, 12, 4, {2, 4}},
     {0, 0, 0},
     {8 * kDecisionValues, 8 * kDecisionValues, 8 * kDecisionValues},
     {24, 24, 24},
     {0, 0, 0}}};

struct FlightTotals {
  std::uint64_t digest{}, minor_frames{}, decisions{};
  bool operator==(const FlightTotals&) const = default;
};

/// Of a motor command: its exact bits as a CRC-32, and its ratios to 1/kMost, for who reads a difference.
struct MotorsCheck {
  static constexpr double kMost = 255.0;
  std::uint32_t crc{};
  std::array<std::uint16_t, 4> ratio{};
  bool operator==(const MotorsCheck&) const = default;
};
[[nodiscard]] MotorsCheck check_of(const firmware_if::MotorCommand& command) noexcept;

/// One order of the fields for writing and reading: `f` is called with each.
template <typename F>
void each_field(F&& f, MonotonicTime& time) {
  std::int64_t ns = time.time_since_epoch().count();
  f(ns);
  time = MonotonicTime{Nanos{ns}};
}
template <typename F>
void each_field(F&& f, firmware_if::ImuSample& s) {
  each_field(f, s.stamp);
  f(s.sequence);
  for (double& x : s.angular_rate_B_radps) f(x);
  for (double& x : s.specific_force_B_mps2) f(x);
}
template <typename F>
void each_field(F&& f, firmware_if::GnssFix& s) {
  each_field(f, s.stamp);
  f(s.sequence);
  for (double& x : s.p_WB_m) f(x);
  for (double& x : s.v_WB_mps) f(x);
  for (double* x :
       {&s.heading_rad, &s.sigma_horizontal_m, &s.sigma_vertical_m, &s.sigma_speed_mps, &s.sigma_heading_rad})
    f(*x);
}
template <typename F>
void each_field(F&& f, firmware_if::BarometerSample& s) {
  each_field(f, s.stamp);
  f(s.sequence);
  f(s.altitude_m);
}
template <typename F>
void each_field(F&& f, firmware_if::OdometrySample& s) {
  each_field(f, s.stamp);
  f(s.sequence);
  f(s.reset_counter);
  for (double& x : s.p_OB_m) f(x);
  for (double& x : s.q_OB) f(x);
  for (double& x : s.v_OB_mps) f(x);
  for (double* x : {&s.sigma_position_m, &s.sigma_attitude_rad, &s.sigma_speed_mps}) f(*x);
}
template <typename F>
void each_field(F&& f, flight::AircraftHealth& s) {
  std::int64_t silence_ns = s.esc_silence.count();
  std::uint8_t hears_operator = s.hears_operator ? 1 : 0;
  std::uint8_t killed = s.killed ? 1 : 0;
  f(s.battery_ratio);
  f(silence_ns);
  f(hears_operator);
  f(killed);
  s = {s.battery_ratio, Nanos{silence_ns}, hears_operator != 0, killed != 0};
}
template <typename F>
void each_field(F&& f, firmware_if::DepthFrame& s) {
  each_field(f, s.stamp);
  f(s.sequence);
  f(s.width);
  f(s.height);
  f(s.tan_half_width);
  f(s.tan_half_height);
  f(s.range_m);
  f(s.range_min_m);
}
template <typename F>
void each_field(F&& f, firmware_if::LidarSweep& s) {
  each_field(f, s.stamp);
  f(s.sequence);
  f(s.range_min_m);
  f(s.range_m);
}
template <typename F>
void each_field(F&& f, MotorsCheck& check) {
  f(check.crc);
  for (std::uint16_t& ratio : check.ratio) f(ratio);
}
template <typename F>
void each_field(F&& f, FlightTotals& t) {
  for (std::uint64_t* x : {&t.digest, &t.minor_frames, &t.decisions}) f(*x);
}

/// Appends fields to a record.
class PutField {
 public:
  explicit PutField(std::string& to) : to_(to) {}
  template <typename T>
  void operator()(const T& value) {
    static_assert(std::is_arithmetic_v<T>);
    to_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }

 private:
  std::string& to_;
};

/// The sizes of records are checked when they are read: there is always enough to get.
class GetField {
 public:
  explicit GetField(std::string_view from) : from_(from) {}
  template <typename T>
  void operator()(T& value) {
    static_assert(std::is_arithmetic_v<T>);
    std::memcpy(&value, from_.data(), sizeof value);
    from_.remove_prefix(sizeof value);
  }
  [[nodiscard]] std::string_view rest() const { return from_; }

 private:
  std::string_view from_;
};

constexpr RecordKind kind_of(const firmware_if::ImuSample*) { return RecordKind::kImu; }
constexpr RecordKind kind_of(const firmware_if::GnssFix*) { return RecordKind::kGnss; }
constexpr RecordKind kind_of(const firmware_if::BarometerSample*) { return RecordKind::kBarometer; }
constexpr RecordKind kind_of(const firmware_if::OdometrySample*) { return RecordKind::kOdometry; }

/// Records on their way into a message.
class InputBatch {
 public:
  /// Ends the record whose payload is given.
  void add(RecordKind kind, std::string_view payload);
  [[nodiscard]] bool is_empty() const noexcept { return kinds_.empty(); }
  [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }
  /// The message; nothing is left.
  [[nodiscard]] std::string take();

 private:
  std::string kinds_;
  std::array<std::string, kRecordKinds> payloads_;  ///< Of kinds of one size: one after the other.
  std::string heads_, bits_;                        ///< Of the others.
  log::Compressor compressor_;
  std::size_t bytes_{0};
};

/// One record of a message; `payload` points into `InputRecords::payloads`.
struct InputRecord {
  RecordKind kind{};
  std::size_t at{}, bytes{};
};
struct InputRecords {
  std::vector<InputRecord> records;
  std::string payloads;
};
/// Throws InputError for bytes that are no message of InputBatch.
[[nodiscard]] InputRecords records_from(std::string_view message);

}  // namespace roborun::mission
