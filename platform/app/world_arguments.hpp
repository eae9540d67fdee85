/// The options of every command that takes a world from a file.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "platform/sitl/world/world_file.hpp"

namespace roborun::app {

struct WorldArguments {
  std::string start;
  std::vector<std::string> goals;
  std::string bounds;
  std::string ground;
  std::string cell;
  double scale{0.0};  ///< 0: not given.
  bool surfaces{false};
};

/// X,Y,Z and X,Y,Z,X,Y,Z; none for an empty text. Throw InputError that names the option.
[[nodiscard]] std::optional<Vector3> point_of(const char* option, const std::string& text);
[[nodiscard]] std::optional<Aabb> box_of(const char* option, const std::string& text);
/// Every --goal, in order. Throws InputError for one that is no point.
[[nodiscard]] std::vector<Vector3> goals_of(const WorldArguments& arguments);
/// Adds --start, --goal, --bounds, --ground, --cell, --scale and --surfaces. `arguments` must outlive the command.
void add_world_arguments(CLI::App& command, WorldArguments& arguments);
/// For a vehicle of this radius, with the first goal. Throws InputError that names the option.
[[nodiscard]] sitl::WorldOptions world_options(const WorldArguments& arguments, double radius_m);
/// Whether any of them was given.
[[nodiscard]] bool any_given(const WorldArguments& arguments);

}  // namespace roborun::app
