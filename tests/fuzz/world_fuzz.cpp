/// World files of every kind, as the program loads them: the first byte chooses the end of the name. Oracle: what is loaded has
/// finite bounds with start and goal inside, and every question about it has a finite answer.
#include <array>
#include <cmath>

#include "platform/sitl/world/world_file.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace roborun;
  constexpr std::array<const char*, 7> kNames{"w.toml", "w.world", "w.sdf", "w.bt",
                                              "w.pcd",  "w.ply",   "w.obj"};
  fuzz::Choices choices(data, size);
  const std::string path = fuzz::file(kNames.at(choices.byte() % kNames.size()), choices.rest());
  fuzz::refuse_or([&] {
    sitl::WorldOptions options;
    options.surfaces = true;  // meshes of a few bytes are not closed
    const sitl::World world = sitl::load_world(path, options);
    const Aabb& bounds = world.bounds_W();
    fuzz::require(bounds.min_W.allFinite() && bounds.max_W.allFinite(), "bounds are finite");
    for (const Vector3& end : {world.start_W(), world.goal_W()}) {
      fuzz::require(bounds.contains(end), "start and goal are within bounds");
      fuzz::require(world.clearance_m(end, 5.0) >= options.radius_m, "start and goal are free");
      const double distance_m = world.hit_distance_m(end, {0.6, 0.0, 0.8}, 50.0);
      fuzz::require(distance_m >= 0.0, "a ray ends in front");
      fuzz::require(world.congestion_ratio(end.x(), end.y()) <= 1.0, "a share is at most 1");
    }
    fuzz::require(std::isfinite(world.ground_below_m(world.start_W())), "there is ground below the start");
  });
  return 0;
}
