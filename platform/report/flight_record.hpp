/// What the pictures need of one flight, as text: the decisions, and the path at 2 Hz, rounded to millimetres
/// and tenths of a millisecond.
#pragma once

#include <string>

#include "platform/report/mission_result.hpp"

namespace roborun::report {

[[nodiscard]] std::string to_flight_record(const MissionReport& mission);
/// Of a decision only what the record holds: time, position, speed, precision, volume, budget, deadline,
/// latency, its parts, visibility. False if the text is not a record; `mission` is then unchanged.
[[nodiscard]] bool from_flight_record(const std::string& text, MissionReport& mission);

}  // namespace roborun::report
