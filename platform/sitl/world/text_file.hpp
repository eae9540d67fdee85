#pragma once

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

#include "platform/sitl/world/input_error.hpp"

namespace roborun::sitl {

/// The whole of a file. Throws InputError "PATH: cannot be opened: must be WANTED".
[[nodiscard]] inline std::string read_text(const std::string& path, std::string_view wanted) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw InputError(fmt::format("{}: cannot be opened: must be {}", path, wanted));
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace roborun::sitl
