/// Whole text files, read and written.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "platform/input/input_file.hpp"

namespace roborun::input {

inline constexpr std::size_t kMostText_bytes = 64U << 20U;

/// The whole of a file. Throws InputError as InputFile, and "must be WANTED" for more than `most_bytes`.
[[nodiscard]] std::string read_text(const std::string& path, std::string_view wanted,
                                    std::size_t most_bytes = kMostText_bytes);
/// The rest of an open one.
[[nodiscard]] std::string read_text(InputFile& file, std::string_view wanted,
                                    std::size_t most_bytes = kMostText_bytes);
/// As OutputFile. Throws InputError.
void write_file(const std::string& path, std::string_view text);

}  // namespace roborun::input
