#include "platform/mission/logged_end.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "platform/input/input_error.hpp"
#include "platform/input/json_reader.hpp"

namespace roborun::mission {
namespace {

using Json = nlohmann::ordered_json;

double number_or_unknown(const Json& json, const char* key) {
  const auto at = json.find(key);
  return at != json.end() && at->is_number() ? at->get<double>() : kUnknown;
}

/// Of a result; throws InputError if it lacks it.
template <typename Value>
Value needed(const Json& json, const char* key) {
  const auto at = json.find(key);
  constexpr bool kText = std::is_same_v<Value, std::string>;
  if (at == json.end() || !(kText ? at->is_string() : at->is_boolean()))
    throw InputError(fmt::format("/result: {}: must be {}", key, kText ? "a text" : "true or false"));
  return at->get<Value>();
}

void take_result(const Json& json, LoggedEnd& end) {
  end.has_result = true;
  end.reached = needed<bool>(json, "reached_goal");
  end.collided = needed<bool>(json, "collided");
  end.reason = needed<std::string>(json, "reason");
  end.time_s = number_or_unknown(json, "mission_time_s");
  end.mean_mps = number_or_unknown(json, "mean_velocity_mps");
  end.distance_m = number_or_unknown(json, "distance_m");
  end.energy_kJ = number_or_unknown(json, "energy_kJ");
}

void take_verdict(const Json& json, LoggedEnd& end) {
  const auto passed = json.find("passed");
  const auto complaints = json.find("complaints");
  const bool texts =
      complaints != json.end() && complaints->is_array() &&
      std::all_of(complaints->begin(), complaints->end(), [](const Json& text) { return text.is_string(); });
  if (passed == json.end() || !passed->is_boolean() || !texts)
    throw InputError("/verdict: must be an object with passed (true or false) and complaints (texts)");
  end.has_verdict = true;
  end.passed = passed->get<bool>();
  end.complaints = complaints->get<std::vector<std::string>>();
  end.moment_s = number_or_unknown(json, "moment_s");
}

}  // namespace

void take(const log::Message& message, LoggedEnd& end) {
  const std::string& topic = message.channel->topic;
  end.recorded_s = std::max(end.recorded_s, 1e-9 * static_cast<double>(message.log_ns));
  if (topic == "/decision") {
    ++end.decisions;
    end.closest_m =
        std::fmin(end.closest_m, number_or_unknown(input::parse_json(message.data), "closest_obstacle_m"));
  } else if (topic == "/events" && !end.has_result) {
    const Json event = input::parse_json(message.data);
    const auto text = event.find("message");
    end.reason = text != event.end() && text->is_string() ? text->get<std::string>() : std::string();
  } else if (topic == "/result") {
    take_result(input::parse_json(message.data), end);
  } else if (topic == "/verdict") {
    take_verdict(input::parse_json(message.data), end);
  }
}

LoggedEnd end_of(const std::string& path) {
  LoggedEnd end;
  log::McapReader reader(path);
  bool is_flight = false;
  try {
    for (log::Message m; reader.next(m);) {
      is_flight = is_flight || m.channel->topic == "/configuration";
      take(m, end);
    }
  } catch (const InputError& error) {
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
