/// The package hook: holds, and lets go only where nothing can come of it but a delivery.
#pragma once

#include <cstdint>

#include "firmware_if/assert.hpp"
#include "firmware_if/gpio.hpp"
#include "firmware_if/transmit_gate.hpp"

namespace roborun::firmware_if {

/// Interlock: all of Input's conditions, without a gap for `steady`, open the hook; one that fails closes it
/// at once. The gate is the second lock: a kill keeps the package. Says hold or release to the hardpoint at
/// each change and once a second, and drives a line, if there is one. One lane owns it. RT-safe: O(1).
class PackageRelease {
 public:
  struct Config {
    std::uint8_t hardpoint_id{1};
    Nanos steady{500'000'000};  ///< Longer than any gust or glitch of an estimate lasts.
    double height_max_m{2.0};   ///< (0, 10]. Above ground: what a parcel survives.
    double speed_max_mps{0.5};  ///< (0, 2].
    [[nodiscard]] constexpr Status validate() const noexcept {
      const bool good = steady.count() > 0 && height_max_m > 0.0 && height_max_m <= 10.0 &&
                        speed_max_mps > 0.0 && speed_max_mps <= 2.0;
      return good ? Status::kOk : Status::kInvalidArgument;
    }
  };
  struct Input {
    bool wanted{};       ///< By the mission.
    bool killed{};       ///< By the kill switch.
    bool estimated{};    ///< The two below are the estimator's, and it is well.
    double height_m{};   ///< Above ground. NaN: unknown, keeps the hook closed.
    double speed_mps{};  ///< |v_WB|.
  };
  struct Counters {
    std::uint64_t releases{};  ///< Times that the hook was opened.
    std::uint64_t unsafe{};    ///< Steps in which a release was wanted and a condition forbade it.
    std::uint64_t refused{};   ///< Commands that gate or bus did not take: repeated in the next step.
  };

  /// Precondition, asserted: config.validate() is kOk. `line` may be null; active lets go.
  PackageRelease(const Config& config, TransmitGate& gate, GpioOutput* line) noexcept
      : config_(config), gate_(gate), line_(line) {
    ROBORUN_ASSERT(config.validate() == Status::kOk);
  }

  /// kOk, or kIo: the line is gone.
  [[nodiscard]] Status step(MonotonicTime now, const Input& in) noexcept;
  [[nodiscard]] bool open() const noexcept { return open_; }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  Config config_;
  TransmitGate& gate_;
  GpioOutput* line_;
  bool safe_{false};
  MonotonicTime safe_since_{};
  bool open_{false};
  bool said_{false};
  bool said_open_{false};
  MonotonicTime said_at_{};
  Counters counters_{};
};

}  // namespace roborun::firmware_if
