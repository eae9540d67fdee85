#include "platform/mission/flight_story.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <vector>

#include "core/executive/stage_budget.hpp"
#include "platform/input/base64.hpp"
#include "platform/input/json_reader.hpp"
#include "platform/log/flight_log.hpp"
#include "platform/log/log_records.hpp"
#include "platform/log/mcap_reader.hpp"
#include "platform/mission/inputs_format.hpp"
#include "platform/mission/scene.hpp"

namespace roborun::mission {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kLeastStep_s = 0.1;  // between two states: a tenth of a second is a pixel of a minute
constexpr int kRoundedTo = 1000;      // millimetres, milliseconds: what a picture can show
constexpr std::uint32_t kMostCells = 128U * 128U;  // as platform/log/README.md says

/// Null for what is no finite number.
Json rounded(const Json& message, const std::string& key, int to = kRoundedTo) {
  const auto at = message.find(key);
  if (at == message.end() || !at->is_number()) return nullptr;
  return std::round(at->get<double>() * to) / to;
}

double need_number(const Json& message, const std::string& key) {
  const auto at = message.find(key);
  if (at == message.end() || !at->is_number()) throw InputError(fmt::format("{}: must be a number", key));
  return at->get<double>();
}

std::string text_in(const Json& message, const std::string& key) {
  const auto at = message.find(key);
  return at != message.end() && at->is_string() ? at->get<std::string>() : std::string();
}

const Json& object_in(const Json& message, const std::string& key) {
  static const Json kNone = Json::object();
  const auto at = message.find(key);
  return at != message.end() && at->is_object() ? *at : kNone;
}

/// [x, y, z], or null.
Json point_in(const Json& message, const std::string& key) {
  const auto at = message.find(key);
  if (at == message.end() || !at->is_array() || at->size() != 3) return nullptr;
  for (const Json& value : *at)
    if (!value.is_number()) return nullptr;
  return *at;
}

/// Of `/world`. Throws InputError.
void check_shapes(const Json& world) {
  const auto numbers = [](const Json& list, std::size_t count) {
    return list.is_array() && list.size() == count &&
           std::all_of(list.begin(), list.end(), [](const Json& x) { return x.is_number(); });
  };
  const auto lists = [&world](const char* key, const auto& good) {
    const auto at = world.find(key);
    if (at == world.end() || !at->is_array() || !std::all_of(at->begin(), at->end(), good))
      throw InputError(fmt::format("{}: must be a list of shapes", key));
  };
  (void)need_number(world, "height_m");
  lists("circles", [&](const Json& circle) { return numbers(circle, 3); });
  lists("rings", [&](const Json& ring) {
    return ring.is_array() && !ring.empty() &&
           std::all_of(ring.begin(), ring.end(), [&](const Json& point) { return numbers(point, 2); });
  });
}

/// Every second element, once there are more than `most`. True if any went.
template <typename List>
bool thin(List& list, std::size_t most) {
  if (list.size() <= most) return false;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < list.size(); i += 2) list[kept++] = std::move(list[i]);
  list.resize(kept);
  return true;
}

/// Takes the messages of a log one by one.
class StoryTeller {
 public:
  void take(const log::Message& message);
  /// What was taken, as the page reads it.
  [[nodiscard]] Json story();
  [[nodiscard]] bool empty() const { return states_.empty(); }
  [[nodiscard]] const Json& configuration() const { return configuration_; }
  [[nodiscard]] const Json& world() const { return world_; }

 private:
  struct State {
    double time_s{};
    std::array<double, 6> value{};  ///< NaN: not known.
    std::string phase;
  };

  void state(double time_s, const Json& m);
  void decision(double time_s, const Json& m);
  void trajectory(double time_s, const Json& m);
  void map(double time_s, const Json& m);
  void failsafe(double time_s, const Json& m);
  void event(double time_s, const Json& m);
  void inputs(std::string_view message);
  void image(std::string_view record);
  [[nodiscard]] std::string name_of_camera(std::size_t camera) const;
  [[nodiscard]] Json facts() const;
  [[nodiscard]] Json fence() const;

  Json configuration_ = Json::object();
  Json result_ = Json::object();
  Json dropped_ = Json::object();
  Json world_ = Json::object();
  std::vector<State> states_;
  double state_step_s_{kLeastStep_s};
  Json decisions_ = Json::object();
  std::vector<Json> slices_;
  double slice_step_s_{0.0};
  std::vector<Json> plans_, failsafes_, events_;
  std::map<std::uint32_t, std::vector<Json>> images_;  ///< By camera.
  double image_step_s_{0.0};
  std::map<std::string, double> last_s_;  ///< By topic.
  std::uint64_t out_of_order_{0};
};

constexpr std::array<const char*, 6> kStateKeys{"x_m",       "y_m",           "z_m",
                                                "speed_mps", "ref_speed_mps", "battery_ratio"};
constexpr std::array<const char*, 8> kDecisionKeys{"speed_limit_mps", "deadline_s", "p0_m",  "p1_m",
                                                   "demand_m",        "v0_m3",      "v1_m3", "v2_m3"};

void StoryTeller::take(const log::Message& message) {
  static const std::map<std::string_view, void (StoryTeller::*)(double, const Json&)> kTopics{
      {"/state", &StoryTeller::state},           {"/decision", &StoryTeller::decision},
      {"/trajectory", &StoryTeller::trajectory}, {"/map", &StoryTeller::map},
      {"/failsafe", &StoryTeller::failsafe},     {"/events", &StoryTeller::event}};
  const std::string& topic = message.channel->topic;
  const double time_s = std::round(1e-9 * static_cast<double>(message.log_ns) * kRoundedTo) / kRoundedTo;
  try {
    if (message.channel->message_encoding == log::FlightLog::kInputsEncoding) return inputs(message.data);
    Json* whole = topic == "/configuration" ? &configuration_
                  : topic == "/result"      ? &result_
                  : topic == "/world"       ? &world_
                  : topic == "/log/dropped" ? &dropped_
                                            : nullptr;
    const auto known = kTopics.find(topic);
    if (whole == nullptr && known == kTopics.end()) return;
    Json m = input::parse_json(message.data);
    if (!m.is_object()) throw InputError("must be a JSON object");
    if (whole != nullptr) {
      if (whole == &world_) check_shapes(m);
      *whole = std::move(m);
      return;
    }
    const auto last = last_s_.find(topic);
    if (last != last_s_.end() && time_s < last->second) {
      ++out_of_order_;
      return;
    }
    last_s_[topic] = time_s;
    (this->*known->second)(time_s, m);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{} at {:.3f} s: {}", topic, time_s, error.what()));
  }
}

void StoryTeller::state(double time_s, const Json& m) {
  if (!states_.empty() && time_s < states_.back().time_s + state_step_s_ - 1e-6) return;
  State s{time_s, {}, text_in(m, "phase")};
  s.value.fill(std::numeric_limits<double>::quiet_NaN());
  for (std::size_t i = 0; i < 4; ++i)
    s.value.at(i) = std::round(need_number(m, kStateKeys.at(i)) * kRoundedTo) / kRoundedTo;
  const Json vx = rounded(m, "ref_vx_mps");
  const Json vy = rounded(m, "ref_vy_mps");
  const Json vz = rounded(m, "ref_vz_mps");
  if (vx.is_number() && vy.is_number() && vz.is_number())
    s.value[4] = std::round(kRoundedTo * std::hypot(vx.get<double>(), vy.get<double>(), vz.get<double>())) /
                 kRoundedTo;
  if (const Json ratio = rounded(m, "battery_ratio"); ratio.is_number()) s.value[5] = ratio.get<double>();
  states_.push_back(std::move(s));
  if (thin(states_, kMostStates)) state_step_s_ *= 2.0;
}

void StoryTeller::decision(double time_s, const Json& m) {
  decisions_["time_s"].push_back(time_s);
  for (const char* key : kDecisionKeys) decisions_[key].push_back(rounded(m, key));
  for (std::size_t i = 0; i < core::kStageCount; ++i) {
    const std::string key = fmt::format("{}_s", core::to_string(static_cast<core::StageId>(i)));
    decisions_[key].push_back(rounded(m, key, 100 * kRoundedTo));
  }
  std::string why;
  if (const auto lines = m.find("why"); lines != m.end() && lines->is_array()) {
    for (const Json& line : *lines)
      if (line.is_string()) why += (why.empty() ? "" : "\n") + line.get<std::string>();
  }
  decisions_["why"].push_back(why);
}

void StoryTeller::trajectory(double time_s, const Json& m) {
  Json points = Json::array();
  if (const auto poses = m.find("poses"); poses != m.end() && poses->is_array()) {
    for (const Json& pose : *poses) {
      const Json& p = object_in(pose, "position");
      for (const char* axis : {"x", "y", "z"}) points.push_back(std::round(need_number(p, axis) * 100) / 100);
    }
  }
  plans_.push_back({{"time_s", time_s}, {"points_m", std::move(points)}});
}

void StoryTeller::map(double time_s, const Json& m) {
  if (!slices_.empty() && time_s < slices_.back()["time_s"].get<double>() + slice_step_s_ - 1e-6) return;
  const Json& corner = object_in(object_in(m, "pose"), "position");
  const double columns = need_number(m, "column_count");
  const double stride = need_number(m, "row_stride");
  const double cell_m = need_number(object_in(m, "cell_size"), "x");
  if (!(columns >= 1 && columns <= kMostCells) || stride != columns || !(cell_m > 0.0))
    throw InputError("column_count, row_stride, cell_size: must be those of a grid with one byte a cell");
  const std::optional<std::string> data = input::from_base64(text_in(m, "data"));
  if (!data) throw InputError("data: must be base64");
  const std::string& cells = *data;
  const auto wide = static_cast<std::size_t>(columns);
  if (cells.empty() || cells.size() > kMostCells || cells.size() % wide != 0)
    throw InputError(
        fmt::format("data: {} cells: must be whole rows of {}, at most {}", cells.size(), wide, kMostCells));
  Json runs = Json::array();
  for (std::size_t i = 0; i < cells.size();) {
    std::size_t end = i;
    while (end < cells.size() && cells[end] == cells[i]) ++end;
    runs.push_back(cells[i] == log::MapSlice::kFree ? 1 : cells[i] == log::MapSlice::kOccupied ? 2 : 0);
    runs.push_back(end - i);
    i = end;
  }
  slices_.push_back({{"time_s", time_s},
                     {"x_m", need_number(corner, "x")},
                     {"y_m", need_number(corner, "y")},
                     {"z_m", need_number(corner, "z")},
                     {"cell_m", cell_m},
                     {"columns", wide},
                     {"rows", cells.size() / wide},
                     {"runs", std::move(runs)}});
  if (thin(slices_, kMostSlices)) slice_step_s_ = std::max(2.0 * slice_step_s_, 2.0);
}

void StoryTeller::failsafe(double time_s, const Json& m) {
  Json conditions = Json::array();
  if (const auto list = m.find("conditions"); list != m.end() && list->is_array()) {
    for (const Json& one : *list)
      if (one.is_string()) conditions.push_back(one);
  }
  failsafes_.push_back({{"time_s", time_s},
                        {"action", text_in(m, "action")},
                        {"phase", text_in(m, "phase")},
                        {"conditions", std::move(conditions)},
                        {"sensor", text_in(m, "sensor")}});
}

void StoryTeller::event(double time_s, const Json& m) {
  if (text_in(m, "name") == "failsafe") return;  // told as /failsafe
  events_.push_back({{"time_s", time_s}, {"text", text_in(m, "message")}});
}

void StoryTeller::inputs(std::string_view message) {
  const InputRecords inputs = records_from(message);
  for (const InputRecord& record : inputs.records)
    if (record.kind == RecordKind::kDepth)
      image(std::string_view(inputs.payloads).substr(record.at, record.bytes));
}

/// The letters of page/flight_cameras.js.
void StoryTeller::image(std::string_view record) {
  constexpr double kNearest_m = 0.3;
  constexpr double kLevels = 32.0;
  std::uint32_t camera = 0;
  firmware_if::DepthFrame frame;
  GetField get(record);
  get(camera);
  each_field(get, frame);
  const std::string_view words = get.rest();
  const auto range_m = static_cast<double>(frame.range_m);
  if (frame.width == 0 || words.size() != std::size_t{frame.width} * frame.height * sizeof(float) ||
      !(range_m > kNearest_m))
    return;  // for the flight to refuse
  std::vector<Json>& images = images_[camera];
  const double time_s =
      std::round(1e-9 * static_cast<double>(frame.stamp.time_since_epoch().count()) * kRoundedTo) /
      kRoundedTo;
  if (!images.empty() && time_s < images.back()["time_s"].get<double>() + std::max(image_step_s_, 1e-3))
    return;
  const std::size_t step = (std::max(frame.width, frame.height) + kMostImagePixels - 1) / kMostImagePixels;
  const std::size_t wide = (frame.width + step - 1) / step;
  const std::size_t high = (frame.height + step - 1) / step;
  constexpr float kFar = std::numeric_limits<float>::infinity();
  std::vector<float> nearest_m(wide * high, kFar);
  std::vector<bool> open(wide * high, false);  // a ray met nothing
  for (std::size_t i = 0; i < words.size() / sizeof(float); ++i) {
    float depth_m = 0.0F;
    std::memcpy(&depth_m, words.data() + i * sizeof depth_m, sizeof depth_m);
    const std::size_t at = i / frame.width / step * wide + i % frame.width / step;
    if (depth_m == kFar)
      open[at] = true;
    else
      nearest_m[at] = std::fmin(nearest_m[at], depth_m);  // of NaN the other one
  }
  std::string pixels;
  for (std::size_t at = 0; at < nearest_m.size(); ++at) {
    const double ratio = std::log(std::fmax(static_cast<double>(nearest_m[at]), kNearest_m) / kNearest_m) /
                         std::log(range_m / kNearest_m);
    pixels += nearest_m[at] == kFar
                  ? (open[at] ? ' ' : '!')
                  : static_cast<char>('@' + std::lround(std::fmin(ratio, 1.0) * (kLevels - 1)));
  }
  images.push_back({{"time_s", time_s},
                    {"camera", camera},
                    {"wide", wide},
                    {"high", high},
                    {"range_m", range_m},
                    {"pixels", std::move(pixels)}});
  std::size_t count = 0;
  for (const auto& [index, list] : images_) count += list.size();
  if (count <= kMostImages) return;
  for (auto& [index, list] : images_) thin(list, 1);
  image_step_s_ = std::max(2.0 * image_step_s_, 1.0);
}

/// Where it looks, if it is along an axis of the body; else empty.
std::string StoryTeller::name_of_camera(std::size_t camera) const {
  constexpr double kAlong = 0.8;
  const auto mounts = object_in(configuration_, "flight").find("mounts");
  if (mounts == object_in(configuration_, "flight").end() || !mounts->is_array() || camera >= mounts->size())
    return {};
  const auto turn = mounts->at(camera).find("R_BC");
  if (turn == mounts->at(camera).end() || !turn->is_array() || turn->size() != 9) return {};
  constexpr std::array<std::array<const char*, 2>, 3> kNames{
      {{"front", "back"}, {"left", "right"}, {"up", "down"}}};
  for (std::size_t axis = 0; axis < kNames.size(); ++axis) {
    const Json& along = turn->at(3 * axis);
    if (along.is_number() && std::abs(along.get<double>()) > kAlong)
      return kNames.at(axis).at(along.get<double>() > 0.0 ? 0U : 1U);
  }
  return {};
}

/// What stands above the pictures.
Json StoryTeller::facts() const {
  Json facts = Json::array();
  const auto add = [&facts](const char* name, const std::string& text) {
    if (!text.empty()) facts.push_back({name, text});
  };
  const auto number = [this](const char* key, const char* unit) {
    const auto at = result_.find(key);
    return at != result_.end() && at->is_number() ? fmt::format("{:.1f}{}", at->get<double>(), unit)
                                                  : std::string();
  };
  const auto count = [this](const char* key) {
    const auto at = result_.find(key);
    return at != result_.end() && at->is_number() ? fmt::format("{:.0f}", at->get<double>()) : std::string();
  };
  const Json& flight = object_in(configuration_, "flight");
  add("outcome", text_in(result_, "reason"));
  add("design", text_in(flight, "design"));
  if (const auto seed = flight.find("seed"); seed != flight.end() && seed->is_number())
    add("seed", seed->dump());
  add("time", number("mission_time_s", " s"));
  add("distance", number("distance_m", " m"));
  add("fastest", number("max_velocity_mps", " m/s"));
  add("mean", number("mean_velocity_mps", " m/s"));
  add("energy", number("energy_kJ", " kJ"));
  add("flight", number("flight_Jpm", " J/m"));
  add("computing", number("computing_Jpm", " J/m"));
  add("decisions", count("decisions"));
  add("deadlines missed", count("deadline_misses"));
  return facts;
}

/// Outlines from above; a circle has 48 corners.
Json StoryTeller::fence() const {
  constexpr int kCorners = 48;
  Json rings = Json::array();
  const auto areas = object_in(object_in(configuration_, "flight"), "fence").find("areas");
  if (areas == object_in(object_in(configuration_, "flight"), "fence").end() || !areas->is_array())
    return rings;
  for (const Json& area : *areas) {
    const auto points = area.find("points");
    if (points == area.end() || !points->is_array()) continue;
    Json ring = Json::array();
    for (const Json& p : *points)
      if (p.is_array() && p.size() == 2 && p[0].is_number() && p[1].is_number()) ring.push_back(p);
    const Json radius_m = rounded(area, "radius_m");
    if (radius_m.is_number() && radius_m.get<double>() > 0.0 && ring.size() == 1) {
      const double x_m = ring[0][0];
      const double y_m = ring[0][1];
      ring = Json::array();
      for (int i = 0; i < kCorners; ++i) {
        const double angle_rad = 2.0 * std::numbers::pi * i / kCorners;
        ring.push_back({x_m + radius_m.get<double>() * std::cos(angle_rad),
                        y_m + radius_m.get<double>() * std::sin(angle_rad)});
      }
    }
    if (ring.size() >= 3) rings.push_back(std::move(ring));
  }
  return rings;
}

Json StoryTeller::story() {
  Json state = Json::object();
  state["time_s"] = Json::array();
  for (const char* key : kStateKeys) state[key] = Json::array();
  for (const State& s : states_) {
    state["time_s"].push_back(s.time_s);
    for (std::size_t i = 0; i < kStateKeys.size(); ++i)
      state[kStateKeys.at(i)].push_back(std::isfinite(s.value.at(i)) ? Json(s.value.at(i)) : Json(nullptr));
    state["phase"].push_back(s.phase);
  }
  if (decisions_.empty()) {
    for (const char* key : kDecisionKeys) decisions_[key] = Json::array();
    for (std::size_t i = 0; i < core::kStageCount; ++i)
      decisions_[fmt::format("{}_s", core::to_string(static_cast<core::StageId>(i)))] = Json::array();
    for (const char* key : {"time_s", "why"}) decisions_[key] = Json::array();
  }
  const Json& flight = object_in(configuration_, "flight");
  const Json low = point_in(flight, "min_W");
  const Json high = point_in(flight, "max_W");
  Json notes = Json::array();
  if (out_of_order_ > 0)
    notes.push_back(fmt::format("Left out, because out of order: {} of its messages.", out_of_order_));
  for (const auto& [what, number] : dropped_.items()) {
    if (number.is_number() && number.get<double>() > 0.0)
      notes.push_back(fmt::format("The log misses {:.0f} {}.", number.get<double>(), what));
  }
  Json cameras = Json::array();
  for (auto& [camera, list] : images_) {
    for (Json& image : list) {
      image["name"] = name_of_camera(camera);
      cameras.push_back(std::move(image));
    }
  }
  return {{"facts", facts()},
          {"notes", std::move(notes)},
          {"bounds", low.is_null() || high.is_null() ? Json(nullptr) : Json{low, high}},
          {"start", point_in(configuration_, "start_m")},
          {"goal", point_in(flight, "goal_W")},
          {"fence", fence()},
          {"state", std::move(state)},
          {"decision", std::move(decisions_)},
          {"plan", std::move(plans_)},
          {"map", std::move(slices_)},
          {"camera", std::move(cameras)},
          {"failsafe", std::move(failsafes_)},
          {"events", std::move(events_)}};
}

/// Throws InputError if it is not the world of the story.
void check_world(const Json& story, const report::Scene& scene) {
  const auto same = [](const Json& there, const Vector3& p_W, const char* what) {
    constexpr double kSame_m = 1e-3;
    if (there.is_null()) return;
    const Vector3 in_log(there[0].get<double>(), there[1].get<double>(), there[2].get<double>());
    if ((in_log - p_W).norm() > kSame_m)
      throw InputError(
          fmt::format("{}: ({:g}, {:g}, {:g}) in the world, ({:g}, {:g}, {:g}) in the log: must be the world "
                      "of the flight",
                      what, p_W.x(), p_W.y(), p_W.z(), in_log.x(), in_log.y(), in_log.z()));
  };
  const Json& bounds = story["bounds"];
  same(bounds.is_null() ? bounds : bounds[0], scene.bounds_W.min_W, "lowest corner");
  same(bounds.is_null() ? bounds : bounds[1], scene.bounds_W.max_W, "highest corner");
  same(story["start"], scene.start_W, "start");
  same(story["goal"], scene.goal_W, "goal");
}

}  // namespace

FlightStory story_of(const std::string& path, const WorldOf& world, bool live) {
  FlightStory told;
  StoryTeller teller;
  log::McapReader reader(path);
  try {
    for (log::Message message; reader.next(message);) {
      teller.take(message);
      take(message, told.end);
    }
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", path, error.what()));
  }
  if (teller.empty())
    throw InputError(fmt::format("{}: no /state in it{}{}: must be a flight log of roborun (--log FILE.mcap)",
                                 path,
                                 reader.damage().empty() ? "" : ", and it is damaged: ", reader.damage()));
  told.end.damage = reader.damage();
  const Json& build = object_in(teller.configuration(), "build");
  const std::filesystem::path file(path);
  told.page.title = "Flight log " + file.filename().string();
  told.page.footer = fmt::format("From {}. Flown by roborun, commit {}, {}.", file.filename().string(),
                                 text_in(build, "commit"), text_in(build, "compiler"));
  Json story = teller.story();
  if (told.end.has_verdict)
    story["verdict"] = {
        {"passed", told.end.passed},
        {"complaints", told.end.complaints},
        {"moment_s", std::isfinite(told.end.moment_s) ? Json(told.end.moment_s) : Json(nullptr)}};
  if (!teller.world().empty()) story["world"] = teller.world();
  told.page.live = live;
  if (live) story["live"] = true;
  // The log of a flight that goes on has no end yet.
  if (!told.end.damage.empty() && !live) story["notes"].push_back("The log ends early: " + told.end.damage);
  if (world) {
    const Json& flight = object_in(teller.configuration(), "flight");
    const auto seed = flight.find("seed");
    const bool known = seed != flight.end() && seed->is_number_unsigned();
    const report::Scene scene = world(known ? std::optional(seed->get<std::uint64_t>()) : std::nullopt);
    check_world(story, scene);
    story["world"] = Json::parse(shapes_json(scene));
  }
  told.page.story = story.dump(-1, ' ', false, Json::error_handler_t::replace);
  return told;
}

}  // namespace roborun::mission
