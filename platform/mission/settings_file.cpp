#include "platform/mission/settings_file.hpp"

#include <algorithm>
#include <vector>

#include "platform/input/text_file.hpp"
#include "platform/input/toml_reader.hpp"

namespace roborun::mission {
namespace {

struct Range {
  double low;
  double high;
};

/// A number within [low, high] into `value`, if the key is there.
void read(const input::TomlReader& reader, const toml::table& table, const char* key, Range range,
          double& value) {
  const toml::node* node = table.get(key);
  if (node == nullptr) return;
  const auto raw = node->is_integer() || node->is_floating_point() ? node->value<double>() : std::nullopt;
  if (!raw || !(*raw >= range.low && *raw <= range.high))
    reader.refuse(*node, key, fmt::format("must be a number from {} to {}", range.low, range.high));
  value = *raw;
}

const toml::table* section(const input::TomlReader& reader, const toml::table& root, const char* name,
                           const std::set<std::string_view>& keys) {
  const toml::node* node = root.get(name);
  if (node == nullptr) return nullptr;
  if (node->as_table() == nullptr) reader.refuse(*node, name, fmt::format("must be a table: [{}]", name));
  reader.allow_keys(*node->as_table(), fmt::format("[{}]", name), keys);
  return node->as_table();
}

void check(const input::TomlReader& reader, const toml::node& node, const char* key, core::FenceFault fault) {
  if (fault != core::FenceFault::kNone) reader.refuse(node, key, core::to_string(fault));
}

/// `count` numbers; the fence itself judges their range.
std::vector<double> numbers(const input::TomlReader& reader, const toml::node& node, const char* key,
                            std::size_t count, const char* form) {
  const toml::array* array = node.as_array();
  if (array == nullptr || array->size() != count) reader.refuse(node, key, fmt::format("must be {}", form));
  std::vector<double> values;
  for (const toml::node& n : *array) {
    const auto value = n.is_integer() || n.is_floating_point() ? n.value<double>() : std::nullopt;
    if (!value) reader.refuse(node, key, fmt::format("must be {}", form));
    values.push_back(*value);
  }
  return values;
}

void read_areas(const input::TomlReader& reader, const toml::table& table, const char* key,
                core::FenceSide side, core::Fence& fence) {
  constexpr const char* kForm = "[{ polygon = [[x, y], ...] }, { circle = [x, y, radius] }]";
  const toml::node* list = table.get(key);
  if (list == nullptr) return;
  if (list->as_array() == nullptr) reader.refuse(*list, key, fmt::format("must be {}", kForm));
  for (const toml::node& node : *list->as_array()) {
    const toml::table* area = node.as_table();
    if (area == nullptr || area->size() != 1) reader.refuse(node, key, fmt::format("must be {}", kForm));
    reader.allow_keys(*area, key, {"polygon", "circle"});
    if (const toml::node* circle = area->get("circle")) {
      const auto v = numbers(reader, *circle, "circle", 3, "[x, y, radius]");
      check(reader, *circle, "circle", fence.add_circle(side, {v[0], v[1]}, v[2]));
      continue;
    }
    const toml::node& polygon = *area->get("polygon");
    if (polygon.as_array() == nullptr) reader.refuse(polygon, "polygon", "must be [[x, y], [x, y], ...]");
    std::vector<core::FencePoint> points;
    for (const toml::node& point : *polygon.as_array()) {
      const auto v = numbers(reader, point, "polygon", 2, "[[x, y], [x, y], ...]");
      points.push_back({v[0], v[1]});
    }
    check(reader, polygon, "polygon", fence.add_polygon(side, points));
  }
}

/// What [camera] says goes for all cameras of the rig.
void apply(const toml::table& said, const sitl::DepthCameraConfig& camera, SensorRig& rig) {
  for (CameraSpec& c : rig.cameras) {
    if (said.contains("pixels")) c.width = c.height = camera.pixels;
    if (said.contains("range_m")) c.range_m = camera.range_m;
    if (said.contains("rate_Hz")) c.rate_Hz = camera.rate_Hz;
    if (said.contains("latency_s")) c.latency_s = camera.latency_s;
  }
}

void limit_range(double range_m, SensorRig& rig) {
  for (CameraSpec& c : rig.cameras) c.range_m = std::min(c.range_m, range_m);
  for (LidarSpec& l : rig.lidars) l.range_m = std::min(l.range_m, range_m);
}

}  // namespace

void load_settings(const std::string& path, MissionConfig& config) {
  const toml::table root = input::parse_toml(path, input::read_text(path, "a readable TOML file"));
  const input::TomlReader reader(path);
  reader.allow_keys(root, "the file", kSettingsTables);
  read_settings(reader, root, config);
}

void read_settings(const input::TomlReader& reader, const toml::table& root, MissionConfig& config) {
  if (const toml::table* t = section(reader, root, "camera",
                                     {"pixels", "range_m", "rate_Hz", "latency_s", "noise_m", "noise_per_m",
                                      "pixel_dropout_ratio", "frame_dropout_ratio"})) {
    sitl::DepthCameraConfig& c = config.simulator.camera;
    double pixels = c.pixels;
    read(reader, *t, "pixels", {8, 1280}, pixels);
    c.pixels = static_cast<std::uint16_t>(pixels);
    read(reader, *t, "range_m", {5, 100}, c.range_m);
    read(reader, *t, "rate_Hz", {1, 100}, c.rate_Hz);
    read(reader, *t, "latency_s", {0, 0.4}, c.latency_s);
    read(reader, *t, "noise_m", {0, 1}, c.noise_m);
    read(reader, *t, "noise_per_m", {0, 0.1}, c.noise_per_m);
    read(reader, *t, "pixel_dropout_ratio", {0, 1}, c.pixel_dropout_ratio);
    read(reader, *t, "frame_dropout_ratio", {0, 1}, c.frame_dropout_ratio);
    if (config.simulator.rig) apply(*t, c, *config.simulator.rig);
  }
  if (const toml::table* t = section(reader, root, "wind", {"mean_mps", "gust_mps"})) {
    if (const toml::node* mean = t->get("mean_mps")) {
      config.simulator.wind.mean_W_mps = reader.point(*mean, "mean_mps");
      if (config.simulator.wind.mean_W_mps.norm() > 20.0)
        reader.refuse(*mean, "mean_mps", "must be at most 20 m/s");
    }
    read(reader, *t, "gust_mps", {0, 10}, config.simulator.wind.gust_mps);
  }
  if (const toml::table* t = section(reader, root, "battery", {"capacity_J"}))
    read(reader, *t, "capacity_J", {1e3, 1e9}, config.flight.vehicle.battery_J);
  if (const toml::table* t = section(reader, root, "flight", {"v_max_mps", "time_limit_s"})) {
    read(reader, *t, "v_max_mps", {0.5, 12}, config.flight.vehicle.speed_mps);
    read(reader, *t, "time_limit_s", {1, 100000}, config.judge.time_limit_s);
  }
  if (const toml::table* t = section(reader, root, "cpu", {"slow_down_at_s", "slow_down_factor"})) {
    read(reader, *t, "slow_down_at_s", {0, 100000}, config.slow_down.at_s);
    read(reader, *t, "slow_down_factor", {0.1, 100}, config.slow_down.factor);
  }
  if (const toml::table* t = section(reader, root, "fog", {"visibility_m"})) {
    double visibility_m = config.simulator.camera.range_m;
    read(reader, *t, "visibility_m", {5, 100}, visibility_m);
    config.simulator.camera.range_m = std::min(config.simulator.camera.range_m, visibility_m);
    if (config.simulator.rig) limit_range(visibility_m, *config.simulator.rig);
  }
  if (const toml::table* t = section(reader, root, "fence", {"altitude_m", "keep_in", "keep_out"})) {
    if (const toml::node* node = t->get("altitude_m")) {
      const auto v = numbers(reader, *node, "altitude_m", 2, "[lowest, highest]");
      check(reader, *node, "altitude_m", config.flight.fence.set_altitude(v[0], v[1]));
    }
    read_areas(reader, *t, "keep_in", core::FenceSide::kKeepIn, config.flight.fence);
    read_areas(reader, *t, "keep_out", core::FenceSide::kKeepOut, config.flight.fence);
  }
}

}  // namespace roborun::mission
