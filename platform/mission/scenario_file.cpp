#include "platform/mission/scenario_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "platform/board/board_profile.hpp"
#include "platform/input/arguments.hpp"
#include "platform/input/text_file.hpp"
#include "platform/input/toml_reader.hpp"
#include "platform/mission/settings_file.hpp"
#include "platform/mission/verdict.hpp"
#include "platform/sitl/world/body_reader.hpp"
#include "platform/sitl/world/generator.hpp"
#include "platform/sitl/world/world_file.hpp"

namespace roborun::mission {
namespace {

constexpr std::array<const char*, 12> kOutcomes{"reached_goal", "landed",    "holding",      "terminated",
                                                "killed",       "collision", "time_limit",   "battery_empty",
                                                "gave_up",      "no_way",    "goal_blocked", "struck"};

constexpr std::array<const char*, 3> kOfScenarios{"scenario", "expect", "fault"};

class ScenarioReader {
 public:
  explicit ScenarioReader(const std::string& path)
      : path_(path),
        reader_(path),
        root_(input::parse_toml(path, input::read_text(path, "a readable TOML file"))) {}
  Scenario read();

 private:
  void read_head(Scenario& s) const;
  void read_faults(Scenario& s) const;
  double size_of(const toml::node& node, const sitl::ComponentSpec& spec, sitl::FaultKind kind) const;
  void read_goals(Scenario& s) const;
  void read_expectation(Scenario& s) const;
  std::string text(const toml::node& node, std::string_view key) const {
    const auto value = node.value_exact<std::string>();
    if (!value) reader_.refuse(node, key, "must be a text in quotes");
    return *value;
  }
  /// The index of the text among the names.
  template <typename Names>
  std::size_t choice(const toml::node& node, std::string_view key, const Names& names) const {
    const std::string value = text(node, key);
    const auto found = std::find(names.begin(), names.end(), value);
    if (found == names.end())
      reader_.refuse(node, key, fmt::format("'{}' must be one of {}", value, fmt::join(names, ", ")));
    return static_cast<std::size_t>(found - names.begin());
  }
  double number(const toml::node& node, std::string_view key, double low, double high) const {
    const double value = reader_.number(node, key);
    if (!(value >= low && value <= high))
      reader_.refuse(node, key, fmt::format("must be a number from {} to {}", low, high));
    return value;
  }
  std::optional<double> maybe(const toml::table& table, const char* key, double high) const {
    const toml::node* node = table.get(key);
    return node == nullptr ? std::nullopt : std::optional(number(*node, key, 0.0, high));
  }
  bool truth(const toml::node& node, std::string_view key) const {
    const auto value = node.value_exact<bool>();
    if (!value) reader_.refuse(node, key, "must be true or false");
    return *value;
  }
  const toml::table& table(const char* name) const {
    const toml::node& node = reader_.need(root_, name, "the file");
    if (node.as_table() == nullptr) reader_.refuse(node, name, fmt::format("must be a table: [{}]", name));
    return *node.as_table();
  }

  std::string path_;
  input::TomlReader reader_;
  toml::table root_;
};

template <typename Enum, std::size_t N>
std::array<const char*, N> names_of() {
  std::array<const char*, N> names{};
  for (std::size_t i = 0; i < N; ++i) names[i] = governor::to_string(static_cast<Enum>(i));
  return names;
}

void ScenarioReader::read_head(Scenario& s) const {
  const toml::table& head = table("scenario");
  reader_.allow_keys(
      head, "[scenario]",
      {"about", "world", "environment", "vehicle", "seed", "design", "autopilot", "answers", "cost_factor"});
  s.about = text(reader_.need(head, "about", "[scenario]"), "about");
  const toml::node* world = head.get("world");
  const toml::node* environment = head.get("environment");
  if ((world == nullptr) == (environment == nullptr))
    reader_.refuse(head, "world", "must be there, or environment, and not both");
  if (world != nullptr)
    s.world = (std::filesystem::path(path_).parent_path() / text(*world, "world")).string();
  if (world != nullptr) s.files.push_back(s.world);
  if (environment != nullptr) s.environment = text(*environment, "environment");
  if (const toml::node* node = head.get("vehicle")) {
    const std::string name = text(*node, "vehicle");
    const std::string from =
        vehicle::ships(name) ? name : (std::filesystem::path(path_).parent_path() / name).string();
    const vehicle::Vehicle vehicle = vehicle::load_vehicle(from);
    set_vehicle(s.config, vehicle);
    s.vehicle = from;
    s.files.insert(s.files.end(), vehicle.patterns.begin(), vehicle.patterns.end());
    s.files.push_back(from);
  }
  if (const toml::node* node = head.get("seed")) {
    s.config.seed = static_cast<std::uint64_t>(reader_.whole(*node, "seed", 0, 20000));
  }
  if (const toml::node* node = head.get("design")) {
    constexpr std::array<const char*, 3> kDesigns{"aware", "static", "static-fair"};
    s.config.flight.design = static_cast<governor::Design>(choice(*node, "design", kDesigns));
  }
  if (const toml::node* node = head.get("autopilot")) {
    constexpr std::array<const char*, 2> kAutopilots{"px4", "arducopter"};
    s.config.autopilot =
        AutopilotChoice{static_cast<AutopilotKind>(choice(*node, "autopilot", kAutopilots)), false};
  }
  if (const toml::node* node = head.get("cost_factor")) {
    const double factor = number(*node, "cost_factor", 0.01, 100.0);
    s.config.flight.costs = core::slower(s.config.flight.costs, factor);
    for (governor::LatencyModel& model : s.config.flight.model) model = governor::slower(model, factor);
  }
  if (const toml::node* node = head.get("answers")) s.config.flight.answers = truth(*node, "answers");
}

double ScenarioReader::size_of(const toml::node& node, const sitl::ComponentSpec& spec,
                               sitl::FaultKind kind) const {
  const sitl::FaultSize* row = sitl::size_of(spec.component, kind);
  if (row == nullptr)
    reader_.refuse(node, "size",
                   fmt::format("must be left out: kind '{}' of {} has none",
                               sitl::kFaultKindNames.at(static_cast<std::size_t>(kind)), spec.name));
  if (kind == sitl::FaultKind::kSlow && spec.component != sitl::Component::kCpu)
    return static_cast<double>(
        reader_.whole(node, "size", static_cast<int>(row->least), static_cast<int>(row->most)));
  const double value = reader_.number(node, "size");
  if (!(value >= row->least && value <= row->most))
    reader_.refuse(node, "size",
                   fmt::format("must be a number from {} to {}: {}", row->least, row->most, row->unit));
  return value;
}

void ScenarioReader::read_faults(Scenario& s) const {
  const toml::node* list = root_.get("fault");
  if (list == nullptr) return;
  if (list->as_array() == nullptr) reader_.refuse(*list, "fault", "must be written as [[fault]]");
  std::array<const char*, sitl::kComponentCount> names{};
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = sitl::kComponents[i].name;
  for (const toml::node& node : *list->as_array()) {
    const toml::table* fault = node.as_table();
    if (fault == nullptr) reader_.refuse(node, "fault", "must be written as [[fault]]");
    reader_.allow_keys(*fault, "[[fault]]",
                       {"component", "kind", "size", "instance", "phase", "at_s", "for_s", "every_s"});
    TimedFault f;
    const sitl::ComponentSpec& spec =
        sitl::kComponents[choice(reader_.need(*fault, "component", "[[fault]]"), "component", names)];
    std::vector<const char*> kinds;
    for (std::size_t k = 1; k < sitl::kFaultKindNames.size(); ++k) {
      if ((spec.kinds & sitl::bit(static_cast<sitl::FaultKind>(k))) != 0)
        kinds.push_back(sitl::kFaultKindNames[k]);
    }
    const std::size_t kind = choice(reader_.need(*fault, "kind", "[[fault]]"), "kind", kinds);
    const auto of_all = std::find(sitl::kFaultKindNames.begin(), sitl::kFaultKindNames.end(), kinds[kind]);
    f.fault.component = spec.component;
    f.fault.kind = static_cast<sitl::FaultKind>(of_all - sitl::kFaultKindNames.begin());
    if (const toml::node* size = fault->get("size")) f.fault.size = size_of(*size, spec, f.fault.kind);
    if (const toml::node* instance = fault->get("instance"))
      f.fault.instance = static_cast<int>(reader_.whole(*instance, "instance", 0, spec.instances - 1));
    if (const toml::node* phase = fault->get("phase"))
      f.phase = static_cast<governor::Phase>(
          choice(*phase, "phase", names_of<governor::Phase, governor::kPhaseCount>()));
    f.at_s = maybe(*fault, "at_s", 7200).value_or(0.0);
    if (const toml::node* lasts = fault->get("for_s")) f.for_s = number(*lasts, "for_s", 0.001, 7200.0);
    if (const toml::node* every = fault->get("every_s")) {
      f.every_s = number(*every, "every_s", 0.001, 7200.0);
      if (!(f.every_s > f.for_s))
        reader_.refuse(*every, "every_s", "must be more than for_s, which says how long each burst lasts");
    }
    if (s.config.faults.size() == sitl::FaultLine::kMost)
      reader_.refuse(node, "fault", fmt::format("must be at most {}", sitl::FaultLine::kMost));
    s.config.faults.push_back(f);
  }
}

void ScenarioReader::read_goals(Scenario& s) const {
  const toml::node* list = root_.get("goal");
  if (list == nullptr) return;
  if (list->as_array() == nullptr) reader_.refuse(*list, "goal", "must be written as [[goal]]");
  for (const toml::node& node : *list->as_array()) {
    const toml::table* goal = node.as_table();
    if (goal == nullptr) reader_.refuse(node, "goal", "must be written as [[goal]]");
    reader_.allow_keys(*goal, "[[goal]]", {"at_s", "position_m"});
    const double at_s = maybe(*goal, "at_s", 7200).value_or(0.0);
    const Vector3 p_W = reader_.point(reader_.need(*goal, "position_m", "[[goal]]"), "position_m");
    std::vector<GivenGoals>& given = s.config.goals;
    if (!given.empty() && at_s < given.back().at_s)
      reader_.refuse(node, "at_s", "must not be before that of the [[goal]] above");
    // Those of one instant are flown to one after the other.
    if (given.empty() || at_s > given.back().at_s) given.push_back({at_s, {}});
    given.back().goals_W.push_back(p_W);
  }
}

void ScenarioReader::read_expectation(Scenario& s) const {
  const toml::table& t = table("expect");
  reader_.allow_keys(t, "[expect]",
                     {"outcome", "action", "condition", "within_s", "motors_stop_within_s", "touchdown_mps",
                      "home_within_m", "goal_within_m", "landing_site_known", "sensor"});
  s.expect.outcome = kOutcomes[choice(reader_.need(t, "outcome", "[expect]"), "outcome", kOutcomes)];
  if (const toml::node* node = t.get("action"))
    s.expect.action = governor::to_string(static_cast<governor::Action>(
        choice(*node, "action", names_of<governor::Action, governor::kActionCount>())));
  if (const toml::node* node = t.get("condition"))
    s.expect.condition = governor::to_string(static_cast<governor::Condition>(
        choice(*node, "condition", names_of<governor::Condition, governor::kConditionCount>())));
  if (const toml::node* node = t.get("sensor")) s.expect.sensor = text(*node, "sensor");
  s.expect.within_s = maybe(t, "within_s", 7200);
  s.expect.motors_stop_within_s = maybe(t, "motors_stop_within_s", 7200);
  for (const char* key : {"within_s", "motors_stop_within_s"}) {
    if (const toml::node* node = t.get(key); node != nullptr && s.config.faults.empty())
      reader_.refuse(*node, key, "goes with a [[fault]]: it counts from the first one");
  }
  s.expect.touchdown_mps = maybe(t, "touchdown_mps", 100);
  s.expect.home_within_m = maybe(t, "home_within_m", 20000);
  if (const toml::node* node = t.get("goal_within_m"))
    s.config.judge.goal_within_m = number(*node, "goal_within_m", JudgeConfig{}.goal_within_m, 1000);
  if (const toml::node* node = t.get("landing_site_known"))
    s.expect.landing_site_known = truth(*node, "landing_site_known");
}

Scenario ScenarioReader::read() {
  std::set<std::string_view> keys = kSettingsTables;
  keys.insert({"scenario", "fault", "goal", "body", "expect"});
  reader_.allow_keys(root_, "the file", keys);
  Scenario s;
  s.name = std::filesystem::path(path_).stem().string();
  const board::Profile profile = board::paper();
  s.config.flight.costs = profile.costs;
  s.config.flight.model = profile.model;
  s.config.judge.time_limit_s = 300.0;
  read_head(s);
  read_settings(reader_, root_, s.config);
  read_faults(s);
  read_goals(s);
  s.bodies = sitl::read_bodies(reader_, root_);
  read_expectation(s);
  return s;
}

}  // namespace

Scenario load_scenario(const std::string& path) {
  Scenario scenario = ScenarioReader(path).read();
  scenario.config.source = nlohmann::json{{"scenario", std::filesystem::absolute(path).string()}}.dump(
      -1, ' ', false, nlohmann::json::error_handler_t::replace);
  return scenario;
}

bool is_scenario(const std::string& path) {
  const toml::table root = input::parse_toml(path, input::read_text(path, "a readable TOML file"));
  return std::any_of(kOfScenarios.begin(), kOfScenarios.end(),
                     [&root](const char* key) { return root.contains(key); });
}

sitl::World world_of(const Scenario& s) {
  sitl::World world = s.world.empty() ? sitl::generate(sitl::environment(s.environment).knobs,
                                                       sitl::Mission::kPackageDelivery, s.config.seed)
                                      : sitl::load_world(s.world, {});
  world.add(s.bodies);
  return world;
}

report::MissionReport fly_scenario(const Scenario& s) {
  MissionConfig config = s.config;
  config.judged = [&s](const report::MissionReport& flown) {
    return log_verdict(s.name, checks_of(s, flown), flown);
  };
  report::MissionReport report = fly_mission(world_of(s), config, {});
  report.result.env = s.name;
  return report;
}

}  // namespace roborun::mission
