/// Faults x environments x seeds: scenarios that nobody has to write.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "platform/mission/scenario_file.hpp"

namespace roborun::mission {

/// The axes, and when every fault begins.
struct MatrixPlan {
  std::vector<std::string> faults;        ///< "none" or "COMPONENT:KIND[:INSTANCE]", as in a [[fault]].
  std::vector<std::string> environments;  ///< Of the 27, or files of worlds (*.toml).
  std::vector<std::uint64_t> seeds;
  governor::Phase phase{governor::Phase::kMission};
  double at_s{5.0};  ///< After the phase began.
  double for_s{1e6};
  double time_limit_s{7200.0};
};

/// Nothing for "none". Throws InputError that names the option, and says which components or kinds there are.
[[nodiscard]] std::optional<sitl::Fault> fault_named(const std::string& option, const std::string& name);
/// The phase of that name; throws InputError that names the option.
[[nodiscard]] governor::Phase phase_named(const std::string& option, const std::string& name);
/// "none", and every component with the first kind of its row in sitl::kComponents: off, if it can be off.
[[nodiscard]] std::vector<std::string> usual_faults();
/// Of an environment, for tables and names: of a file, its name without folder and ending.
[[nodiscard]] std::string column_name(const std::string& environment);
/// One scenario a cell, faults outermost, seeds innermost. A cell with a fault passes with any of kSafeOutcomes inside the
/// fence, one without must reach the goal. Throws InputError for a name that is none.
[[nodiscard]] std::vector<Scenario> cells_of(const MatrixPlan& plan);

}  // namespace roborun::mission
