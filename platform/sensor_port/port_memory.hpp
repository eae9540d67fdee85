/// A file of shared memory as its reader sees it: nothing that another process does to the file ends this one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace roborun::sensor_port {

/// A mapping for reading. Where the file was cut short below it, reading gives zeros from then on, instead of the signal that the kernel has for
/// that (SIGBUS), and is_cut() says so.
class PortMemory {
 public:
  PortMemory() = default;
  ~PortMemory();
  PortMemory(const PortMemory&) = delete;
  PortMemory& operator=(const PortMemory&) = delete;

  /// Maps all of the file and touches every page of it. Empty: done; otherwise what is wrong. Not for the loop. At most kMost are open at once.
  [[nodiscard]] std::string open(const std::string& path);
  void close() noexcept;
  [[nodiscard]] const std::byte* data() const noexcept { return data_; }
  [[nodiscard]] std::size_t size() const noexcept { return bytes_; }
  /// RT-safe: O(1).
  [[nodiscard]] bool is_cut() const noexcept;
  /// The file at its path is no longer the one that was opened. Asks the system: not for the loop.
  [[nodiscard]] bool is_replaced() const;

  static constexpr std::size_t kMost = 64;

 private:
  std::string path_;
  const std::byte* data_{nullptr};
  std::size_t bytes_{};
  std::size_t entry_{};  ///< Where the signal handler finds it.
  std::uint64_t device_{}, inode_{};
};

}  // namespace roborun::sensor_port
