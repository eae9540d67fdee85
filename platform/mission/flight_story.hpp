/// A flight log read as the story of one flight: what `roborun report` draws.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "platform/mission/logged_end.hpp"
#include "platform/report/flight_page.hpp"
#include "platform/report/svg_plot.hpp"

namespace roborun::mission {

struct FlightStory {
  report::FlightPage page;
  LoggedEnd end;  ///< The story goes until where the log is damaged.
};

/// The true world as it is at the height of its start, for a log that does not hold it. `seed`: of the flight, if the log says it.
using WorldOf = std::function<report::Scene(std::optional<std::uint64_t> seed)>;

inline constexpr std::size_t kMostStates = 12000;
inline constexpr std::size_t kMostSlices = 600;
inline constexpr std::size_t kMostImages = 1500;  ///< Of all cameras.
inline constexpr std::size_t kMostImagePixels =
    48;  ///< In a row or column: the nearest of several pixels is one.
/// Reads a log of any length: states, slices of the map and images are thinned to at most these numbers, messages out of order are
/// left out and counted. `world` may be empty. `live`: the page goes on with the topics of a server. Throws InputError for what cannot be read, is no flight log, or holds a
/// message that is not as platform/log/README.md says, and for a world whose bounds, start or goal are not the flight's.
[[nodiscard]] FlightStory story_of(const std::string& path, const WorldOf& world = {}, bool live = false);

}  // namespace roborun::mission
