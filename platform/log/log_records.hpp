/// What a flight says to its log: records of fixed size, so that a lane may put them into a ring.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/executive/stage_budget.hpp"
#include "core/geometry/vector.hpp"

namespace roborun::log {

/// Text of at most N bytes; what does not fit is cut off. RT-safe.
template <std::size_t N>
class FixedText {
 public:
  void append(std::string_view text) noexcept {
    const std::size_t n = std::min(text.size(), N - size_);
    std::copy_n(text.data(), n, text_.data() + size_);
    size_ += n;
  }
  /// With + between.
  void add(std::string_view text) noexcept {
    if (size_ > 0) append("+");
    append(text);
  }
  [[nodiscard]] std::string_view view() const noexcept { return {text_.data(), size_}; }

 private:
  std::array<char, N> text_{};
  std::size_t size_{0};
};

using Numbers3 = std::array<double, 3>;
[[nodiscard]] inline Numbers3 numbers_of(const Vector3& v) noexcept { return {v.x(), v.y(), v.z()}; }

/// `/state`. World frame W, body frame B, SI.
struct StateRecord {
  std::int64_t time_ns{};
  Numbers3 p_WB{}, v_WB{}, w_WB_B{};
  std::array<double, 4> q_WB{1, 0, 0, 0};  ///< w, x, y, z.
  double yaw_rad{}, position_sigma_m{};
  Numbers3 reference_p_W{}, reference_v_W{}, reference_a_W{};
  bool has_motors{};
  std::array<double, 4> motors{};  ///< Thrust ratio.
  double battery_ratio{};
  const char* phase{""};  ///< Of static storage, as the next one.
  const char* action{""};
  bool has_truth{};  ///< In a simulator.
  Numbers3 true_p_W{};
};

/// `/decision` and `/trajectory`. Texts are of static storage, numbers as in the trace of a flight.
struct DecisionEntry {
  static constexpr std::size_t kMostPoints = 64;

  std::int64_t time_ns{};
  std::uint64_t number{};
  Numbers3 p_WB{}, goal_W{};
  double speed_mps{}, speed_limit_mps{};
  double p0_m{}, p1_m{}, v0_m3{}, v1_m3{}, v2_m3{};
  double time_budget_s{}, deadline_s{}, latency_s{};
  const char* kind{""};
  const char* budget_source{""};
  const char* speed_source{""};
  std::array<double, core::kStageCount> stage_s{}, predicted_s{};
  double visible_m{}, closest_obstacle_m{}, gap_average_m{}, sensor_volume_m3{}, map_volume_m3{}, demand_m{};
  double way_m{};
  const char* solver{""};
  const char* ways{""};
  const char* planner{""};
  const char* smoother{""};
  FixedText<256> active, refused;  ///< With + between.
  bool missed{};
  std::size_t points{};  ///< Of the new trajectory, from its start to its end; 0: there is none.
  std::array<Numbers3, kMostPoints> point_W{};
};

/// `/failsafe`.
struct FailsafeEntry {
  std::int64_t time_ns{};
  const char* action{""};  ///< Of static storage, as the next one.
  const char* phase{""};
  FixedText<192> conditions;  ///< With + between.
  FixedText<64> sensor;
};

/// `/map`: one layer of cells around the vehicle.
struct MapSlice {
  static constexpr std::size_t kMostCells = 128;
  static constexpr std::uint8_t kFree = 0, kOccupied = 100, kUnknown = 255;

  std::int64_t time_ns{};
  double x_m{}, y_m{}, z_m{};  ///< Lowest corner of the layer, and its height.
  double cell_m{};
  std::uint16_t columns{}, rows{};
  std::array<std::uint8_t, kMostCells * kMostCells> cell{};  ///< [row * columns + column]
};

/// Where a flight puts its records: straight into the file (FlightLog) or into rings (LogThread).
class LogSink {
 public:
  virtual ~LogSink() = default;
  /// State and failsafe are of the flight lane, the others of the decision lane.
  virtual void write(const StateRecord& record) noexcept = 0;
  virtual void write(const FailsafeEntry& entry) noexcept = 0;
  virtual void write(const DecisionEntry& entry) noexcept = 0;
  virtual void write(const MapSlice& slice) noexcept = 0;
};

}  // namespace roborun::log
