/// The package hook and the light of a vehicle whose motors are on a bus.
#pragma once

#include <atomic>
#include <optional>

#include "firmware_if/package_release.hpp"
#include "firmware_if/status_lights.hpp"
#include "platform/live/far_end.hpp"

namespace roborun::live {

/// One hardpoint and one light, both on the motors' bus, behind the same gate. RT-safe but for look().
class HookAndLight {
 public:
  /// `motors` outlives this. `needs_hook`: without one the vehicle is not ready.
  HookAndLight(flight::ActuatorSide& motors, bool needs_hook) noexcept
      : motors_(motors),
        needs_hook_(needs_hook),
        hook_({}, motors.gate(), nullptr),
        light_(0, motors.gate()) {}

  /// Any thread: the package is to go, as soon as it may, while a route waits for it.
  void release() noexcept { is_asked_.store(true, std::memory_order_relaxed); }
  /// The end of a minor frame, for the next step().
  void is_flown(const flight::Flown& flown) noexcept { flown_ = flown; }
  /// Once a minor frame, after the motors. `height_m`: above what is below, as measured; NaN: unknown. None: that over the
  /// take-off counts.
  void step(MonotonicTime now, std::optional<double> height_m) noexcept;
  /// On the ground, after step().
  void look(MonotonicTime now, std::vector<Need>& needs) const;
  /// Packages, as the hook has confirmed. Any thread.
  [[nodiscard]] std::uint64_t released() const noexcept { return released_.load(std::memory_order_relaxed); }

 private:
  flight::ActuatorSide& motors_;
  bool needs_hook_;
  firmware_if::PackageRelease hook_;
  firmware_if::StatusLights light_;
  flight::Flown flown_{};
  std::atomic<bool> is_asked_{false};
  MonotonicTime asked_until_ = MonotonicTime::min();
  bool hangs_{false};  ///< What was asked for, by what the hook says.
  std::atomic<std::uint64_t> released_{0};
};

}  // namespace roborun::live
