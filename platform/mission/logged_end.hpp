/// How a flight ended, from its log: what tables of flights show.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "platform/log/mcap_reader.hpp"

namespace roborun::mission {

inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// NaN: the log does not say.
struct LoggedEnd {
  bool has_result{false};  ///< `/result` is there: a simulated flight that was logged to its end.
  bool reached{false}, collided{false};
  bool has_verdict{false};              ///< `/verdict` is there: the flight of a scenario.
  bool passed{false};                   ///< By that verdict.
  std::vector<std::string> complaints;  ///< Of that verdict: what did not hold, one line each.
  double moment_s{kUnknown};            ///< Of that verdict: the moment to look at.
  std::string reason;                   ///< Why it ended; of a log without a result its last event.
  double recorded_s{};                  ///< Until here there is something in the log.
  double time_s{kUnknown}, mean_mps{kUnknown}, distance_m{kUnknown}, energy_kJ{kUnknown};
  double closest_m{kUnknown};  ///< The nearest obstacle that the vehicle has seen at a decision.
  std::size_t decisions{};
  std::string damage;  ///< Empty, or one line: where the log ends early, and why.
  [[nodiscard]] bool good() const noexcept { return has_result && reached && !collided; }
};

/// What one message tells; in the order of the log. Throws InputError for a result that is none.
void take(const log::Message& message, LoggedEnd& end);

/// Throws InputError for what cannot be read, for what is no flight log, and for a result that is none.
[[nodiscard]] LoggedEnd end_of(const std::string& path);

/// Empty, or the one line that refuses a moment behind the end of the log (`option`: who asks).
[[nodiscard]] std::string beyond(const LoggedEnd& end, const char* option, double at_s);

}  // namespace roborun::mission
