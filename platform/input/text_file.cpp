#include "platform/input/text_file.hpp"

#include <fmt/format.h>

#include <array>

#include "platform/input/input_error.hpp"
#include "platform/input/output_file.hpp"

namespace roborun::input {

std::string read_text(const std::string& path, std::string_view wanted, std::size_t most_bytes) {
  InputFile file(path, wanted);
  return read_text(file, wanted, most_bytes);
}

std::string read_text(InputFile& file, std::string_view wanted, std::size_t most_bytes) {
  std::string text;
  std::array<char, 1U << 16U> block{};
  while (const std::size_t bytes = file.read(block)) {
    if (text.size() + bytes > most_bytes)
      throw InputError(
          fmt::format("{}: larger than {} MiB: must be {}", file.name(), most_bytes >> 20U, wanted));
    text.append(block.data(), bytes);
  }
  return text;
}

void write_file(const std::string& path, std::string_view text) {
  OutputFile file(path);
  file.write(text);
  file.commit();
}

}  // namespace roborun::input
