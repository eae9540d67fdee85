#include "platform/app/map_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "platform/app/exit_code.hpp"
#include "platform/app/map_build_command.hpp"
#include "platform/input/arguments.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/output_file.hpp"
#include "platform/input/text_file.hpp"
#include "platform/report/map_picture.hpp"
#include "platform/sitl/world/octomap_file.hpp"

namespace roborun::app {
namespace {

using report::CellColour;
using report::MapPanel;
using sitl::OctomapLeaf;
using sitl::OctomapLeaves;

constexpr int kMostPictureCells = 600;  // on the longer side of a panel

struct MapOptions {
  std::string file, second, output;
  std::optional<double> height_m;
  bool json{false};
};

std::uint64_t cells(const OctomapLeaf& leaf) { return leaf.end() - leaf.morton; }

int info(const MapOptions& options) {
  const OctomapLeaves map = sitl::load_octomap(options.file);
  std::uint64_t free = 0;
  std::uint64_t occupied = 0;
  for (const OctomapLeaf& leaf : map.leaves) (leaf.occupied ? occupied : free) += cells(leaf);
  const double cell_m3 = map.resolution_m * map.resolution_m * map.resolution_m;
  const Aabb box = map.bounds_W();
  if (options.json) {
    const nlohmann::ordered_json json = {{"file", options.file},
                                         {"resolution_m", map.resolution_m},
                                         {"leaves", map.leaves.size()},
                                         {"free_m3", cell_m3 * static_cast<double>(free)},
                                         {"occupied_m3", cell_m3 * static_cast<double>(occupied)},
                                         {"min_W", {box.min_W.x(), box.min_W.y(), box.min_W.z()}},
                                         {"max_W", {box.max_W.x(), box.max_W.y(), box.max_W.z()}}};
    fmt::print("{}\n", json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
    return kDone;
  }
  fmt::print(
      "{}\nresolution {} m, {} leaves\nfree {:.1f} m3, occupied {:.1f} m3\nfrom ({:.2f}, {:.2f}, {:.2f}) to "
      "({:.2f}, {:.2f}, {:.2f}) m\n",
      options.file, map.resolution_m, map.leaves.size(), cell_m3 * static_cast<double>(free),
      cell_m3 * static_cast<double>(occupied), box.min_W.x(), box.min_W.y(), box.min_W.z(), box.max_W.x(),
      box.max_W.y(), box.max_W.z());
  return kDone;
}

int convert(const MapOptions& options) {
  const bool full = sitl::is_full_octomap(options.output);
  input::check_outputs({{"OUTPUT", options.output}}, {options.file});
  OctomapLeaves map = sitl::load_octomap(options.file);
  map.prune();
  input::write_file(options.output, sitl::write_octomap(map, full));
  fmt::print("{}: {} leaves\n", options.output, map.leaves.size());
  return kDone;
}

int compare(const MapOptions& options) {
  const OctomapLeaves first = sitl::load_octomap(options.file);
  const OctomapLeaves second = sitl::load_octomap(options.second);
  if (first.resolution_m < second.resolution_m || first.resolution_m > second.resolution_m)
    throw InputError(fmt::format("{}: resolution {} m, but {} has {} m: must be equal", options.second,
                                 second.resolution_m, options.file, first.resolution_m));
  const sitl::OctomapDifference d = sitl::diff(first, second);
  if (options.json) {
    const nlohmann::ordered_json json = {{"same_cells", d.same},
                                         {"only_first_cells", d.only_first},
                                         {"only_second_cells", d.only_second},
                                         {"free_to_occupied_cells", d.free_to_occupied},
                                         {"occupied_to_free_cells", d.occupied_to_free}};
    fmt::print("{}\n", json.dump());
  } else {
    fmt::print(
        "cells: {} same, {} only in the first, {} only in the second, {} free -> occupied, {} occupied -> "
        "free\n",
        d.same, d.only_first, d.only_second, d.free_to_occupied, d.occupied_to_free);
  }
  return d.equal() ? kDone : kNotGood;
}

/// A panel over two axes: the leaves for which `shown` is true, occupied over free.
template <typename Filter>
MapPanel panel(const OctomapLeaves& map, std::size_t right, std::size_t up, const std::string& title,
               Filter&& shown) {
  constexpr std::array<const char*, 3> kAxes{"x [m]", "y [m]", "z [m]"};
  constexpr int kOrigin = 1 << (sitl::kOctomapDepth - 1);
  std::array<int, 3> low{1 << 30, 1 << 30, 1 << 30}, high{0, 0, 0};
  for (const OctomapLeaf& leaf : map.leaves) {
    const auto cell = sitl::octomap_cell(leaf.morton);
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], cell[i]);
      high[i] = std::max(high[i], cell[i] + leaf.size);
    }
  }
  int shift = 0;
  while ((std::max(high[right] - low[right], high[up] - low[up]) >> shift) >= kMostPictureCells) ++shift;
  MapPanel result;
  result.title = title;
  result.right_axis = kAxes[right];
  result.up_axis = kAxes[up];
  result.cell_m = map.resolution_m * (1 << shift);
  result.right_m = map.resolution_m * (low[right] - kOrigin);
  result.up_m = map.resolution_m * (low[up] - kOrigin);
  result.columns = ((high[right] - low[right] - 1) >> shift) + 1;
  result.rows = ((high[up] - low[up] - 1) >> shift) + 1;
  result.cell.assign(static_cast<std::size_t>(result.columns) * static_cast<std::size_t>(result.rows),
                     CellColour::kUnknown);
  for (const OctomapLeaf& leaf : map.leaves) {
    const auto cell = sitl::octomap_cell(leaf.morton);
    if (!shown(cell, leaf.size)) continue;
    const CellColour colour = leaf.occupied ? CellColour::kOccupied : CellColour::kFree;
    const int first_column = (cell[right] - low[right]) >> shift,
              last_column = (cell[right] - low[right] + leaf.size - 1) >> shift;
    const int first_row = (cell[up] - low[up]) >> shift,
              last_row = (cell[up] - low[up] + leaf.size - 1) >> shift;
    for (int row = first_row; row <= last_row; ++row) {
      for (int column = first_column; column <= last_column; ++column) {
        CellColour& c = result.cell[static_cast<std::size_t>(row) * static_cast<std::size_t>(result.columns) +
                                    static_cast<std::size_t>(column)];
        c = std::max(c, colour);
      }
    }
  }
  return result;
}

int view(const MapOptions& options) {
  const std::string output = options.output.empty() ? options.file + ".svg" : options.output;
  input::check_outputs({{"--output", output}}, {options.file});
  const OctomapLeaves map = sitl::load_octomap(options.file);
  const Aabb box = map.bounds_W();
  const double height_m = options.height_m.value_or(box.center().z());
  if (!(height_m >= box.min_W.z() && height_m < box.max_W.z()))
    throw InputError(fmt::format("--height {}: must be from {:.2f} to below {:.2f} m, where the map is",
                                 height_m, box.min_W.z(), box.max_W.z()));
  const auto index = [&map](double p_m) {
    return static_cast<int>(p_m / map.resolution_m + (1 << (sitl::kOctomapDepth - 1)));
  };
  const auto cut = [](std::size_t axis, int at) {
    return [axis, at](const std::array<std::int32_t, 3>& cell, int size) {
      return cell[axis] <= at && at < cell[axis] + size;
    };
  };
  const auto all = [](const std::array<std::int32_t, 3>&, int) { return true; };
  const std::array<MapPanel, 3> panels{
      panel(map, 0, 1, "from above: occupied anywhere over free anywhere", all),
      panel(map, 0, 1, fmt::format("cut at z = {:.2f} m", height_m), cut(2, index(height_m))),
      panel(map, 0, 2, fmt::format("cut at y = {:.2f} m", box.center().y()),
            cut(1, index(box.center().y())))};
  input::write_file(output, report::map_svg(fmt::format("{}, {} m", options.file, map.resolution_m), panels));
  fmt::print("{}\n", output);
  return kDone;
}

}  // namespace

void add_map_command(CLI::App& app, std::function<int()>& run) {
  auto options = std::make_shared<MapOptions>();
  CLI::App* map = app.add_subcommand(
      "map", "look into OctoMap files (.bt, .ot), convert, compare and draw them; make them from recordings");
  map->require_subcommand(1);
  const auto add = [&](const char* name, const char* what, int (*command)(const MapOptions&)) {
    CLI::App* sub = map->add_subcommand(name, what);
    sub->add_option("FILE", options->file, "a .bt or .ot file")->required();
    sub->callback([options, command, &run] { run = [options, command] { return command(*options); }; });
    return sub;
  };
  add("info", "resolution, leaves, volumes, bounds", &info)
      ->add_flag("--json", options->json, "one line of JSON");
  add("convert", "write it pruned, as .bt or .ot", &convert)
      ->add_option("OUTPUT", options->output, "a .bt or .ot file")
      ->required();
  CLI::App* diff = add("diff", "count the cells that differ; exit code 1 if any does", &compare);
  diff->add_option("SECOND", options->second, "a .bt or .ot file of the same resolution")->required();
  diff->add_flag("--json", options->json, "one line of JSON");
  CLI::App* picture = add("view", "draw it: from above, and cut at two planes (SVG)", &view);
  picture->add_option("-o,--output", options->output, "default: FILE.svg");
  picture->add_option_function<std::string>(
      "--height",
      [options](const std::string& text) {
        options->height_m = input::number_of("--height", text, -20e3, 20e3);
      },
      "of the level cut, metres; default: the middle");
  add_map_build_command(*map, run);
}

}  // namespace roborun::app
