#include "platform/report/instruction_counts.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "platform/input/json_reader.hpp"

namespace roborun::report {
namespace {
constexpr const char* kWanted = "must be what toolchain/bench/run instructions --update writes";
}  // namespace

InstructionCounts instruction_counts(const std::string& json) {
  InstructionCounts counts;
  try {
    const nlohmann::ordered_json all = input::parse_json(json);
    counts.commit = all.at("commit");
    for (const auto& [slot, figures] : all.at("slots").items())
      counts.worst[slot] = figures.at("worst").get<std::uint64_t>();
  } catch (const InputError& error) {
    throw std::invalid_argument(fmt::format("{}: {}", error.what(), kWanted));
  } catch (const nlohmann::json::exception&) {
    throw std::invalid_argument(kWanted);
  }
  return counts;
}

}  // namespace roborun::report
