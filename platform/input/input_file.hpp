/// Bytes and lines of a file or of standard input. What cannot be read is an error, never the end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace roborun::input {

class InputFile {
 public:
  /// Throws InputError "PATH: cannot be opened: must be WANTED".
  InputFile(const std::string& path, std::string_view wanted);
  [[nodiscard]] static InputFile standard_input();
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  /// As many bytes as there are: fewer than asked for only at the end. Throws InputError (a folder: "cannot be
  /// read: Is a directory").
  [[nodiscard]] std::size_t read(std::span<char> to);
  /// On to that byte. Throws InputError, also for what has no such places, as a pipe.
  void seek(std::uint64_t at);
  /// The next line without its end; false at the end. Throws InputError, also for a line of more than
  /// `most_bytes`.
  [[nodiscard]] bool line(std::string& to, std::size_t most_bytes);
  /// For complaints.
  [[nodiscard]] const std::string& name() const noexcept { return name_; }

 private:
  InputFile(std::string name, int fd) : name_(std::move(name)), fd_(fd) {}
  [[nodiscard]] bool fill();

  std::string name_;
  int fd_;
  std::string buffer_;  ///< Read and not yet given out, from at_ on.
  std::size_t at_{0};
  std::size_t lines_{0};
};

}  // namespace roborun::input
