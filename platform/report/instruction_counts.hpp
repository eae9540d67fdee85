/// Instructions of each slot at its worst knobs, as toolchain/bench/run instructions counts them with callgrind.
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace roborun::report {

struct InstructionCounts {
  std::string commit;                          ///< Of the program that was counted.
  std::map<std::string, std::uint64_t> worst;  ///< By slot.
};

/// From {"commit": TEXT, "slots": {SLOT: {"worst": COUNT}}}. Throws std::invalid_argument with one line.
[[nodiscard]] InstructionCounts instruction_counts(const std::string& json);

}  // namespace roborun::report
