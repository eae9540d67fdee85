/// The file of a log: it has its name from the first byte on, and what a kill or a power loss leaves of it is a log that ends
/// early.
#pragma once

#include <string>
#include <string_view>

namespace roborun::log {

class ByteSink {
 public:
  virtual ~ByteSink() = default;
  /// All of the bytes, or none: false.
  [[nodiscard]] virtual bool append(std::string_view bytes) noexcept = 0;
};

class LogFile final : public ByteSink {
 public:
  /// Empties the file that is there; an empty path is no file: what is appended is gone. `synced`: its name, and each append(), are on the disk when it returns; for threads that may wait. Throws
  /// InputError "PATH: cannot be written: WHY".
  LogFile(const std::string& path, bool synced);
  ~LogFile() override;
  LogFile(const LogFile&) = delete;
  LogFile& operator=(const LogFile&) = delete;

  /// What a full disk took only a part of is taken back. What cannot take back (a FIFO, a device) takes nothing any more
  /// after its first failure.
  [[nodiscard]] bool append(std::string_view bytes) noexcept override;
  /// "PATH: cannot be written: WHY" of the first failure; empty: none.
  [[nodiscard]] std::string error() const;

 private:
  std::string path_;
  int fd_{-1};
  bool synced_;
  bool regular_{false};
  bool dead_{false};
  int error_{0};
  long long size_{0};
};

}  // namespace roborun::log
