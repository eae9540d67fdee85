#include "platform/vehicle/vehicle_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <set>
#include <string_view>

#include "core/record/state_hash.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/text_file.hpp"
#include "platform/input/toml_reader.hpp"
#include "platform/vehicle/shipped_vehicles.hpp"

namespace roborun::vehicle {
namespace {

constexpr std::array<const char*, 3> kStoppingKeys{"quadratic_s2pm", "linear_s", "constant_m"};

bool is_whole(std::string_view key) {
  return key == "width" || key == "height" || key == "rings" || key == "columns";
}

/// In the middle of the vehicle, and not turned: what a mount is without these.
bool is_mount(std::string_view key) {
  return key == "x_m" || key == "y_m" || key == "z_m" || key == "yaw_deg" || key == "pitch_deg" ||
         key == "roll_deg";
}

std::set<std::string_view> tables() {
  std::set<std::string_view> names{"vehicle", "stopping", "camera", "lidar", "imu", "gnss", "odometry"};
  for (const VehicleKey& key : kVehicleKeys) names.insert(key.table);
  return names;
}

constexpr const char* kSix = "-six";

/// A shipped vehicle, as it is or with other cameras.
struct Variant {
  const ShippedVehicle* shipped{};
  bool six{};
  std::optional<CameraModel> model{};
};

/// NAME, NAME-six, NAME-MODEL, NAME-six-MODEL; none for any other name.
std::optional<Variant> variant_of(std::string_view name) {
  for (const ShippedVehicle& v : kShippedVehicles) {
    if (!name.starts_with(v.name)) continue;
    std::string_view rest = name.substr(std::string_view(v.name).size());
    Variant variant{&v};
    variant.six = rest.starts_with(kSix);
    if (variant.six) rest.remove_prefix(std::string_view(kSix).size());
    if (rest.empty()) return variant;
    if (rest.front() != '-') continue;
    variant.model = model_of<CameraModel>(rest.substr(1));
    if (variant.model && variant.model != CameraModel::kClean) return variant;
  }
  return std::nullopt;
}

/// With the errors of that product; optics and range stay.
void see_as(Vehicle& vehicle, CameraModel model) {
  const std::string name = fmt::format("-{}", to_string(model));
  vehicle.name += name;
  vehicle.digest += name;
  vehicle.about += fmt::format("; with the errors of {} cameras", to_string(model));
  for (CameraSpec& camera : vehicle.rig.cameras) camera.model = model;
}

/// Six cameras with the range, rate and latency of its first, which see everything around it.
void see_all_round(Vehicle& vehicle) {
  vehicle.name += kSix;
  vehicle.digest += kSix;
  vehicle.about += "; this one has six, all round";
  CameraSpec camera = vehicle.rig.cameras[0];
  const CameraSpec wide;
  camera.width = wide.width;
  camera.height = wide.height;
  camera.tan_half_width = camera.tan_half_height = wide.tan_half_width;
  vehicle.rig.cameras.clear();
  camera.range_min_m =
      wide.range_min_m;  // from the ground, what is nearer than that to all six stays unknown
  vehicle.rig.lidars.clear();
  vehicle.patterns.clear();
  constexpr double kRight_deg = 90.0;
  for (const double yaw_deg : {0.0, kRight_deg, 2.0 * kRight_deg, 3.0 * kRight_deg}) {
    camera.mount = {.yaw_deg = yaw_deg};
    (void)vehicle.rig.cameras.push_back(camera);
  }
  for (const double pitch_deg : {-kRight_deg, kRight_deg}) {
    camera.mount = {.pitch_deg = pitch_deg};
    (void)vehicle.rig.cameras.push_back(camera);
  }
}

class VehicleReader {
 public:
  VehicleReader(const std::string& path, const std::string& text)
      : reader_(path), path_(path), root_(input::parse_toml(path, text)) {}

  Vehicle read() const {
    reader_.allow_keys(root_, "a vehicle file", tables());
    Vehicle vehicle;
    read_head(vehicle);
    read_model(vehicle.model);
    vehicle.model.measured_stopping = measured_stopping();
    read_sensors("camera", vehicle.rig.cameras, nullptr);
    read_sensors("lidar", vehicle.rig.lidars, &vehicle.patterns);
    read_model_of("imu", vehicle.rig.imu);
    read_model_of("gnss", vehicle.rig.gnss);
    read_model_of("odometry", vehicle.rig.odometry);
    if (vehicle.rig.cameras.empty() && vehicle.rig.lidars.empty())
      reader_.refuse(root_, "camera", "missing: must have at least one [[camera]] or [[lidar]]");
    return vehicle;
  }

 private:
  const toml::table& table(const char* name) const {
    const toml::node& node = reader_.need(root_, name, "a vehicle file");
    if (node.as_table() == nullptr) reader_.refuse(node, name, fmt::format("must be a table: [{}]", name));
    return *node.as_table();
  }
  void read_head(Vehicle& vehicle) const {
    const toml::table& head = table("vehicle");
    reader_.allow_keys(head, "[vehicle]", {"name", "about"});
    for (const auto& [key, to] : {std::pair("name", &vehicle.name), std::pair("about", &vehicle.about)}) {
      const toml::node& node = reader_.need(head, key, "[vehicle]");
      const auto value = node.value<std::string>();
      if (!value || value->empty() || value->find('\n') != std::string::npos)
        reader_.refuse(node, key, "must be one line of text");
      *to = *value;
    }
  }
  void read_model(VehicleModel& model) const {
    for (const VehicleKey& key : kVehicleKeys) {
      const toml::table& from = table(key.table);
      model.*key.value = key.left_out.value_or(model.*key.value);
      if (key.left_out && from.get(key.key) == nullptr) continue;
      const toml::node& node = reader_.need(from, key.key, fmt::format("[{}]", key.table));
      model.*key.value = reader_.number(node, key.key, key.low, key.high);
    }
    for (const char* name : {"body", "propulsion", "drag", "power", "limits"}) {
      std::set<std::string_view> known;
      for (const VehicleKey& key : kVehicleKeys) {
        if (std::string_view(key.table) == name) known.insert(key.key);
      }
      reader_.allow_keys(table(name), fmt::format("[{}]", name), known);
    }
  }
  template <typename Model>
  void read_model_of(const char* name, Model& model) const {
    if (root_.get(name) == nullptr) return;
    const toml::table& from = table(name);
    reader_.allow_keys(from, fmt::format("[{}]", name), {"model"});
    (void)reader_.need(from, "model", fmt::format("[{}]", name));
    read_model_name(from, model);
  }
  template <typename Model>
  void read_model_name(const toml::table& from, Model& model) const {
    const toml::node* node = from.get("model");
    if (node == nullptr) return;
    const auto found = model_of<Model>(node->value<std::string>().value_or(""));
    if (!found)
      reader_.refuse(*node, "model",
                     fmt::format("must be one of \"{}\"", fmt::join(names_of(Model{}), "\", \"")));
    model = *found;
  }
  void read_invalid_ratio(const toml::table& from, CameraSpec& camera) const {
    const toml::node* node = from.get("invalid_ratio");
    if (node == nullptr) return;
    if (camera.model == CameraModel::kClean)
      reader_.refuse(*node, "invalid_ratio", "must not be there without a model other than \"clean\"");
    camera.invalid_ratio = reader_.number(*node, "invalid_ratio", 0.0, kMostInvalid);
  }
  void read_invalid_ratio(const toml::table&, LidarSpec&) const {}
  template <typename Sensors>
  void read_sensors(const char* name, Sensors& sensors, std::vector<std::string>* patterns) const {
    const toml::node* list = root_.get(name);
    if (list == nullptr) return;
    if (list->as_array() == nullptr)
      reader_.refuse(*list, name, fmt::format("must be written as [[{}]]", name));
    for (const toml::node& node : *list->as_array()) {
      const toml::table* from = node.as_table();
      if (from == nullptr) reader_.refuse(node, name, fmt::format("must be written as [[{}]]", name));
      auto sensor = typename Sensors::value_type{};
      read_sensor(fmt::format("[[{}]]", name), *from, sensor);
      if (!sensors.push_back(sensor))
        reader_.refuse(node, name, fmt::format("must be at most {}", Sensors::capacity()));
      if (patterns != nullptr) patterns->push_back(pattern_of(*from));
    }
  }
  /// Relative to this file.
  std::string pattern_of(const toml::table& lidar) const {
    const toml::node* node = lidar.get("pattern");
    if (node == nullptr) return {};
    const auto name = node->value<std::string>();
    if (!name || name->empty()) reader_.refuse(*node, "pattern", "must be the path of a file");
    return (std::filesystem::path(path_).parent_path() / *name).string();
  }
  template <typename Spec>
  void read_sensor(const std::string& where, const toml::table& from, Spec& sensor) const {
    std::set<std::string_view> known;
    for (const SensorKey<Spec>& key : keys_of(sensor)) {
      known.insert(key.key);
      if (is_mount(key.key) && from.get(key.key) == nullptr) continue;
      const toml::node& node = reader_.need(from, key.key, where);
      (void)assign(key, sensor,
                   is_whole(key.key) ? reader_.whole(node, key.key, key.low, key.high)
                                     : reader_.number(node, key.key, key.low, key.high));
    }
    known.insert("model");
    known.insert(where == "[[lidar]]" ? "pattern" : "invalid_ratio");
    read_model_name(from, sensor.model);
    read_invalid_ratio(from, sensor);
    reader_.allow_keys(from, where, known);
    if (!(sensor.range_m > sensor.range_min_m))
      reader_.refuse(*from.get("range_m"), "range_m", "must be more than range_min_m");
  }
  std::optional<StoppingModel> measured_stopping() const {
    if (root_.get("stopping") == nullptr) return std::nullopt;
    const toml::table& from = table("stopping");
    reader_.allow_keys(from, "[stopping]", {kStoppingKeys.begin(), kStoppingKeys.end()});
    const auto number = [&](const char* key, double low, double high) {
      return reader_.number(reader_.need(from, key, "[stopping]"), key, low, high);
    };
    return StoppingModel{number("quadratic_s2pm", 0.0, 10.0), number("linear_s", 0.0, 10.0),
                         number("constant_m", -10.0, 10.0)};
  }

  input::TomlReader reader_;
  std::string path_;
  toml::table root_;
};

}  // namespace

Vehicle vehicle_from_toml(const std::string& path, const std::string& text) {
  Vehicle vehicle = VehicleReader(path, text).read();
  core::StateHash hash;
  for (const char c : text) hash.add(static_cast<std::uint64_t>(static_cast<unsigned char>(c)));
  vehicle.digest = fmt::format("{:016x}", hash.value());
  if (const char* why = cannot_fly(vehicle.model, shortest_range_m(vehicle.rig)))
    throw InputError(fmt::format("{}: {}", path, why));
  if (const auto fault = first_fault(vehicle.rig))
    throw InputError(fmt::format("{}: {} {}: {}: must be from {} to {}: {}", path, fault->sensor,
                                 fault->index + 1, fault->key, fault->low, fault->high, fault->text));
  if (!looks_forward(vehicle.rig))
    throw InputError(
        fmt::format("{}: cannot see where it flies: a camera or LiDAR must look within 45 degrees of "
                    "forward (yaw_deg, pitch_deg)",
                    path));
  return vehicle;
}

bool ships(const std::string& name) { return variant_of(name).has_value(); }

std::vector<std::string> shipped_vehicles() {
  std::vector<std::string> names;
  names.reserve(kShippedVehicles.size());
  for (const ShippedVehicle& v : kShippedVehicles) names.emplace_back(v.name);
  return names;
}

Vehicle load_vehicle(const std::string& name_or_path) {
  if (const std::optional<Variant> variant = variant_of(name_or_path)) {
    Vehicle vehicle = vehicle_from_toml(variant->shipped->name, variant->shipped->text);
    if ((variant->six || variant->model) && vehicle.rig.cameras.empty())
      throw InputError(fmt::format("{}: {} has no camera: must be a vehicle with one", name_or_path,
                                   variant->shipped->name));
    if (variant->six) see_all_round(vehicle);
    if (variant->model) see_as(vehicle, *variant->model);
    return vehicle;
  }
  return vehicle_from_toml(name_or_path,
                           input::read_text(name_or_path, fmt::format("a vehicle file, or one of {}",
                                                                      fmt::join(shipped_vehicles(), ", "))));
}

std::vector<input::KeyText> vehicle_keys() {
  std::vector<input::KeyText> keys;
  keys.reserve(kVehicleKeys.size() + kCameraKeys.size() + kLidarKeys.size());
  const VehicleModel defaults;
  for (const VehicleKey& key : kVehicleKeys)
    keys.push_back({key.table, key.key, key.low, key.high, key.left_out.value_or(defaults.*key.value),
                    std::string(key.text) + (key.left_out ? "; may be left out" : "")});
  const auto add = [&keys](const char* table, const auto& sensor) {
    for (const auto& key : keys_of(sensor))
      keys.push_back({table, key.key, key.low, key.high, key.get(sensor), key.text});
  };
  add("[camera]", CameraSpec{});
  add("[lidar]", LidarSpec{});
  return keys;
}

}  // namespace roborun::vehicle
