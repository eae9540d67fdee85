/// How the samples of a recording stand in its records, for whoever writes and reads them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

#include "core/record/state_hash.hpp"
#include "firmware_if/depth_camera.hpp"
#include "firmware_if/lidar.hpp"
#include "platform/flight/aircraft.hpp"
#include "platform/mission/recording.hpp"

namespace roborun::mission {

/// Of a record, and of the one before it.
inline std::uint64_t checksum(std::uint64_t before, RecordKind kind,
                              std::span<const std::byte> payload) noexcept {
  core::StateHash hash;
  hash.add(before);
  hash.add((std::uint64_t{static_cast<std::uint32_t>(kind)} << 32U) | payload.size());
  for (std::size_t at = 0; at < payload.size(); at += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, payload.data() + at, std::min<std::size_t>(8, payload.size() - at));
    hash.add(word);
  }
  return hash.value();
}

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
void each_field(F&& f, FlightTotals& t) {
  for (std::uint64_t* x : {&t.digest, &t.minor_frames, &t.decisions}) f(*x);
}

class Put {
 public:
  explicit Put(std::vector<std::byte>& to) : to_(to) {}
  template <typename T>
  void operator()(const T& value) {
    static_assert(std::is_arithmetic_v<T>);
    const auto* bytes = reinterpret_cast<const std::byte*>(&value);
    to_.insert(to_.end(), bytes, bytes + sizeof value);
  }

 private:
  std::vector<std::byte>& to_;
};

/// The sizes of records are checked when they are read: there is always enough to get.
class Get {
 public:
  explicit Get(std::span<const std::byte> from) : from_(from) {}
  template <typename T>
  void operator()(T& value) {
    static_assert(std::is_arithmetic_v<T>);
    std::memcpy(&value, from_.data(), sizeof value);
    from_ = from_.subspan(sizeof value);
  }
  [[nodiscard]] std::span<const std::byte> rest() const { return from_; }

 private:
  std::span<const std::byte> from_;
};

constexpr RecordKind kind_of(const firmware_if::ImuSample*) { return RecordKind::kImu; }
constexpr RecordKind kind_of(const firmware_if::GnssFix*) { return RecordKind::kGnss; }
constexpr RecordKind kind_of(const firmware_if::BarometerSample*) { return RecordKind::kBarometer; }
constexpr RecordKind kind_of(const firmware_if::OdometrySample*) { return RecordKind::kOdometry; }

}  // namespace roborun::mission
