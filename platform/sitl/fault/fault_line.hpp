/// Faults on demand, in the vocabulary of PX4's failure injection: what fails, how, and when.
#pragma once

#include <array>
#include <cstdint>

#include "core/memory/static_vector.hpp"
#include "firmware_if/time.hpp"

namespace roborun::sitl {

enum class Component : std::uint8_t {
  kImu,
  kGnss,
  kOdometry,
  kBarometer,
  kDepth,  ///< Instance: camera 0 .. 5 (forward, left, back, right, up, down).
  kBattery,
  kEsc,        ///< Instance: motor 0 .. 3.
  kEscStatus,  ///< What the controllers say on the bus; the motors turn on.
  kCan,        ///< The runtime's own controller, or the wire.
  kKillSwitch,
  kLink,  ///< To the operator.
  kPlanner,
  kMap,
  kClock,  ///< That of GNSS and cameras against ours.
  kCpu,
  kWind,
};
inline constexpr std::size_t kComponentCount = 16;

enum class FaultKind : std::uint8_t {
  kNone,
  kOff,           ///< Nothing comes any more. CPU: the flight lane stands still.
  kStuck,         ///< The last value again and again, with fresh stamps. CPU: the decision lane stands still.
  kGarbage,       ///< NaN and numbers without sense.
  kWrong,         ///< Plausible, but shifted.
  kSlow,          ///< One in ten. CPU: four times as slow.
  kDelayed,       ///< Late by 0.4 s, IMU by 50 ms. Clock: stamps of 0.2 s ago.
  kIntermittent,  ///< Half of it lost, at random. Kill switch: pulses of one sample.
  kOn,            ///< Kill switch: pressed. Wind: a storm.
  kJump,          ///< 2 m to the north, without a word.
  kReset,         ///< Begins anew, elsewhere and turned, and says so.
};

/// One row: which kinds make sense for a component, and of how many instances.
struct ComponentSpec {
  Component component;
  const char* name;
  int instances;
  std::uint16_t kinds;  ///< One bit a FaultKind.
};
[[nodiscard]] constexpr std::uint16_t bit(FaultKind kind) noexcept {
  return static_cast<std::uint16_t>(1U << static_cast<unsigned>(kind));
}
// clang-format off
inline constexpr std::array<ComponentSpec, kComponentCount> kComponents = [] {
  using C = Component;
  constexpr std::uint16_t off = bit(FaultKind::kOff), stuck = bit(FaultKind::kStuck), garbage = bit(FaultKind::kGarbage),
      wrong = bit(FaultKind::kWrong), slow = bit(FaultKind::kSlow), delayed = bit(FaultKind::kDelayed),
      some = bit(FaultKind::kIntermittent), on = bit(FaultKind::kOn), jump = bit(FaultKind::kJump),
      reset = bit(FaultKind::kReset);
  constexpr std::uint16_t sensor = off | stuck | garbage | wrong | slow | delayed | some;
  return std::array<ComponentSpec, kComponentCount>{{
    {C::kImu, "imu", 1, sensor},
    {C::kGnss, "gnss", 1, sensor | jump},                              // wrong: 30 m to the north
    {C::kOdometry, "odometry", 1, off | stuck | garbage | slow | delayed | some | jump | reset},
    {C::kBarometer, "barometer", 1, sensor},                           // wrong: 30 m too high
    {C::kDepth, "depth", 6, sensor},                                   // wrong: half the distance
    {C::kBattery, "battery", 1, off | stuck | garbage | wrong},        // wrong: 5 % left
    {C::kEsc, "esc", 4, off | stuck | garbage | wrong | slow | some},  // wrong: 85 % of the thrust
    {C::kEscStatus, "esc_status", 4, off},
    {C::kCan, "can", 1, off | garbage | some},
    {C::kKillSwitch, "kill_switch", 1, on | off | stuck | some},       // stuck: both contacts closed
    {C::kLink, "link", 1, off | some},
    {C::kPlanner, "planner", 1, off | some},
    {C::kMap, "map", 1, off},                                          // no memory for new bricks
    {C::kClock, "clock", 1, wrong | delayed},                          // wrong: 0.2 s ahead
    {C::kCpu, "cpu", 1, off | stuck | slow},
    {C::kWind, "wind", 1, on},
  }};
}();
// clang-format on
inline constexpr std::array<const char*, 11> kFaultKindNames{
    "none", "off", "stuck", "garbage", "wrong", "slow", "delayed", "intermittent", "on", "jump", "reset"};

struct Fault {
  Component component{};
  FaultKind kind{};
  int instance{-1};  ///< -1: all.
};

/// The faults of one flight. Neither allocates nor blocks; one thread.
class FaultLine {
 public:
  static constexpr std::size_t kMost = 32;

  /// From now() on for `duration`; beyond kMost it is ignored.
  void inject(const Fault& fault, Nanos duration) noexcept {
    (void)active_.push_back({fault, now_, now_ + duration});
  }
  void advance(MonotonicTime now) noexcept { now_ = now; }
  [[nodiscard]] MonotonicTime now() const noexcept { return now_; }
  /// The fault of this instance now; of several the one injected last.
  [[nodiscard]] FaultKind of(Component component, int instance = 0) const noexcept {
    for (std::size_t i = active_.size(); i-- > 0;) {
      const Active& a = active_[i];
      if (a.fault.component == component && (a.fault.instance < 0 || a.fault.instance == instance) &&
          now_ >= a.from && now_ < a.until)
        return a.fault.kind;
    }
    return FaultKind::kNone;
  }

 private:
  struct Active {
    Fault fault{};
    MonotonicTime from{};
    MonotonicTime until{};
  };
  core::StaticVector<Active, kMost> active_{};
  MonotonicTime now_{};
};

}  // namespace roborun::sitl
