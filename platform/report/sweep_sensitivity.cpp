#include "platform/report/sweep_sensitivity.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

namespace roborun::report {
namespace {

std::optional<std::size_t> step_of(const Knob& knob, const SweepRow& row) {
  for (std::size_t i = 0; i < knob.values.size(); ++i) {
    if (std::fabs(knob.value(row) - knob.values.at(i)) < 1e-9) return i;
  }
  return std::nullopt;
}

/// 1 .. 27; nothing for an environment that is none of them.
std::optional<std::size_t> number_of(const SweepRow& row) {
  std::size_t number = 1;
  for (const Knob& knob : kKnobs) {
    const auto step = step_of(knob, row);
    if (!step) return std::nullopt;
    number += *step * knob.stride;
  }
  return number;
}

/// Missions of one seed that differ in one knob alone.
using Line = std::array<const SweepRow*, 3>;

std::size_t size_of(const Line& line) {
  return static_cast<std::size_t>(
      std::count_if(line.begin(), line.end(), [](const SweepRow* row) { return row != nullptr; }));
}

/// `lowest`: number of the environment at the knob's lowest value.
std::string what_is_missing(std::size_t lowest, const Line& line, const Knob& knob) {
  std::string here;
  std::string missing;
  for (std::size_t i = 0; i < line.size(); ++i) {
    std::string& list = line.at(i) == nullptr ? missing : here;
    list += fmt::format("{}{}", list.empty() ? "" : ", ", lowest + i * knob.stride);
  }
  return fmt::format("beside {}: {} missing", here, missing);
}

}  // namespace

Sensitivity sensitivity_of(const std::vector<SweepRow>& rows, const std::string& profile,
                           const std::string& design, const Knob& knob) {
  Sensitivity s;
  std::map<std::pair<std::uint64_t, std::size_t>, Line> lines;  // by seed and lowest environment
  for (const SweepRow& row : rows) {
    if (row.result.profile != profile || row.result.design != design) continue;
    ++s.missions;
    const auto number = number_of(row);
    if (!number || !counts(row.result)) continue;
    const std::size_t step = *step_of(knob, row);
    lines[{row.result.seed, *number - step * knob.stride}].at(step) = &row;
  }
  const std::pair<const std::pair<std::uint64_t, std::size_t>, Line>* nearest = nullptr;
  for (const auto& entry : lines) {
    const Line& line = entry.second;
    if (size_of(line) == line.size()) {
      for (std::size_t i = 0; i < line.size(); ++i) s.at.at(i).push_back(line.at(i));
    } else if (nearest == nullptr || size_of(line) > size_of(nearest->second)) {
      nearest = &entry;
    }
  }
  if (s.at.front().empty())
    s.missing = nearest == nullptr ? "no mission counts"
                                   : what_is_missing(nearest->first.second, nearest->second, knob);
  return s;
}

}  // namespace roborun::report
