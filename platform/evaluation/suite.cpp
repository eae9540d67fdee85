#include "platform/evaluation/suite.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include "platform/input/arguments.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/text_file.hpp"
#include "platform/mission/mission_config.hpp"
#include "platform/sitl/judge/way_judge.hpp"
#include "platform/sitl/world/world_file.hpp"
#include "platform/sitl/world/world_maker.hpp"

namespace roborun::evaluation {
namespace {

using sitl::WorldKind;

struct HardWorld {
  const char* name;
  WorldKind kind;
  std::optional<double> spacing_m{};
  bool closed{false};
};
/// Sizes that are not given here follow the seed or the vehicle's radius (world_maker.hpp).
constexpr std::array<HardWorld, 15> kHard{{
    {"maze", WorldKind::kMaze},
    {"trap", WorldKind::kTrap},
    {"walls", WorldKind::kWalls},
    {"forest-2.5", WorldKind::kForest, 2.5},
    {"forest-3.5", WorldKind::kForest, 3.5},
    {"forest-5", WorldKind::kForest, 5.0},
    {"gaps", WorldKind::kGaps},
    {"windows", WorldKind::kWindows},
    {"office", WorldKind::kOffice},
    {"cave", WorldKind::kCave},
    {"poles", WorldKind::kPoles},
    {"wires", WorldKind::kWires},
    {"closed-maze", WorldKind::kMaze, {}, true},
    {"closed-forest", WorldKind::kForest, 5.0, true},
    {"closed-office", WorldKind::kOffice, {}, true},
}};
constexpr std::array<const char*, 2> kHardVehicles{"paper", "micro-six"};

struct Ends {
  std::array<double, 3> start_W, goal_W;
};
struct ForeignWorld {
  const char* name;
  const char* file;
  const char* vehicle;
  std::array<double, 6> bounds_W;  ///< Lowest corner, highest corner.
  std::span<const Ends> ends;      ///< Empty: of kEthEnds.
  int map{-1};                     ///< There.
};
constexpr double kPoint_m = 1e-3;  // of start and goal in a file: the judge asks for the vehicle's room
constexpr const char* kEthEnds = "eth_start_and_end.csv";

/// MIGHTY: start and goal of its published hard forest; the others end 5 m behind the last tree as that one does. Its z_max
/// is 5 m. The trees fill y = -20 .. 20, and the bounds keep the vehicle among them.
constexpr std::array<Ends, 1> kMightyLong{{{{0, 0, 3}, {305, 0, 3}}}};
constexpr std::array<Ends, 1> kMightyShort{{{{0, 0, 3}, {105, 0, 3}}}};
constexpr std::array<double, 6> kMightyLongBounds{-2, -20, 1, 307, 20, 5};
constexpr std::array<double, 6> kMightyShortBounds{-2, -20, 1, 107, 20, 5};
/// FASTER flies at most 2 m high, below every tree's top. No pairs are published: five across the whole forest, ours.
constexpr std::array<Ends, 5> kFasterEnds{{{{0, 8, 1}, {50, 8, 1}},
                                           {{0, 16, 1}, {50, 40, 1}},
                                           {{0, 25, 1}, {50, 25, 1}},
                                           {{0, 33, 1}, {50, 10, 1}},
                                           {{0, 42, 1}, {50, 42, 1}}}};
constexpr std::array<double, 6> kFasterBounds{-2, 2, 0.5, 52, 48, 2};
/// ETH: maps of 10 x 10 x 5 m, with a hundred published pairs each, all 1 m high.
constexpr std::array<double, 6> kEthBounds{-5, -5, 0.6, 5, 5, 4.5};

constexpr std::array<ForeignWorld, 13> kForeign{{
    {"mighty-easy", "mighty_easy_forest.world", "mighty-six", kMightyShortBounds, kMightyShort},
    {"mighty-medium", "mighty_medium_forest.world", "mighty-six", kMightyShortBounds, kMightyShort},
    {"mighty-hard", "mighty_hard_forest.world", "mighty-six", kMightyLongBounds, kMightyLong},
    {"faster-0", "faster_forest_seed0.world", "faster-six", kFasterBounds, kFasterEnds},
    {"faster-1", "faster_forest_seed1.world", "faster-six", kFasterBounds, kFasterEnds},
    {"faster-2", "faster_forest_seed2.world", "faster-six", kFasterBounds, kFasterEnds},
    {"faster-3", "faster_forest_seed3.world", "faster-six", kFasterBounds, kFasterEnds},
    {"faster-4", "faster_forest_seed4.world", "faster-six", kFasterBounds, kFasterEnds},
    {"eth-0", "eth_forest0.bt", "eth-six", kEthBounds, {}, 0},
    {"eth-1", "eth_forest1.bt", "eth-six", kEthBounds, {}, 1},
    {"eth-2", "eth_forest2.bt", "eth-six", kEthBounds, {}, 2},
    {"eth-3", "eth_forest3.bt", "eth-six", kEthBounds, {}, 3},
    {"eth-4", "eth_forest4.bt", "eth-six", kEthBounds, {}, 4},
}};

const HardWorld* hard_world(const std::string& name) {
  const auto* found =
      std::find_if(kHard.begin(), kHard.end(), [&](const HardWorld& w) { return name == w.name; });
  return found == kHard.end() ? nullptr : found;
}

const ForeignWorld* foreign_world(const std::string& name) {
  const auto* found =
      std::find_if(kForeign.begin(), kForeign.end(), [&](const ForeignWorld& w) { return name == w.name; });
  return found == kForeign.end() ? nullptr : found;
}

std::vector<std::string> names_of(const std::string& suite) {
  std::vector<std::string> names;
  if (suite == "hard") {
    for (const HardWorld& w : kHard) names.emplace_back(w.name);
  } else {
    for (const ForeignWorld& w : kForeign) names.emplace_back(w.name);
  }
  return names;
}

/// Of a file "trial,map_id,start_x,start_y,start_z,end_x,end_y,end_z" with a line of names.
std::vector<Ends> eth_ends(const std::string& path, int map) {
  constexpr std::size_t kColumns = 8;
  const std::string text = input::read_text(path, "the start/goal pairs of ethz-asl/forest_gen");
  std::vector<Ends> all;
  std::size_t at = 0;
  for (int line = 1; at < text.size(); ++line) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    std::string row = text.substr(at, end - at);
    at = end + 1;
    if (!row.empty() && row.back() == '\r') row.pop_back();
    if (line == 1 || row.empty()) continue;
    const std::vector<std::string> parts = input::split(row);
    std::array<double, kColumns> value{};
    bool whole = parts.size() == kColumns;
    for (std::size_t i = 0; whole && i < kColumns; ++i) {
      const auto number = input::number(parts[i]);
      whole = number.has_value();
      value[i] = number.value_or(0.0);
    }
    if (!whole) throw InputError(fmt::format("{}:{}: must be {} numbers with commas", path, line, kColumns));
    if (value[1] == map) all.push_back({{value[2], value[3], value[4]}, {value[5], value[6], value[7]}});
  }
  if (all.empty()) throw InputError(fmt::format("{}: has no pair of map {}: must have some", path, map));
  return all;
}

Vector3 point(std::span<const double> p) { return {p[0], p[1], p[2]}; }

SuiteProblem hard_problem(const HardWorld& made, const std::string& vehicle, std::uint64_t seed,
                          double radius_m) {
  sitl::WorldMakerOptions options;
  options.radius_m = radius_m;
  options.spacing_m = made.spacing_m;
  options.closed = made.closed;
  std::string make = fmt::format("roborun world make {} --seed {} --vehicle {}",
                                 sitl::kWorldKindName[static_cast<std::size_t>(made.kind)], seed, vehicle);
  if (made.spacing_m) make += fmt::format(" --spacing {}", *made.spacing_m);
  if (made.closed) make += " --closed";
  const std::string file =
      fmt::format("{}_{}_{}.toml", made.name, std::filesystem::path(vehicle).stem().string(), seed);
  return {[=, kind = made.kind] { return sitl::World(sitl::make_world(kind, seed, options)); },
          make + " --out " + file, "--world " + file};
}

SuiteProblem foreign_problem(const ForeignWorld& file, const std::string& folder, std::uint64_t seed) {
  std::vector<Ends> all(file.ends.begin(), file.ends.end());
  if (all.empty()) all = eth_ends(folder + "/" + kEthEnds, file.map);
  const Ends& ends = all[static_cast<std::size_t>((seed + all.size() - 1) % all.size())];
  sitl::WorldOptions options;
  options.start_W = point(ends.start_W);
  options.goal_W = point(ends.goal_W);
  options.bounds_W = Aabb{point(std::span(file.bounds_W).first(3)), point(std::span(file.bounds_W).last(3))};
  options.radius_m = kPoint_m;
  const std::string path = folder + "/" + file.file;
  return {
      [=] { return sitl::load_world(path, options); },
      {},
      fmt::format("--world {}{} --bounds={} --start={} --goal={}", kFolderMark, file.file,
                  fmt::join(file.bounds_W, ","), fmt::join(ends.start_W, ","), fmt::join(ends.goal_W, ","))};
}

}  // namespace

bool is_suite(const std::string& name) { return name == "hard" || name == "foreign"; }

std::string world_of_environment(const std::string& environment) {
  return environment.substr(0, environment.find('/'));
}
std::string vehicle_of_environment(const std::string& environment) {
  return environment.substr(environment.find('/') + 1);
}

std::vector<std::string> suite_environments(const std::string& suite, const std::vector<std::string>& only,
                                            const std::vector<std::string>& vehicles) {
  const std::vector<std::string> names = names_of(suite);
  for (const std::string& name : only) {
    if (std::find(names.begin(), names.end(), name) == names.end())
      throw InputError(fmt::format("--environments: unknown world '{}' of suite {}: must be {}", name, suite,
                                   fmt::join(names, ", ")));
  }
  std::vector<std::string> environments;
  for (const std::string& name : only.empty() ? names : only) {
    std::vector<std::string> mine = vehicles;
    if (mine.empty() && suite == "hard") mine.assign(kHardVehicles.begin(), kHardVehicles.end());
    if (mine.empty()) mine.emplace_back(foreign_world(name)->vehicle);
    for (const std::string& vehicle : mine) environments.push_back(fmt::format("{}/{}", name, vehicle));
  }
  return environments;
}

std::vector<std::string> suite_files(const std::string& suite, const std::string& folder,
                                     const std::vector<std::string>& environments) {
  std::vector<std::string> files;
  if (suite == "hard") return files;
  for (const std::string& environment : environments) {
    const ForeignWorld& world = *foreign_world(world_of_environment(environment));
    files.push_back(folder + "/" + world.file);
    if (world.ends.empty()) files.push_back(folder + "/" + kEthEnds);
  }
  std::sort(files.begin(), files.end());
  files.erase(std::unique(files.begin(), files.end()), files.end());
  std::vector<std::string> missing;
  for (const std::string& file : files) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error))
      missing.push_back(std::filesystem::path(file).filename());
  }
  if (!missing.empty())
    throw InputError(fmt::format("--worlds: {}: has no {}: must hold these files of their authors", folder,
                                 fmt::join(missing, ", ")));
  return files;
}

SuiteProblem suite_problem(const std::string& suite, const std::string& folder,
                           const std::string& environment, std::uint64_t seed, double radius_m) {
  const std::string name = world_of_environment(environment);
  if (suite == "hard")
    return hard_problem(*hard_world(name), vehicle_of_environment(environment), seed, radius_m);
  return foreign_problem(*foreign_world(name), folder, seed);
}

double judged_way_m(const sitl::World& world, double radius_m) {
  sitl::WayQuestion question;
  question.radius_m = radius_m + kJudgeMargin_m;
  const sitl::WayVerdict verdict = sitl::judge_way(world, question);
  const double climb_m = world.start_W().z() - mission::ground_below(world).z();
  return verdict.way ? verdict.shortest_m + climb_m : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace roborun::evaluation
