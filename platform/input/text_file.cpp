#include "platform/input/text_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "platform/input/input_error.hpp"

namespace roborun::input {

std::string read_text(const std::string& path, std::string_view wanted) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw InputError(fmt::format("{}: cannot be opened: must be {}", path, wanted));
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string cannot_write(const std::string& path) {
  if (path.empty()) return {};
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  std::error_code error;
  const bool is_folder = std::filesystem::is_directory(path, error);
  if (!is_folder && access(folder.empty() ? "." : folder.c_str(), W_OK) == 0) return {};
  return is_folder ? fmt::format("{}: cannot be written: it is a folder", path)
                   : fmt::format("{}: cannot be written: the folder must exist and be writable", path);
}

std::string write_file(const std::string& path, const std::string& text) {
  const std::string part = path + ".part";
  {
    std::ofstream file(part, std::ios::binary | std::ios::trunc);
    file << text;
    file.flush();
    if (!file) {
      std::error_code ignored;
      std::filesystem::remove(part, ignored);
      return fmt::format("{}: cannot be written: the folder must exist and be writable", path);
    }
  }
  std::error_code error;
  std::filesystem::rename(part, path, error);
  if (!error) return {};
  std::error_code ignored;
  std::filesystem::remove(part, ignored);
  return fmt::format("{}: cannot be written: {}", path, error.message());
}

}  // namespace roborun::input
