#include "platform/app/world_arguments.hpp"

#include <fmt/format.h>

#include <array>
#include <optional>
#include <vector>

#include "platform/app/options.hpp"
#include "platform/input/arguments.hpp"
#include "platform/input/input_error.hpp"

namespace roborun::app {
namespace {

/// Numbers with commas between; none for an empty text.
template <std::size_t count>
std::optional<std::array<double, count>> numbers(const char* option, const std::string& text,
                                                 const char* wanted) {
  if (text.empty()) return std::nullopt;
  const std::vector<std::string> parts = input::split(text);
  std::array<double, count> values{};
  bool ok = parts.size() == count;
  for (std::size_t i = 0; ok && i < count; ++i) {
    const auto value = input::number(parts[i]);
    ok = value.has_value();
    if (ok) values[i] = *value;
  }
  if (!ok) throw InputError(fmt::format("{}: '{}' is not {}", option, text, wanted));
  return values;
}

}  // namespace

std::optional<Vector3> point_of(const char* option, const std::string& text) {
  const auto p = numbers<3>(option, text, "a point: must be X,Y,Z in metres");
  if (!p) return std::nullopt;
  return Vector3((*p)[0], (*p)[1], (*p)[2]);
}

std::optional<Aabb> box_of(const char* option, const std::string& text) {
  const auto b = numbers<6>(option, text, "a box: must be X,Y,Z,X,Y,Z in metres");
  if (!b) return std::nullopt;
  const Aabb box{{(*b)[0], (*b)[1], (*b)[2]}, {(*b)[3], (*b)[4], (*b)[5]}};
  if (!(box.size().minCoeff() > 0.0))
    throw InputError(
        fmt::format("{}: '{}': the second corner must be above the first on every axis", option, text));
  return box;
}

void add_world_arguments(CLI::App& command, WorldArguments& arguments) {
  command.add_option("--start", arguments.start, "With a world from a file: X,Y,Z in metres");
  command.add_option("--goal", arguments.goals, "With a world from a file: X,Y,Z in metres")
      ->allow_extra_args(false);
  command.add_option(
      "--bounds", arguments.bounds,
      "Where the vehicle may be: X,Y,Z,X,Y,Z of two corners, in metres [what the file says, or all of it]");
  command.add_option("--ground", arguments.ground,
                     "Height of a plane that is the ground, for worlds without one");
  command.add_option("--cell", arguments.cell,
                     fmt::format("Of point clouds: each cell of this size with a point is solid, metres [{}]",
                                 sitl::kCloudCell_m));
  add_number(command, "--scale", arguments.scale, 1e-6, 1e6, "Metres in a unit of the file, 1e-6 .. 1e6");
  command.add_flag("--surfaces", arguments.surfaces,
                   "Take meshes that are not closed, as surfaces without an inside");
}

std::vector<Vector3> goals_of(const WorldArguments& arguments) {
  std::vector<Vector3> goals_W;
  for (const std::string& goal : arguments.goals) {
    const auto p_W = point_of("--goal", goal);
    if (!p_W) throw InputError("--goal: '' is not a point: must be X,Y,Z in metres");
    goals_W.push_back(*p_W);
  }
  return goals_W;
}

sitl::WorldOptions world_options(const WorldArguments& arguments, double radius_m) {
  sitl::WorldOptions options;
  options.start_W = point_of("--start", arguments.start);
  if (const std::vector<Vector3> goals_W = goals_of(arguments); !goals_W.empty())
    options.goal_W = goals_W.front();
  options.bounds_W = box_of("--bounds", arguments.bounds);
  if (const auto z = numbers<1>("--ground", arguments.ground, "a height in metres"))
    options.ground_m = (*z)[0];
  if (const auto cell = numbers<1>("--cell", arguments.cell, "a size in metres")) options.cell_m = (*cell)[0];
  if (arguments.scale > 0.0) options.scale = arguments.scale;
  options.surfaces = arguments.surfaces;
  options.radius_m = radius_m;
  return options;
}

bool any_given(const WorldArguments& a) {
  return !(a.start + a.bounds + a.ground + a.cell).empty() || !a.goals.empty() || a.scale > 0.0 || a.surfaces;
}

}  // namespace roborun::app
