#include "platform/mavlink/mission_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "platform/input/arguments.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/json_reader.hpp"
#include "platform/input/text_file.hpp"

namespace roborun::mavlink {
namespace {

using Json = nlohmann::json;
using ItemKind = MissionItem::Kind;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kMostItems = 1000;
constexpr double kMostHold_s = 3600.0;
constexpr double kMostSpeed_mps = 50.0;
constexpr double kMostHeight_m = 5000.0;

/// As both formats have it; NaN: not given.
struct RawItem {
  int command{}, frame{};
  std::array<double, 7> p{};
  std::string where;
};

[[noreturn]] void complain(const std::string& where, const std::string& what) {
  throw InputError(fmt::format("{}: {}", where, what));
}

void check_earth(const std::string& where, const EarthPoint& p) {
  if (!(std::fabs(p.latitude_deg) <= 90.0 && std::fabs(p.longitude_deg) <= 180.0))
    complain(where,
             fmt::format("({}, {}) is no latitude and longitude: must be in degrees, within 90 and 180",
                         p.latitude_deg, p.longitude_deg));
}

double number_within(const RawItem& raw, std::size_t index, const char* name, double least, double most) {
  const double value = raw.p.at(index);
  if (!(value >= least && value <= most))
    complain(raw.where, fmt::format("{}: {}: must be from {} to {}", name, value, least, most));
  return value;
}

/// A command or frame number; -1: none that there is.
int whole_of(double value) { return value >= 0.0 && value <= 65535.0 ? static_cast<int>(value) : -1; }

/// Over home.
double height_of(const RawItem& raw, double home_height_m) {
  double height_m = raw.p[6];
  constexpr int kSea = 0, kSeaInt = 5, kHome = 3, kHomeInt = 6;
  if (raw.frame == kSea || raw.frame == kSeaInt)
    height_m -= home_height_m;
  else if (raw.frame != kHome && raw.frame != kHomeInt)
    complain(raw.where,
             fmt::format("frame {}: must be 3 or 6 (height over home), 0 or 5 (over the sea)", raw.frame));
  if (!(std::fabs(height_m) <= kMostHeight_m))
    complain(raw.where, fmt::format("height {} m over home: must be within {} m", height_m, kMostHeight_m));
  return height_m;
}

/// Zeros and nothing mean: where it is.
std::optional<EarthPoint> place_of(const RawItem& raw) {
  const bool none = std::isnan(raw.p[4]) || std::isnan(raw.p[5]) || (raw.p[4] == 0.0 && raw.p[5] == 0.0);
  if (none) return std::nullopt;
  const EarthPoint place{raw.p[4], raw.p[5]};
  check_earth(raw.where, place);
  return place;
}

EarthPoint needed_place(const RawItem& raw) {
  const auto place = place_of(raw);
  if (!place) complain(raw.where, "has no latitude and longitude");
  return *place;
}

MissionItem item_of(const RawItem& raw, double home_height_m) {
  MissionItem item;
  item.where = raw.where;
  switch (raw.command) {
    case 16:
    case 19:
      item.kind = ItemKind::kWaypoint;
      item.place = needed_place(raw);
      item.height_m = height_of(raw, home_height_m);
      item.hold_s = std::isnan(raw.p[0]) ? 0.0 : number_within(raw, 0, "hold, s", 0.0, kMostHold_s);
      return item;
    case 20:
      item.kind = ItemKind::kReturn;
      return item;
    case 21:
      item.kind = ItemKind::kLand;
      item.place = place_of(raw);
      return item;
    case 22:
      item.kind = ItemKind::kTakeOff;
      item.height_m = height_of(raw, home_height_m);
      return item;
    case 93:
      item.kind = ItemKind::kHold;
      item.hold_s = number_within(raw, 0, "delay, s (a time of day is not known)", 0.0, kMostHold_s);
      return item;
    case 178:
      item.kind = ItemKind::kSpeed;
      if (raw.p[0] != 0.0 && raw.p[0] != 1.0)
        complain(raw.where, fmt::format("speed type {}: must be 0 or 1 (air or ground speed)", raw.p[0]));
      item.speed_mps = number_within(raw, 1, "speed, m/s", 0.1, kMostSpeed_mps);
      return item;
    case 211:
      item.kind = ItemKind::kRelease;
      if (raw.p[1] != 0.0)
        complain(raw.where, fmt::format("gripper action {}: must be 0 (release)", raw.p[1]));
      return item;
    default:
      complain(
          raw.where,
          fmt::format("command {} is not known: must be 16 way-point, 19 loiter time, 20 return, 21 land, 22 "
                      "take-off, 93 delay, 178 speed or 211 gripper",
                      raw.command));
  }
}

void check_order(const MissionFile& file) {
  bool goes_somewhere = false;
  for (std::size_t i = 0; i < file.items.size(); ++i) {
    const MissionItem& item = file.items[i];
    if (item.kind == ItemKind::kTakeOff && i > 0) complain(item.where, "take-off: must be the first item");
    const bool ends = item.kind == ItemKind::kLand || item.kind == ItemKind::kReturn;
    if (ends && i + 1 < file.items.size()) complain(item.where, "land, return: must be the last item");
    goes_somewhere = goes_somewhere || item.place.has_value();
  }
  if (!goes_somewhere) throw InputError("goes nowhere: must have a way-point");
}

// ---- QGC WPL 110

MissionFile read_wpl(const std::string& text) {
  MissionFile file;
  std::size_t at = text.find('\n');
  bool has_home = false;
  for (int line = 2; at != std::string::npos; ++line) {
    const std::size_t begin = at + 1;
    at = text.find('\n', begin);
    std::string row = text.substr(begin, at == std::string::npos ? std::string::npos : at - begin);
    if (!row.empty() && row.back() == '\r') row.pop_back();
    if (row.empty()) continue;
    const std::string where = fmt::format("line {}", line);
    std::array<double, 12> value{};
    std::size_t count = 0;
    for (std::size_t from = 0; from <= row.size(); ++count) {
      const std::size_t tab = std::min(row.find('\t', from), row.size());
      const std::string cell = row.substr(from, tab - from);
      const auto number = cell == "nan" || cell == "NaN" ? std::optional(kNaN) : input::number(cell);
      if (!number || count == value.size()) complain(where, "must be 12 numbers with tabs between");
      value.at(count) = *number;
      from = tab + 1;
    }
    if (count != value.size()) complain(where, "must be 12 numbers with tabs between");
    RawItem raw{whole_of(value[3]), whole_of(value[2]), {}, where};
    std::copy_n(value.begin() + 4, 7, raw.p.begin());
    if (!has_home) {
      has_home = true;
      file.home = needed_place(raw);
      file.home_height_m = value[10];
      continue;
    }
    if (file.items.size() == kMostItems) complain(where, fmt::format("at most {} items", kMostItems));
    file.items.push_back(item_of(raw, file.home_height_m));
  }
  return file;
}

// ---- .plan

double plain_number(const Json& value, const std::string& where, const char* name) {
  if (!value.is_number()) complain(where, fmt::format("{}: must be a number", name));
  return value.get<double>();
}

const Json& member(const Json& object, const char* key, const std::string& where) {
  if (!object.is_object() || !object.contains(key)) complain(where, fmt::format("has no {}", key));
  return object.at(key);
}

EarthPoint point_of_json(const Json& value, const std::string& where) {
  if (!value.is_array() || value.size() < 2) complain(where, "must be [latitude, longitude]");
  const EarthPoint point{plain_number(value.at(0), where, "latitude"),
                         plain_number(value.at(1), where, "longitude")};
  check_earth(where, point);
  return point;
}

RawItem raw_of(const Json& item, const std::string& where) {
  const Json& type = member(item, "type", where);
  if (type != "SimpleItem")
    complain(where,
             fmt::format("type {}: must be SimpleItem (surveys and scans are not known)", type.dump()));
  RawItem raw{whole_of(plain_number(member(item, "command", where), where, "command")),
              whole_of(plain_number(member(item, "frame", where), where, "frame")),
              {},
              where};
  const Json& params = member(item, "params", where);
  if (!params.is_array() || params.size() != raw.p.size())
    complain(where, "params: must be 7 numbers or nulls");
  for (std::size_t i = 0; i < raw.p.size(); ++i)
    raw.p.at(i) = params.at(i).is_null() ? kNaN : plain_number(params.at(i), where, "params");
  return raw;
}

void read_fence(const Json& fence, MissionFile& file) {
  const auto keep_in = [](const Json& area, const std::string& where) {
    const Json& value = member(area, "inclusion", where);
    if (!value.is_boolean()) complain(where, "inclusion: must be true or false");
    return value.get<bool>();
  };
  int number = 0;
  for (const Json& area : fence.value("polygons", Json::array())) {
    MissionArea a;
    a.where = fmt::format("fence polygon {}", ++number);
    a.keep_in = keep_in(area, a.where);
    for (const Json& point : member(area, "polygon", a.where))
      a.points.push_back(point_of_json(point, a.where));
    file.fence.push_back(std::move(a));
  }
  number = 0;
  for (const Json& area : fence.value("circles", Json::array())) {
    MissionArea a;
    a.where = fmt::format("fence circle {}", ++number);
    a.keep_in = keep_in(area, a.where);
    const Json& circle = member(area, "circle", a.where);
    a.points.push_back(point_of_json(member(circle, "center", a.where), a.where));
    a.radius_m = plain_number(member(circle, "radius", a.where), a.where, "radius");
    if (!(a.radius_m > 0.0)) complain(a.where, "radius: must be above 0 m");
    file.fence.push_back(std::move(a));
  }
}

MissionFile read_plan(const std::string& text) {
  const Json root = input::parse_json<Json>(text);
  if (!root.is_object() || root.value("fileType", Json()) != "Plan")
    throw InputError("fileType: must be Plan");
  const Json& mission = member(root, "mission", "plan");
  MissionFile file;
  const Json& home = member(mission, "plannedHomePosition", "mission");
  file.home = point_of_json(home, "plannedHomePosition");
  file.home_height_m = home.size() > 2 ? plain_number(home.at(2), "plannedHomePosition", "height") : 0.0;
  const Json& items = member(mission, "items", "mission");
  if (!items.is_array() || items.size() > kMostItems)
    throw InputError(fmt::format("items: must be a list of at most {}", kMostItems));
  for (std::size_t i = 0; i < items.size(); ++i) {
    const std::string where = fmt::format("item {}", i + 1);
    file.items.push_back(item_of(raw_of(items.at(i), where), file.home_height_m));
  }
  if (root.contains("geoFence") && root.at("geoFence").is_object()) read_fence(root.at("geoFence"), file);
  if (root.contains("rallyPoints") && root.at("rallyPoints").is_object() &&
      !root.at("rallyPoints").value("points", Json::array()).empty())
    throw InputError("rallyPoints: are not known: the failsafe returns to where it took off");
  return file;
}

}  // namespace

MissionFile load_mission(const std::string& path) {
  constexpr std::size_t kMost_bytes = 4U << 20U;
  constexpr const char* kWanted = "a mission: .plan of QGroundControl, or QGC WPL 110";
  const std::string text = input::read_text(path, kWanted, kMost_bytes);
  try {
    const bool is_wpl = text.rfind("QGC WPL", 0) == 0;
    if (is_wpl && text.rfind("QGC WPL 110", 0) != 0) complain("line 1", "must be QGC WPL 110");
    if (!is_wpl && (text.empty() || text.front() != '{'))
      throw InputError(fmt::format("must be {}", kWanted));
    MissionFile file = is_wpl ? read_wpl(text) : read_plan(text);
    check_order(file);
    return file;
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", path, error.what()));
  }
}

}  // namespace roborun::mavlink
