#include "platform/sitl/world/file_bytes.hpp"

#include <fmt/format.h>

#include <array>
#include <fstream>

#include "platform/input/input_error.hpp"

namespace roborun::sitl {

std::vector<unsigned char> read_bytes(const std::string& path, std::size_t most, const std::string& wanted) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw InputError(fmt::format("{}: cannot be opened: must be {}", path, wanted));
  std::vector<unsigned char> bytes;
  std::array<char, 1U << 16U> block{};
  while (file.read(block.data(), block.size()) || file.gcount() > 0) {
    bytes.insert(bytes.end(), block.begin(), block.begin() + file.gcount());
    if (bytes.size() > most) throw InputError(fmt::format("{}: larger than {} MiB", path, most >> 20U));
  }
  if (file.bad()) throw InputError(fmt::format("{}: cannot be read: must be {}", path, wanted));
  return bytes;
}

}  // namespace roborun::sitl
