#include "platform/report/instruction_counts.hpp"

#include <stdexcept>

#include "platform/report/shallow_json.hpp"

namespace roborun::report {

InstructionCounts instruction_counts(const std::string& json) {
  const nlohmann::ordered_json all = parse_shallow(json);
  InstructionCounts counts;
  try {
    counts.commit = all.at("commit");
    for (const auto& [slot, figures] : all.at("slots").items())
      counts.worst[slot] = figures.at("worst").get<std::uint64_t>();
  } catch (const nlohmann::json::exception&) {
    throw std::invalid_argument("must be what toolchain/bench/run instructions --update writes");
  }
  return counts;
}

}  // namespace roborun::report
