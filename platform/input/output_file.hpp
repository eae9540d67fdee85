/// The one way in which anything is written: whole or not at all, and never over what is read.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace roborun::input {

/// A file that takes its name only when it is complete: until commit(), and after a kill, a full disk or a
/// power loss, the file before is untouched. It is written beside its name (NAME.PID.part) and renamed, with
/// the permissions of the file before; parts of NAME whose writer was killed are removed. A symbolic link
/// stays, and its target is written. What is no regular file (a FIFO, a device, /dev/stdout) is written
/// through.
class OutputFile {
 public:
  /// Throws InputError "PATH: cannot be written: WHY".
  explicit OutputFile(const std::string& path);
  /// Without commit(), nothing is left.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// A failure is kept for check() and commit(): a flight writes without exceptions.
  void write(std::string_view bytes) noexcept;
  /// Throws InputError if anything could not be written so far.
  void check() const;
  /// All is on the disk, under its name. Throws InputError; then the file before is still there.
  void commit();

 private:
  void open_part();
  void flush() noexcept;
  [[noreturn]] void refuse(int error) const;

  std::string path_;    ///< As it was given.
  std::string target_;  ///< Behind symbolic links.
  std::string part_;    ///< Empty: written through.
  int fd_{-1};
  int error_{0};
  std::string buffer_;
};

struct NamedOutput {
  const char* option;
  std::string path;  ///< Empty: not asked for.
};

/// To be asked before work begins. Throws InputError for an output that is one of `inputs` (by whatever name,
/// also through links), an output that is another output or the file that standard output goes to, a folder,
/// and what cannot be written. Inputs that are no files (names, empty) are left out.
void check_outputs(const std::vector<NamedOutput>& outputs, const std::vector<std::string>& inputs);

}  // namespace roborun::input
