/// Files that commands read; "-" and no name at all are standard input.
#pragma once

#include <cstddef>
#include <string>

#include "platform/input/input_file.hpp"

namespace roborun::app {

[[nodiscard]] inline input::InputFile open_input(const std::string& path, const char* wanted) {
  return path.empty() || path == "-" ? input::InputFile::standard_input() : input::InputFile(path, wanted);
}

/// Calls visit(line, number) for each line, from 1.
template <typename Visit>
void for_each_line(const std::string& path, const char* wanted, Visit&& visit) {
  constexpr std::size_t kMostLine_bytes = 1U << 16U;
  input::InputFile file = open_input(path, wanted);
  std::string line;
  for (std::size_t number = 1; file.line(line, kMostLine_bytes); ++number) visit(line, number);
}

}  // namespace roborun::app
