#include "platform/report/sha256.hpp"

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <fstream>

namespace roborun::report {

void Sha256::add(std::string_view bytes) {
  // Characters may be read as bytes, whatever their type.
  hash_.add(
      {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});  // NOLINT(*-reinterpret-cast)
}

std::string Sha256::finish() { return fmt::format("{:02x}", fmt::join(hash_.finish(), "")); }

std::string sha256(std::string_view bytes) {
  Sha256 hash;
  hash.add(bytes);
  return hash.finish();
}

std::string sha256_of_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return "unknown";
  Sha256 hash;
  std::array<char, 65536> chunk{};
  while (file) {
    file.read(chunk.data(), chunk.size());
    hash.add({chunk.data(), static_cast<std::size_t>(file.gcount())});
  }
  return file.bad() ? "unknown" : hash.finish();
}

}  // namespace roborun::report
