/// The calls of the operating system that a capture of images makes: a seam, so that a test plays the device.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "firmware_if/time.hpp"

namespace roborun::feed {

/// Whatever returns int returns -errno where it fails. One thread.
class VideoCalls {
 public:
  virtual ~VideoCalls() = default;
  /// A descriptor.
  [[nodiscard]] virtual int open(const std::string& path) = 0;
  /// ioctl(): 0 or more.
  [[nodiscard]] virtual int control(int fd, unsigned long request, void* argument) = 0;
  /// `bytes` of a buffer at `offset`, shared; null: failed.
  [[nodiscard]] virtual void* map(int fd, std::size_t bytes, std::int64_t offset) = 0;
  virtual void unmap(void* memory, std::size_t bytes) = 0;
  /// 1: there is an image, or an error to be read; 0: neither came in time.
  [[nodiscard]] virtual int wait(int fd, Nanos most) = 0;
  virtual void close(int fd) = 0;
  /// CLOCK_MONOTONIC.
  [[nodiscard]] virtual Nanos now() = 0;
  virtual void pause(Nanos duration) = 0;
};

/// Those of Linux.
class LinuxVideo final : public VideoCalls {
 public:
  [[nodiscard]] int open(const std::string& path) override;
  [[nodiscard]] int control(int fd, unsigned long request, void* argument) override;
  [[nodiscard]] void* map(int fd, std::size_t bytes, std::int64_t offset) override;
  void unmap(void* memory, std::size_t bytes) override;
  [[nodiscard]] int wait(int fd, Nanos most) override;
  void close(int fd) override;
  [[nodiscard]] Nanos now() override;
  void pause(Nanos duration) override;
};

}  // namespace roborun::feed
