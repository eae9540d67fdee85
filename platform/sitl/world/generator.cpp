#include "platform/sitl/world/generator.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "core/geometry/math.hpp"
#include "core/random/counter_rng.hpp"
#include "platform/input/input_error.hpp"

namespace roborun::sitl {
namespace {

constexpr double kPillarTop_m = 20.0;
constexpr double kCruise_m = 5.0;
constexpr double kMargin_m = 20.0;
constexpr double kSigmaPerSpread = 0.4;

void require(bool ok, const char* key, double value, const char* range) {
  if (!ok)
    throw InputError(fmt::format("environment: {} = {} is out of range: must be {}", key, value, range));
}

void check(const EnvironmentKnobs& k) {
  require(k.density_ratio >= 0.0 && k.density_ratio <= 1.0, "density", k.density_ratio, "0 .. 1");
  require(k.spread_m > 0.0 && k.spread_m <= 1000.0, "spread", k.spread_m, "above 0, at most 1000 m");
  require(k.centroid_distance_m > 0.0 && k.centroid_distance_m <= 10000.0, "distance", k.centroid_distance_m,
          "above 0, at most 10000 m");
  require(k.grid_m >= 2.0 && k.grid_m <= 100.0, "grid", k.grid_m, "2 .. 100 m");
  require(k.gap_m > 0.0 && k.gap_m < k.grid_m, "gap", k.gap_m, "above 0 and below the grid size");
  for (const double ratio : k.extra_centroids_ratio)
    require(ratio >= 0.0 && ratio <= 1.0, "centroid", ratio, "0 .. 1");
}

double probability(const EnvironmentKnobs& k, double density_ratio, double distance_m) noexcept {
  if (distance_m > k.spread_m) return 0.0;
  if (k.distribution == Distribution::kUniform) return density_ratio;
  const double sigma_m = kSigmaPerSpread * k.spread_m;
  return density_ratio * core::exp(-distance_m * distance_m / (2.0 * sigma_m * sigma_m));
}

}  // namespace

Mission mission_of(const std::string& name) {
  if (name == "package_delivery") return Mission::kPackageDelivery;
  if (name == "search_and_rescue") return Mission::kSearchAndRescue;
  throw InputError(
      fmt::format("--mission: unknown mission '{}': must be package_delivery or search_and_rescue", name));
}

World generate(const EnvironmentKnobs& knobs, Mission mission, std::uint64_t seed) {
  check(knobs);
  struct Centroid {
    double x_m;
    double density_ratio;
  };
  const bool rescue = mission == Mission::kSearchAndRescue;
  std::vector<Centroid> centroids{{0.0, rescue ? 0.5 * knobs.density_ratio : knobs.density_ratio},
                                  {knobs.centroid_distance_m, knobs.density_ratio}};
  for (const double ratio : knobs.extra_centroids_ratio) {
    centroids.push_back({ratio * knobs.centroid_distance_m, knobs.density_ratio});
  }

  WorldDescription world;
  const double reach_m = knobs.spread_m + kMargin_m;
  world.bounds_W = {Vector3(-reach_m, -reach_m, 1.5),
                    Vector3(knobs.centroid_distance_m + reach_m, reach_m, 10.0)};
  world.start_W = Vector3(0.0, 0.0, kCruise_m);
  world.goal_W = Vector3(knobs.centroid_distance_m, 0.0, kCruise_m);

  core::CounterRng rng(seed, 1);
  const double radius_m = 0.5 * (knobs.grid_m - knobs.gap_m);
  const auto columns =
      static_cast<std::int64_t>(std::ceil((knobs.centroid_distance_m + reach_m) / knobs.grid_m));
  const auto rows = static_cast<std::int64_t>(std::ceil(reach_m / knobs.grid_m));
  for (std::int64_t row = -rows; row <= rows; ++row) {
    for (std::int64_t column = -rows; column <= columns; ++column) {
      const double x_m = static_cast<double>(column) * knobs.grid_m;
      const double y_m = static_cast<double>(row) * knobs.grid_m;
      double chance = 0.0;
      for (const Centroid& c : centroids) {
        chance = std::fmax(chance, probability(knobs, c.density_ratio, core::hypot2(x_m - c.x_m, y_m)));
      }
      // Always the same number of draws a cell, so that one knob changes nothing elsewhere.
      const double pillar_draw = rng.uniform();
      const double rubble_draw = rng.uniform();
      const double size_draw = rng.uniform();
      const double height_draw = rng.uniform();
      // A landing position needs its own cell free; goals that fall between cells need the neighbours that
      // touch it.
      const auto too_near = [&](const Vector3& p) {
        return std::fabs(p.x() - x_m) < 0.75 * knobs.grid_m && std::fabs(p.y() - y_m) < 0.75 * knobs.grid_m;
      };
      if (too_near(world.start_W) || too_near(world.goal_W)) continue;
      if (pillar_draw < chance) {
        world.pillars.push_back({x_m, y_m, radius_m, 0.0, kPillarTop_m});
      } else if (rescue && column > columns / 2 && rubble_draw < chance) {
        const double half_m = radius_m * (0.4 + 0.6 * size_draw);
        world.boxes.push_back({Vector3(x_m - half_m, y_m - half_m, 0.0),
                               Vector3(x_m + half_m, y_m + half_m, 1.0 + 6.0 * height_draw)});
      }
    }
  }
  return World(std::move(world));
}

NamedEnvironment environment(std::string_view name_or_number) {
  constexpr std::array<double, 3> kDensity{0.3, 0.45, 0.6};
  constexpr std::array<double, 3> kSpread_m{40.0, 80.0, 120.0};
  constexpr std::array<double, 3> kDistance_m{600.0, 900.0, 1200.0};
  int number = 0;
  for (const double density : kDensity) {
    for (const double spread_m : kSpread_m) {
      for (const double distance_m : kDistance_m) {
        ++number;
        const std::string name = fmt::format("density{}-spread{}-distance{}", density, spread_m, distance_m);
        if (name_or_number != name && name_or_number != fmt::format("{}", number)) continue;
        EnvironmentKnobs knobs;
        knobs.density_ratio = density;
        knobs.spread_m = spread_m;
        knobs.centroid_distance_m = distance_m;
        return {number, name, knobs};
      }
    }
  }
  throw InputError(fmt::format(
      "unknown environment '{}': must be a number 1 .. 27 or a name like density0.45-spread80-distance900 "
      "(density 0.3, 0.45, 0.6; spread 40, 80, 120; distance 600, 900, 1200)",
      name_or_number));
}

}  // namespace roborun::sitl
