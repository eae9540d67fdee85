/// Whole text files, read and written.
#pragma once

#include <string>
#include <string_view>

namespace roborun::input {

/// The whole of a file. Throws InputError "PATH: cannot be opened: must be WANTED".
[[nodiscard]] std::string read_text(const std::string& path, std::string_view wanted);
/// Empty if a file of that name could be written (or the name is empty), otherwise the line that write_file
/// would give: to be asked before long work.
[[nodiscard]] std::string cannot_write(const std::string& path);
/// Written beside `path` and renamed, so that a half-written file never stays under that name. Empty if all
/// is well, otherwise one line that says what failed.
[[nodiscard]] std::string write_file(const std::string& path, const std::string& text);

}  // namespace roborun::input
