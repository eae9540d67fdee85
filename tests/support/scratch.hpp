/// Files of a test or a fuzz target.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace roborun::test {

/// An empty folder of this process alone, gone when the process ends: tests run side by side.
inline const std::filesystem::path& scratch_folder() {
  static const struct Folder {
    Folder() : path(std::filesystem::temp_directory_path() / ("roborun." + std::to_string(getpid()))) {
      std::filesystem::remove_all(path);
      std::filesystem::create_directories(path);
    }
    ~Folder() {
      std::error_code ignored;
      std::filesystem::remove_all(path, ignored);
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    std::filesystem::path path;
  } folder;
  return folder.path;
}

/// A file's path in it.
inline std::string scratch(const std::string& name) { return (scratch_folder() / name).string(); }

/// The same, with the file there.
inline std::string scratch_file(const std::string& name, const std::string& bytes) {
  const std::string path = scratch(name);
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

}  // namespace roborun::test
