/// A logged flight of the simulator, flown once more with a setting that changes in flight: what `roborun replay --what-if` does.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "platform/flight/flight_config.hpp"
#include "platform/mission/mission_config.hpp"
#include "platform/mission/recorded_flight.hpp"

namespace roborun::mission {

/// Each "KEY=VALUE", all together, from `at_s` on in the flight `logged`: a key of kGovernorKeys; cpu.slow_down_factor; flight.time_limit_s; goal=X,Y,Z.
/// Throws InputError that names the key, and says which there are.
void change_in_flight(MissionConfig& config, const flight::FlightConfig& logged, double at_s,
                      const std::vector<std::string>& settings);
/// Every key of change_in_flight(): for help texts.
[[nodiscard]] std::string keys_in_flight();

/// Seed, design, rate and parts are those of the log.
void fly_as_recorded(MissionConfig& config, const RecordedFlight& recorded);

/// Compares the inputs of two logs and what was done with them, bit for bit, in all minor frames before `until_s`. Returns one
/// line: where `flown` is first another flight than `logged`, and in what; none: nowhere. Throws InputError.
[[nodiscard]] std::optional<std::string> first_difference(const std::string& logged, const std::string& flown,
                                                          double until_s);

}  // namespace roborun::mission
