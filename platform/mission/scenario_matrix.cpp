#include "platform/mission/scenario_matrix.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <filesystem>

#include "platform/board/board_profile.hpp"
#include "platform/input/arguments.hpp"
#include "platform/input/input_error.hpp"
#include "platform/sitl/world/generator.hpp"

namespace roborun::mission {
namespace {

constexpr const char* kNoFault = "none";
constexpr const char* kWorldFile = ".toml";

std::vector<std::string> parts_between_colons(const std::string& text) {
  std::vector<std::string> parts{""};
  for (const char c : text) {
    if (c == ':')
      parts.emplace_back();
    else
      parts.back() += c;
  }
  return parts;
}

const sitl::ComponentSpec& component_named(const std::string& option, const std::string& text,
                                           const std::string& name) {
  std::vector<const char*> names;
  for (const sitl::ComponentSpec& spec : sitl::kComponents) {
    if (name == spec.name) return spec;
    names.push_back(spec.name);
  }
  throw InputError(
      fmt::format("{}: '{}': component '{}' must be one of {}; or none, for a flight without fault", option,
                  text, name, fmt::join(names, ", ")));
}

sitl::FaultKind kind_named(const std::string& option, const std::string& text,
                           const sitl::ComponentSpec& spec, const std::string& name) {
  std::vector<const char*> names;
  for (std::size_t k = 1; k < sitl::kFaultKindNames.size(); ++k) {
    const auto kind = static_cast<sitl::FaultKind>(k);
    if ((spec.kinds & sitl::bit(kind)) == 0) continue;
    if (name == sitl::kFaultKindNames.at(k)) return kind;
    names.push_back(sitl::kFaultKindNames.at(k));
  }
  throw InputError(fmt::format("{}: '{}': kind '{}' of {} must be one of {}", option, text, name, spec.name,
                               fmt::join(names, ", ")));
}

}  // namespace

std::optional<sitl::Fault> fault_named(const std::string& option, const std::string& name) {
  if (name == kNoFault) return std::nullopt;
  const std::vector<std::string> parts = parts_between_colons(name);
  const sitl::ComponentSpec& spec = component_named(option, name, parts.front());
  sitl::Fault fault{spec.component, kind_named(option, name, spec, parts.size() > 1 ? parts[1] : "")};
  if (parts.size() > 3)
    throw InputError(
        fmt::format("{}: '{}': must be COMPONENT:KIND or COMPONENT:KIND:INSTANCE", option, name));
  if (parts.size() == 3) fault.instance = input::whole_of(option, parts[2], 0, spec.instances - 1);
  return fault;
}

governor::Phase phase_named(const std::string& option, const std::string& name) {
  std::vector<const char*> names;
  for (std::size_t i = 0; i < governor::kPhaseCount; ++i) {
    names.push_back(governor::to_string(static_cast<governor::Phase>(i)));
    if (name == names.back()) return static_cast<governor::Phase>(i);
  }
  throw InputError(fmt::format("{}: '{}': must be one of {}", option, name, fmt::join(names, ", ")));
}

std::vector<std::string> usual_faults() {
  std::vector<std::string> names{kNoFault};
  for (const sitl::ComponentSpec& spec : sitl::kComponents) {
    const auto kind = static_cast<std::size_t>(std::countr_zero(spec.kinds));
    names.push_back(fmt::format("{}:{}", spec.name, sitl::kFaultKindNames.at(kind)));
  }
  return names;
}

std::string column_name(const std::string& environment) {
  return environment.ends_with(kWorldFile) ? std::filesystem::path(environment).stem().string() : environment;
}

std::vector<Scenario> cells_of(const MatrixPlan& plan) {
  const board::Profile profile = board::paper();
  std::vector<Scenario> cells;
  for (const std::string& fault : plan.faults) {
    const std::optional<sitl::Fault> injected = fault_named("--faults", fault);
    for (const std::string& environment : plan.environments) {
      const bool is_file = environment.ends_with(kWorldFile);
      if (!is_file) (void)sitl::environment(environment);
      for (const std::uint64_t seed : plan.seeds) {
        Scenario s;
        s.name = fmt::format("{} {} seed {}", fault, column_name(environment), seed);
        s.about = fmt::format("{} in {}", fault, environment);
        (is_file ? s.world : s.environment) = environment;
        if (is_file) s.files.push_back(environment);
        s.config.seed = seed;
        s.config.flight.costs = profile.costs;
        s.config.flight.model = profile.model;
        s.config.judge.time_limit_s = plan.time_limit_s;
        if (injected)
          s.config.faults.push_back({*injected, plan.phase, plan.at_s, plan.for_s});
        else
          s.expect.outcome = "reached_goal";
        cells.push_back(std::move(s));
      }
    }
  }
  return cells;
}

}  // namespace roborun::mission
