/// Scenarios, each flown in a process of its own: told as its verdict falls, and written down if it failed.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "platform/mission/scenario_file.hpp"

namespace roborun::app {

struct ScenarioFlight {
  mission::Scenario scenario;
  std::string stem;   ///< Of its files' names, without ending; unique among the flights.
  std::string again;  ///< Command that flies it alone and writes its trace ...
  std::string trace;  ///< ... to this file.
};

/// What is written besides standard output.
struct ScenarioOutputs {
  std::string trace, plot, log;  ///< Of a single flight, whatever its verdict; or empty.
  std::string
      folder;  ///< Trace, picture and log of every flight that failed, as STEM.csv, .svg and .mcap; or empty.
};

/// Seeds from --seed or --seeds (at most one of both is given); empty: that of each scenario.
[[nodiscard]] std::vector<std::uint64_t> seeds_of(const std::string& seed, const std::string& seeds);
/// Makes the folder, and checks that all can be written over none of `inputs`. Precondition: there are flights. Throws
/// InputError.
void check_scenario_outputs(std::span<const ScenarioFlight> flights, const ScenarioOutputs& outputs,
                            const std::string& junit, const std::vector<std::string>& inputs);
/// Flies all, at most `jobs` at a time. `told` gets each verdict as it falls: the JSON object of `scenario run --json`. Files
/// of a flight are written before its verdict is told. Returns the verdicts in the order of the flights. Throws InputError,
/// and Interrupted after Ctrl-C.
[[nodiscard]] std::vector<nlohmann::json> fly_scenarios(
    std::span<const ScenarioFlight> flights, const ScenarioOutputs& outputs, int jobs,
    const std::function<void(const nlohmann::json&)>& told);
/// What a person reads of one verdict: a line, and for a failed one its reasons, its files and the commands to look into it.
[[nodiscard]] std::string text_of_verdict(const nlohmann::json& verdict);

/// Throws InputError if a log could not be written as a whole.
void refuse_lost_logs(const std::vector<nlohmann::json>& verdicts);
/// To standard output, at once. Throws std::system_error if it cannot be written.
void print_now(const std::string& text);

}  // namespace roborun::app
