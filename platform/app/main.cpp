#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>

#include "platform/app/mission.hpp"
#include "platform/sitl/world/generator.hpp"

int main(int argc, char** argv) {
  using namespace roborun;
  const char* design = argc > 1 ? argv[1] : "aware";
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  const char* env = argc > 3 ? argv[3] : "14";
  const auto named = sitl::environment(env);
  const sitl::World world = sitl::generate(named.knobs, sitl::Mission::kPackageDelivery, seed);
  app::MissionConfig config;
  config.costs = core::paper_profile();
  config.model = {governor::from_cost(config.costs.of(core::StageId::kMap)), governor::from_cost(config.costs.of(core::StageId::kExport)),
                  governor::from_cost(config.costs.of(core::StageId::kPlanner))};
  config.seed = seed;
  config.design = design[0] == 'a' ? governor::Design::kAware : (std::string(design) == "static" ? governor::Design::kStatic : governor::Design::kStaticFair);
  if (argc > 4) config.time_limit_s = std::atof(argv[4]);
  const auto report = app::fly_mission(world, config, {});
  fmt::print("pillars {}\n", world.pillars().size());
  for (const auto& d : report.decisions) {
    fmt::print(stderr, "t {:7.2f} p {:7.1f} {:6.1f} {:4.1f} v {:4.2f} lim {:4.2f} p0 {:3.1f} p1 {:3.1f} v0 {:6.0f}/{:6.0f} v1 {:6.0f} v2 {:6.0f} bud {:5.2f} {:10s} dl {:5.2f} lat {:5.2f} vis {:5.1f} obs {:5.1f} gap {:5.1f} {} {}\n",
               d.time_s, d.p_WB.x(), d.p_WB.y(), d.p_WB.z(), d.speed_mps, d.speed_limit_mps, d.p0_m, d.p1_m, d.v0_m3, d.sensor_volume_m3, d.v1_m3, d.v2_m3, d.time_budget_s, d.budget_source,
               d.deadline_s, d.latency_s, d.visible_m, d.closest_obstacle_m, d.gap_average_m, d.planner_status, d.smoother_status);
  }
  fmt::print("{}\n", report::to_json(report.result));
}
