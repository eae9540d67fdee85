#include "platform/mission/logged_end.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "platform/input/input_error.hpp"
#include "platform/input/json_reader.hpp"
#include "platform/log/mcap_reader.hpp"

namespace roborun::mission {
namespace {

using Json = nlohmann::ordered_json;

double number_or_unknown(const Json& json, const char* key) {
  const auto at = json.find(key);
  return at != json.end() && at->is_number() ? at->get<double>() : kUnknown;
}

void take_result(const Json& json, LoggedEnd& end) {
  end.has_result = true;
  end.reached = json.at("reached_goal").get<bool>();
  end.collided = json.at("collided").get<bool>();
  end.reason = json.at("reason").get<std::string>();
  end.time_s = number_or_unknown(json, "mission_time_s");
  end.mean_mps = number_or_unknown(json, "mean_velocity_mps");
  end.distance_m = number_or_unknown(json, "distance_m");
  end.energy_kJ = number_or_unknown(json, "energy_kJ");
}

}  // namespace

LoggedEnd end_of(const std::string& path) {
  LoggedEnd end;
  log::McapReader reader(path);
  bool is_flight = false;
  try {
    for (log::Message m; reader.next(m);) {
      const std::string& topic = m.channel->topic;
      end.recorded_s = std::max(end.recorded_s, 1e-9 * static_cast<double>(m.log_ns));
      is_flight = is_flight || topic == "/configuration";
      if (topic == "/decision") {
        ++end.decisions;
        end.closest_m =
            std::fmin(end.closest_m, number_or_unknown(input::parse_json(m.data), "closest_obstacle_m"));
      } else if (topic == "/events" && !end.has_result) {
        end.reason = input::parse_json(m.data).value("message", std::string());
      } else if (topic == "/result") {
        take_result(input::parse_json(m.data), end);
      }
    }
  } catch (const std::exception& error) {
    throw InputError(fmt::format("{}: no log of a flight of this program: {}", path, error.what()));
  }
  end.damage = reader.damage();
  if (!is_flight)
    throw InputError(end.damage.empty()
                         ? fmt::format("{}: no log of a flight: it holds no configuration", path)
                         : end.damage);
  return end;
}

std::string beyond(const LoggedEnd& end, const char* option, double at_s) {
  if (at_s <= end.recorded_s) return {};
  return fmt::format("{}: {:g} s: must be within the log, which ends at {:.2f} s{}", option, at_s,
                     end.recorded_s, end.damage.empty() ? "" : " where it is cut or damaged");
}

}  // namespace roborun::mission
