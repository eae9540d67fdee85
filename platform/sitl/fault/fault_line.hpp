/// Faults on demand, in the vocabulary of PX4's failure injection: what fails, how, and when.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/memory/static_vector.hpp"
#include "core/random/counter_rng.hpp"
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

/// How much of it, where that can be said: the row of kSizes.
enum class FaultKind : std::uint8_t {
  kNone,
  kOff,           ///< Nothing comes any more. CPU: the flight lane stands still.
  kStuck,         ///< The last value again and again, with fresh stamps. CPU: the decision lane stands still.
  kGarbage,       ///< NaN and numbers without sense.
  kWrong,         ///< Plausible, but shifted.
  kSlow,          ///< One in so many comes. CPU: as many times as slow.
  kDelayed,       ///< Late. Clock: stamps of a while ago.
  kIntermittent,  ///< A share of it lost, at random. Kill switch: pulses of one sample.
  kOn,            ///< Kill switch: pressed. Wind: a storm.
  kJump,          ///< Shifted to the north, without a word.
  kReset,         ///< Begins anew, elsewhere and turned, and says so.
  kCovered,       ///< A lens under mud or a leaf: no pixel has a value but for some that seem near.
  kTurned,        ///< A camera that a bump turned by 12 degrees to the left and 10 down.
  kFog,           ///< Fog that comes up: the farther, the fewer values.
  kRain,          ///< Drops: one pixel in 300, alone and near; wet lenses: patches without a value.
  kDrift,         ///< From the truth away, steadily: to the north, a barometer up.
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
      reset = bit(FaultKind::kReset), covered = bit(FaultKind::kCovered), turned = bit(FaultKind::kTurned),
      fog = bit(FaultKind::kFog), rain = bit(FaultKind::kRain), drift = bit(FaultKind::kDrift);
  constexpr std::uint16_t sensor = off | stuck | garbage | wrong | slow | delayed | some;
  return std::array<ComponentSpec, kComponentCount>{{
    {C::kImu, "imu", 1, sensor},
    {C::kGnss, "gnss", 1, sensor | jump | drift},
    {C::kOdometry, "odometry", 1, off | stuck | garbage | slow | delayed | some | jump | reset | drift},
    {C::kBarometer, "barometer", 1, sensor | drift},
    {C::kDepth, "depth", 6, sensor | covered | turned | fog | rain},
    {C::kBattery, "battery", 1, off | stuck | garbage | wrong},
    {C::kEsc, "esc", 4, off | stuck | garbage | wrong | slow | some},
    {C::kEscStatus, "esc_status", 4, off},
    {C::kCan, "can", 1, off | garbage | some},
    {C::kKillSwitch, "kill_switch", 1, on | off | stuck | some},       // stuck: both contacts closed
    {C::kLink, "link", 1, off | some},
    {C::kPlanner, "planner", 1, off | some},
    {C::kMap, "map", 1, off},                                          // no memory for new bricks
    {C::kClock, "clock", 1, wrong | delayed},
    {C::kCpu, "cpu", 1, off | stuck | slow},
    {C::kWind, "wind", 1, on},
  }};
}();
// clang-format on
inline constexpr std::array<const char*, 16> kFaultKindNames{
    "none", "off",  "stuck", "garbage", "wrong",  "slow", "delayed", "intermittent",
    "on",   "jump", "reset", "covered", "turned", "fog",  "rain",    "drift"};

/// How much of a fault there is, unless a scenario says it.
struct FaultSize {
  Component component;
  FaultKind kind;
  double usual;
  double least;
  double most;
  const char* unit;
};
// clang-format off
inline constexpr std::array kSizes = {
    FaultSize{Component::kImu, FaultKind::kWrong, 0.5, 0.001, 10.0, "rad/s about the forward axis"},
    FaultSize{Component::kImu, FaultKind::kSlow, 10.0, 2.0, 1000.0, "one sample in so many comes"},
    FaultSize{Component::kImu, FaultKind::kDelayed, 0.05, 0.001, 0.1, "s"},
    FaultSize{Component::kImu, FaultKind::kIntermittent, 0.5, 0.001, 1.0, "share lost"},
    FaultSize{Component::kGnss, FaultKind::kWrong, 30.0, 0.1, 1e4, "m to the north"},
    FaultSize{Component::kGnss, FaultKind::kSlow, 10.0, 2.0, 1000.0, "one fix in so many comes"},
    FaultSize{Component::kGnss, FaultKind::kDelayed, 0.4, 0.001, 2.0, "s"},
    FaultSize{Component::kGnss, FaultKind::kIntermittent, 0.5, 0.001, 1.0, "share lost"},
    FaultSize{Component::kGnss, FaultKind::kJump, 2.0, 0.1, 1e4, "m to the north"},
    FaultSize{Component::kGnss, FaultKind::kDrift, 0.5, 0.001, 100.0, "m/s to the north"},
    FaultSize{Component::kOdometry, FaultKind::kSlow, 10.0, 2.0, 1000.0, "one pose in so many comes"},
    FaultSize{Component::kOdometry, FaultKind::kDelayed, 0.4, 0.001, 2.0, "s"},
    FaultSize{Component::kOdometry, FaultKind::kIntermittent, 0.5, 0.001, 1.0, "share lost"},
    FaultSize{Component::kOdometry, FaultKind::kJump, 2.0, 0.1, 1e4, "m to the north"},
    FaultSize{Component::kOdometry, FaultKind::kDrift, 0.5, 0.001, 100.0, "m/s to the north"},
    FaultSize{Component::kBarometer, FaultKind::kWrong, 30.0, 0.1, 1e4, "m too high"},
    FaultSize{Component::kBarometer, FaultKind::kSlow, 10.0, 2.0, 1000.0, "one sample in so many comes"},
    FaultSize{Component::kBarometer, FaultKind::kDelayed, 0.4, 0.001, 1.0, "s"},
    FaultSize{Component::kBarometer, FaultKind::kIntermittent, 0.5, 0.001, 1.0, "share lost"},
    FaultSize{Component::kBarometer, FaultKind::kDrift, 0.5, 0.001, 100.0, "m/s up"},
    FaultSize{Component::kDepth, FaultKind::kWrong, 0.5, 0.01, 100.0, "times the distance"},
    FaultSize{Component::kDepth, FaultKind::kSlow, 10.0, 2.0, 1000.0, "one image in so many comes"},
    FaultSize{Component::kDepth, FaultKind::kDelayed, 0.4, 0.001, 2.0, "s"},
    FaultSize{Component::kDepth, FaultKind::kIntermittent, 0.5, 0.001, 1.0, "share lost"},
    FaultSize{Component::kDepth, FaultKind::kFog, 10.0, 1.0, 1000.0, "m of visibility"},
    FaultSize{Component::kBattery, FaultKind::kWrong, 0.05, 0.0, 1.0, "share left"},
    FaultSize{Component::kEsc, FaultKind::kWrong, 0.85, 0.0, 0.999, "share of the thrust left"},
    FaultSize{Component::kEsc, FaultKind::kIntermittent, 0.5, 0.001, 1.0, "share lost, in pieces of 50 ms"},
    FaultSize{Component::kCan, FaultKind::kGarbage, 0.5, 0.001, 1.0, "share of frames with a wrong bit"},
    FaultSize{Component::kCan, FaultKind::kIntermittent, 0.5, 0.001, 1.0, "share of frames lost"},
    FaultSize{Component::kLink, FaultKind::kIntermittent, 0.5, 0.001, 1.0, "share lost"},
    FaultSize{Component::kPlanner, FaultKind::kIntermittent, 0.5, 0.001, 1.0, "share of plans lost"},
    FaultSize{Component::kClock, FaultKind::kWrong, 0.2, 0.001, 10.0, "s ahead"},
    FaultSize{Component::kClock, FaultKind::kDelayed, 0.2, 0.001, 10.0, "s behind"},
    FaultSize{Component::kCpu, FaultKind::kSlow, 4.0, 1.01, 100.0, "times as slow"},
    FaultSize{Component::kWind, FaultKind::kOn, 18.0, 0.1, 50.0, "m/s"},
};
// clang-format on
/// Null: the kind has no size.
[[nodiscard]] constexpr const FaultSize* size_of(Component component, FaultKind kind) noexcept {
  for (const FaultSize& row : kSizes)
    if (row.component == component && row.kind == kind) return &row;
  return nullptr;
}

struct Fault {
  Component component{};
  FaultKind kind{};
  int instance{-1};              ///< -1: all.
  std::optional<double> size{};  ///< In the unit of its row; none: the usual one.
};

/// The faults of one flight. Neither allocates nor blocks; one thread.
class FaultLine {
 public:
  static constexpr std::size_t kMost = 32;

  /// From now() on for `duration`, and again each `every` (0: once); beyond kMost it is ignored.
  void inject(const Fault& fault, Nanos duration, Nanos every = Nanos{0}) noexcept {
    (void)active_.push_back({fault, now_, duration, every});
  }
  void advance(MonotonicTime now) noexcept { now_ = now; }
  [[nodiscard]] MonotonicTime now() const noexcept { return now_; }
  /// The fault of this instance now; of several the one injected last.
  [[nodiscard]] FaultKind of(Component component, int instance = 0) const noexcept {
    const Active* a = find(component, instance);
    return a == nullptr ? FaultKind::kNone : a->fault.kind;
  }
  /// How much of it; 0 without a fault, or of one without a size.
  [[nodiscard]] double size(Component component, int instance = 0) const noexcept {
    const Active* a = find(component, instance);
    if (a == nullptr) return 0.0;
    const FaultSize* row = size_of(component, a->fault.kind);
    return a->fault.size.value_or(row == nullptr ? 0.0 : row->usual);
  }
  /// Since it began, in a burst since the burst did; 0 without a fault.
  [[nodiscard]] Nanos age(Component component, int instance = 0) const noexcept {
    const Active* a = find(component, instance);
    return a == nullptr ? Nanos{0} : a->age(now_);
  }
  /// Whether what has this number is among the share that an intermittent fault loses: a function of component,
  /// instance and number alone.
  [[nodiscard]] bool loses(Component component, int instance, std::uint64_t number) const noexcept {
    const std::uint64_t stream =
        static_cast<std::uint64_t>(component) + kComponentCount * static_cast<std::uint64_t>(instance);
    return core::CounterRng(number, stream).uniform() < size(component, instance);
  }

 private:
  struct Active {
    Fault fault{};
    MonotonicTime from{};
    Nanos duration{};
    Nanos every{};
    [[nodiscard]] Nanos age(MonotonicTime now) const noexcept {
      return every > Nanos{0} ? (now - from) % every : now - from;
    }
  };
  [[nodiscard]] const Active* find(Component component, int instance) const noexcept {
    for (std::size_t i = active_.size(); i-- > 0;) {
      const Active& a = active_[i];
      if (a.fault.component == component && (a.fault.instance < 0 || a.fault.instance == instance) &&
          now_ >= a.from && a.age(now_) < a.duration)
        return &a;
    }
    return nullptr;
  }

  core::StaticVector<Active, kMost> active_{};
  MonotonicTime now_{};
};

}  // namespace roborun::sitl
