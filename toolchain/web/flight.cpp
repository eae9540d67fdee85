// A simulated flight for a page: world, vehicle, design and seed as `roborun fly` takes them, told in the messages of its log.
#include <emscripten.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <exception>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "platform/board/board_profile.hpp"
#include "platform/input/arguments.hpp"
#include "platform/input/input_error.hpp"
#include "platform/log/log_viewer.hpp"
#include "platform/mission/mission.hpp"
#include "platform/report/build_identity.hpp"
#include "platform/sitl/world/generator.hpp"
#include "platform/sitl/world/world_maker.hpp"
#include "platform/vehicle/vehicle_file.hpp"

// To worker.js: a topic of platform/log/README.md, or "refused" with one line.
EM_JS(void, tell, (const char* topic, double time_s, const char* text, int bytes),
      { Module.tell(UTF8ToString(topic), time_s, UTF8ToString(text, bytes)); });

namespace roborun::web {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kMission = "package_delivery";
constexpr const char* kProfile = "paper";

void tell_text(const std::string& topic, double time_s, std::string_view text) {
  tell(topic.c_str(), time_s, text.data(), static_cast<int>(text.size()));
}

/// What the page draws, states ten times per second.
class PageViewer final : public log::LogViewer {
 public:
  void add(const log::Channel& channel, const log::Schema&) override { topic_[channel.id] = channel.topic; }
  void show(std::uint16_t channel, std::int64_t time_ns, std::string_view json) noexcept override {
    constexpr std::int64_t kStateEvery_ns = 100'000'000;
    const std::string& topic = topic_[channel];
    if (topic == "/pose" || topic == "/tf" || topic == "/path") return;  // for Foxglove
    if (topic == "/state") {
      if (time_ns < next_state_ns_) return;
      next_state_ns_ = time_ns + kStateEvery_ns;
    }
    tell_text(topic, 1e-9 * static_cast<double>(time_ns), json);
  }

 private:
  std::map<std::uint16_t, std::string> topic_;
  std::int64_t next_state_ns_{0};
};

/// A number of an environment, or a kind of `roborun world make`.
sitl::World world_of(const std::string& name, std::uint64_t seed, double radius_m) {
  const bool made =
      std::find(sitl::kWorldKindName.begin(), sitl::kWorldKindName.end(), name) != sitl::kWorldKindName.end();
  if (!made) return sitl::generate(sitl::environment(name).knobs, sitl::mission_of(kMission), seed);
  return sitl::World(sitl::make_world(sitl::world_kind_of(name), seed, {.radius_m = radius_m}));
}

void fly(const std::string& world_name, const std::string& vehicle_name, const std::string& design,
         const std::string& seed) {
  if (!vehicle::ships(vehicle_name))
    throw InputError(fmt::format("vehicle: unknown '{}': must be {}", vehicle_name,
                                 fmt::join(vehicle::shipped_vehicles(), ", ")));
  mission::MissionConfig config;
  const vehicle::Vehicle vehicle = vehicle::load_vehicle(vehicle_name);
  mission::set_vehicle(config, vehicle);
  config.seed = input::seed_of("seed", seed);
  config.flight.design = mission::design_of("design", design);
  const sitl::World world = world_of(world_name, config.seed, vehicle.model.radius_m);
  const board::Profile profile = board::load_profile(kProfile, config.backends);
  config.profile_name = kProfile;
  config.flight.costs = profile.costs;
  config.flight.model = profile.model;
  PageViewer viewer;
  config.viewer = &viewer;
  (void)mission::fly_mission(world, config, {});
}

Json choices() {
  Json worlds = Json::array();
  for (int i = 1; i <= 27; ++i) {
    const std::string number = std::to_string(i);
    worlds.push_back({number, fmt::format("{}: {}", number, sitl::environment(number).name)});
  }
  for (const std::string_view kind : sitl::kWorldKindName) worlds.push_back({kind, kind});
  Json designs = Json::array();
  for (const governor::Design design :
       {governor::Design::kAware, governor::Design::kStaticFair, governor::Design::kStatic})
    designs.push_back(governor::to_string(design));
  const report::BuildIdentity build = report::build_identity();
  return {{"worlds", worlds},
          {"vehicles", vehicle::shipped_vehicles()},
          {"designs", designs},
          {"build", fmt::format("commit {}, {}", build.commit, build.compiler)}};
}

}  // namespace
}  // namespace roborun::web

extern "C" {

/// JSON: worlds [[name, text]], vehicles, designs, build. Valid until the next call.
EMSCRIPTEN_KEEPALIVE const char* choices() {
  static std::string text;
  text = roborun::web::choices().dump();
  return text.c_str();
}

/// Returns when the flight has ended.
EMSCRIPTEN_KEEPALIVE void fly(const char* world, const char* vehicle, const char* design, const char* seed) {
  try {
    roborun::web::fly(world, vehicle, design, seed);
  } catch (const std::exception& error) {
    roborun::web::tell_text("refused", 0.0, error.what());
  }
}
}
