#include "platform/mission/settings_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "platform/input/text_file.hpp"
#include "platform/input/toml_reader.hpp"

namespace roborun::mission {
namespace {

/// What [camera] says goes for all cameras of the rig, too.
template <typename Set>
void set_cameras(MissionConfig& config, Set&& set) {
  if (!config.simulator.rig) return;
  for (CameraSpec& camera : config.simulator.rig->cameras) set(camera);
}

void limit_range(MissionConfig& config, double range_m) {
  double& camera_m = config.simulator.camera.range_m;
  camera_m = std::min(camera_m, range_m);
  if (!config.simulator.rig) return;
  for (CameraSpec& c : config.simulator.rig->cameras) c.range_m = std::min(c.range_m, range_m);
  for (LidarSpec& l : config.simulator.rig->lidars) l.range_m = std::min(l.range_m, range_m);
}

/// One number of a settings file.
struct SettingKey {
  const char* table;
  const char* key;
  double (*get)(const MissionConfig&);
  void (*set)(MissionConfig&, double);
  double low, high;  ///< Both allowed.
  bool whole;
  const char* text;
};

// clang-format off
constexpr std::array<SettingKey, 17> kSettings = [] {
  using C = MissionConfig;
  return std::array<SettingKey, 17>{{
    {"camera", "pixels", [](const C& c) { return static_cast<double>(c.simulator.camera.pixels); },
     [](C& c, double v) { c.simulator.camera.pixels = static_cast<std::uint16_t>(v);
                          set_cameras(c, [v](CameraSpec& s) { s.width = s.height = static_cast<std::uint16_t>(v); }); },
     8, 1280, true, "a side of each image, a whole number"},
    {"camera", "range_m", [](const C& c) { return c.simulator.camera.range_m; },
     [](C& c, double v) { c.simulator.camera.range_m = v; set_cameras(c, [v](CameraSpec& s) { s.range_m = v; }); },
     5, 100, false, "depth beyond which a camera sees nothing"},
    {"camera", "rate_Hz", [](const C& c) { return c.simulator.camera.rate_Hz; },
     [](C& c, double v) { c.simulator.camera.rate_Hz = v; set_cameras(c, [v](CameraSpec& s) { s.rate_Hz = v; }); },
     1, 100, false, "images per second"},
    {"camera", "latency_s", [](const C& c) { return c.simulator.camera.latency_s; },
     [](C& c, double v) { c.simulator.camera.latency_s = v; set_cameras(c, [v](CameraSpec& s) { s.latency_s = v; }); },
     0, 0.4, false, "from exposure to the depth image"},
    {"camera", "noise_m", [](const C& c) { return c.simulator.camera.noise_m; },
     [](C& c, double v) { c.simulator.camera.noise_m = v; }, 0, 1, false, "one sigma at zero depth"},
    {"camera", "noise_per_m", [](const C& c) { return c.simulator.camera.noise_per_m; },
     [](C& c, double v) { c.simulator.camera.noise_per_m = v; }, 0, 0.1, false, "one sigma besides, times depth squared"},
    {"camera", "pixel_dropout_ratio", [](const C& c) { return c.simulator.camera.pixel_dropout_ratio; },
     [](C& c, double v) { c.simulator.camera.pixel_dropout_ratio = v; }, 0, 1, false, "pixels that say nothing"},
    {"camera", "frame_dropout_ratio", [](const C& c) { return c.simulator.camera.frame_dropout_ratio; },
     [](C& c, double v) { c.simulator.camera.frame_dropout_ratio = v; }, 0, 1, false, "images that never arrive"},
    {"camera", "invalid_ratio", [](const C& c) { return c.simulator.camera.invalid_ratio; },
     [](C& c, double v) { c.simulator.camera.invalid_ratio = v; set_cameras(c, [v](CameraSpec& s) { s.invalid_ratio = v; }); },
     0, kMostInvalid, false, "pixels without a value on surfaces, in patches; of models but clean"},
    {"rain", "rate_mmph", [](const C& c) { return c.simulator.lidar.rain_mmph; },
     [](C& c, double v) { c.simulator.lidar.rain_mmph = v; }, 0, 100, false, "what falls; seen by LiDARs of models but clean"},
    {"wind", "gust_mps", [](const C& c) { return c.simulator.wind.gust_mps; },
     [](C& c, double v) { c.simulator.wind.gust_mps = v; }, 0, 10, false, "one sigma of the gusts along each axis, half of it upwards"},
    {"battery", "capacity_J", [](const C& c) { return c.flight.vehicle.battery_J; },
     [](C& c, double v) { c.flight.vehicle.battery_J = v; }, 1e3, 1e9, false, "usable energy of a full battery"},
    {"flight", "v_max_mps", [](const C& c) { return c.flight.vehicle.speed_mps; },
     [](C& c, double v) { c.flight.vehicle.speed_mps = v; }, 0.5, 30, false, "fastest flight of the design aware"},
    {"flight", "time_limit_s", [](const C& c) { return c.judge.time_limit_s; },
     [](C& c, double v) { c.judge.time_limit_s = v; }, 1, 100000, false, "after which a mission is given up"},
    {"cpu", "slow_down_at_s", [](const C& c) { return c.slow_down.at_s; },
     [](C& c, double v) { c.slow_down.at_s = v; }, 0, 100000, false, "from then on the processor is throttled"},
    {"cpu", "slow_down_factor", [](const C& c) { return c.slow_down.factor; },
     [](C& c, double v) { c.slow_down.factor = v; }, 0.1, 100, false, "times as long as before"},
    {"fog", "visibility_m", [](const C& c) { return c.simulator.camera.range_m; }, limit_range,
     5, 100, false, "no sensor sees farther"},
  }};
}();
// clang-format on

/// Keys that are no single number.
constexpr std::array<std::pair<const char*, const char*>, 10> kOtherKeys{{{"camera", "model"},
                                                                          {"lidar", "model"},
                                                                          {"imu", "model"},
                                                                          {"gnss", "model"},
                                                                          {"odometry", "model"},
                                                                          {"wind", "mean_mps"},
                                                                          {"flight", "aim"},
                                                                          {"fence", "altitude_m"},
                                                                          {"fence", "keep_in"},
                                                                          {"fence", "keep_out"}}};

std::set<std::string_view> keys_of(std::string_view table) {
  std::set<std::string_view> keys;
  for (const SettingKey& key : kSettings) {
    if (table == key.table) keys.insert(key.key);
  }
  for (const auto& [of, key] : kOtherKeys) {
    if (table == of) keys.insert(key);
  }
  return keys;
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

template <typename Model>
std::optional<Model> read_model(const input::TomlReader& reader, const toml::table& root, const char* name) {
  const toml::table* table = section(reader, root, name, keys_of(name));
  const toml::node* node = table == nullptr ? nullptr : table->get("model");
  if (node == nullptr) return std::nullopt;
  const auto model = model_of<Model>(node->value<std::string>().value_or(""));
  if (!model)
    reader.refuse(*node, "model",
                  fmt::format("must be one of \"{}\"", fmt::join(names_of(Model{}), "\", \"")));
  return model;
}

void read_models(const input::TomlReader& reader, const toml::table& root, MissionConfig& config) {
  sitl::SimulatorConfig& simulator = config.simulator;
  if (const auto model = read_model<CameraModel>(reader, root, "camera")) {
    simulator.camera.model = *model;
    set_cameras(config, [model](CameraSpec& s) { s.model = *model; });
  }
  if (const auto model = read_model<LidarModel>(reader, root, "lidar")) {
    if (!simulator.rig || simulator.rig->lidars.empty())
      reader.refuse(*root.get("lidar"), "lidar", "must not be there: the vehicle has none");
    for (LidarSpec& lidar : simulator.rig->lidars) lidar.model = *model;
  }
  if (const auto model = read_model<ImuModel>(reader, root, "imu")) simulator.sensors.imu = *model;
  if (const auto model = read_model<GnssModel>(reader, root, "gnss")) simulator.sensors.gnss = *model;
  if (const auto model = read_model<OdometryModel>(reader, root, "odometry"))
    simulator.sensors.odometry = *model;
}

/// Numbers that no sensor of this vehicle takes notice of.
void refuse_idle(const input::TomlReader& reader, const toml::table& root, const MissionConfig& config) {
  const SensorRig rig = sitl::rig_of(config.simulator);
  const auto clean_camera = [](const CameraSpec& c) { return c.model == CameraModel::kClean; };
  const auto clean_lidar = [](const LidarSpec& l) { return l.model == LidarModel::kClean; };
  if (config.simulator.sensors.gnss == GnssModel::kNone &&
      config.simulator.sensors.odometry == OdometryModel::kNone && root.get("gnss") != nullptr)
    reader.refuse(*root.get("gnss"), "model", "must not be \"none\" without [odometry] model = \"vio\"");
  const auto refuse = [&](const char* table, const char* key, const char* what) {
    const toml::node* node = root.get(table);
    if (node == nullptr || node->as_table() == nullptr || node->as_table()->get(key) == nullptr) return;
    reader.refuse(*node->as_table()->get(key), key, what);
  };
  if (std::all_of(rig.cameras.begin(), rig.cameras.end(), clean_camera))
    refuse("camera", "invalid_ratio", "must not be there without a camera of a model other than \"clean\"");
  if (std::none_of(rig.cameras.begin(), rig.cameras.end(), clean_camera))
    for (const char* key : {"noise_m", "noise_per_m", "pixel_dropout_ratio"})
      refuse("camera", key,
             "must not be there without a camera of the model \"clean\": others have their own");
  if (std::all_of(rig.lidars.begin(), rig.lidars.end(), clean_lidar))
    refuse("rain", "rate_mmph", "must not be there without a LiDAR of a model other than \"clean\"");
}

}  // namespace

void load_settings(const std::string& path, MissionConfig& config) {
  const toml::table root = input::parse_toml(path, input::read_text(path, "a readable TOML file"));
  const input::TomlReader reader(path);
  reader.allow_keys(root, "the file", kSettingsTables);
  read_settings(reader, root, config);
}

void read_settings(const input::TomlReader& reader, const toml::table& root, MissionConfig& config) {
  for (const SettingKey& key : kSettings) {
    const toml::table* table = section(reader, root, key.table, keys_of(key.table));
    const toml::node* node = table == nullptr ? nullptr : table->get(key.key);
    if (node == nullptr) continue;
    key.set(config, key.whole ? reader.whole(*node, key.key, key.low, key.high)
                              : reader.number(*node, key.key, key.low, key.high));
  }
  if (const toml::table* t = section(reader, root, "cpu", keys_of("cpu")); t != nullptr && t->size() == 1)
    reader.refuse(t->begin()->second, t->begin()->first.str(),
                  "goes with the other key of [cpu]: slow_down_at_s and slow_down_factor");
  read_models(reader, root, config);
  refuse_idle(reader, root, config);
  if (const toml::table* t = section(reader, root, "wind", keys_of("wind"))) {
    if (const toml::node* mean = t->get("mean_mps")) {
      config.simulator.wind.mean_W_mps = reader.point(*mean, "mean_mps");
      if (config.simulator.wind.mean_W_mps.norm() > 20.0)
        reader.refuse(*mean, "mean_mps", "must be at most 20 m/s");
    }
  }
  if (const toml::table* t = section(reader, root, "flight", keys_of("flight"))) {
    if (const toml::node* aim = t->get("aim")) {
      const auto known = aim_named(aim->value<std::string>().value_or(""));
      if (!known) reader.refuse(*aim, "aim", "must be \"time\" or \"energy\"");
      config.flight.aim = *known;
    }
  }
  if (const toml::table* t = section(reader, root, "fence", keys_of("fence"))) {
    if (const toml::node* node = t->get("altitude_m")) {
      const auto v = numbers(reader, *node, "altitude_m", 2, "[lowest, highest]");
      check(reader, *node, "altitude_m", config.flight.fence.set_altitude(v[0], v[1]));
    }
    read_areas(reader, *t, "keep_in", core::FenceSide::kKeepIn, config.flight.fence);
    read_areas(reader, *t, "keep_out", core::FenceSide::kKeepOut, config.flight.fence);
  }
}

std::vector<input::KeyText> settings_keys() {
  std::vector<input::KeyText> keys;
  keys.reserve(kSettings.size());
  const MissionConfig defaults;
  for (const SettingKey& key : kSettings)
    keys.push_back({key.table, key.key, key.low, key.high, key.get(defaults), key.text});
  return keys;
}

}  // namespace roborun::mission
