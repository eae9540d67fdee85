#include "platform/app/memory_command.hpp"

#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "platform/app/exit_code.hpp"
#include "platform/app/options.hpp"
#include "platform/board/board_profile.hpp"
#include "platform/mission/audit_run.hpp"
#include "platform/sitl/world/generator.hpp"

namespace roborun::app {
namespace {

struct MemoryOptions {
  std::string env{"14"};
  std::string vehicle{"paper"};
  double fly_s{0.0};
  bool json{false};
};

int memory(const MemoryOptions& options) {
  const sitl::World world =
      sitl::generate(sitl::environment(options.env).knobs, sitl::Mission::kPackageDelivery, 1);
  const board::Profile profile = board::paper();
  mission::MissionConfig config;
  mission::set_vehicle(config, vehicle::load_vehicle(options.vehicle));
  config.flight.costs = profile.costs;
  config.flight.model = profile.model;
  // Lockstep: what a mission uses does not depend on how fast it is simulated.
  std::vector<report::PoolUse> pools;
  if (options.fly_s > 0.0) {
    config.judge.time_limit_s = options.fly_s;
    pools = mission::fly_mission(world, config, {}).pools;
  } else {
    pools = mission::memory_plan_of(world, config);
  }
  std::size_t total = 0;
  for (const report::PoolUse& p : pools) total += p.element_bytes * p.count;
  if (options.json) {
    nlohmann::ordered_json j = {{"bytes", total}, {"pools", nlohmann::ordered_json::array()}};
    for (const report::PoolUse& p : pools)
      j["pools"].push_back(
          {{"name", p.name},
           {"element_bytes", p.element_bytes},
           {"count", p.count},
           {"bytes", p.element_bytes * p.count},
           {"high_water",
            options.fly_s > 0.0 && p.tells_use ? nlohmann::ordered_json(p.high_water) : nullptr}});
    fmt::print("{}\n", j.dump());
    return kDone;
  }
  fmt::print("{:<24} {:>10} {:>10} {:>12} {:>12} {:>6}\n", "pool", "bytes each", "count", "bytes",
             "high water", "used");
  for (const report::PoolUse& p : pools) {
    const bool known = options.fly_s > 0.0 && p.tells_use && p.count > 0;
    fmt::print("{:<24} {:>10} {:>10} {:>12} {:>12} {:>6}\n", p.name, p.element_bytes, p.count,
               p.element_bytes * p.count, known ? fmt::format("{}", p.high_water) : "-",
               known ? fmt::format("{:.0f}%",
                                   100.0 * static_cast<double>(p.high_water) / static_cast<double>(p.count))
                     : "-");
  }
  fmt::print("{:<24} {:>10} {:>10} {:>12}   {:.1f} MiB\n", "all", "", "", total,
             static_cast<double>(total) / 1048576.0);
  return kDone;
}

}  // namespace

void add_memory_command(CLI::App& app, std::function<int()>& run) {
  const auto options = std::make_shared<MemoryOptions>();
  CLI::App* command =
      app.add_subcommand("memory", "The memory plan: every pool's size, count, bytes and high-water mark");
  command->footer(
      "Examples:\n  roborun memory\n  roborun memory --fly 300    high-water marks of 300 s of flight in "
      "lockstep");
  command->add_option("--env", options->env, "Environment: 1 .. 27, or a name")->capture_default_str();
  command
      ->add_option("--vehicle", options->vehicle,
                   "Vehicle: a shipped one (roborun vehicle list), or a vehicle file")
      ->capture_default_str();
  add_number(*command, "--fly", options->fly_s, 0.0, 7200.0,
             "Fly for this many virtual seconds first, 0 .. 7200");
  command->add_flag("--json", options->json, "One JSON object on standard output, nothing else");
  command->callback([options, &run] { run = [options] { return memory(*options); }; });
}

}  // namespace roborun::app
