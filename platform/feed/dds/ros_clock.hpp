/// ROS time, which is this machine's wall clock, on CLOCK_MONOTONIC.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "firmware_if/time.hpp"

namespace roborun::feed {

/// Why a message was left out: `kind` is one of few, and of static storage; `text` says it in words.
struct Refused {
  const char* kind;
  std::string text;
};

/// Both clocks at one instant.
struct ClockPair {
  Nanos wall{}, monotonic{};
};
[[nodiscard]] ClockPair clocks_now();

class RosClock {
 public:
  static constexpr Nanos kMostJump{10'000'000};
  static constexpr Nanos kSettle{200'000'000};
  static constexpr Nanos kMostAge{500'000'000};
  static constexpr Nanos kMostAhead{10'000'000};

  /// `stamp_ns` on CLOCK_MONOTONIC. Refused: the wall clock was set by more than kMostJump less than kSettle ago
  /// (the stamp may be of either time), or the stamp is not of this machine's time: simulated, or of another clock.
  [[nodiscard]] std::optional<Refused> take(std::int32_t sec, std::uint32_t nanosec, const ClockPair& now,
                                            std::int64_t& stamp_ns);

 private:
  std::optional<Nanos> offset_;  ///< Monotonic less wall, when the last message came.
  Nanos settled_{};              ///< When stamps are believed again.
  Nanos jump_{};
};

}  // namespace roborun::feed
