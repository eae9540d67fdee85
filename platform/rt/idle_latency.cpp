#include "platform/rt/idle_latency.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>

namespace roborun::rt {

IdleLatencyHold::IdleLatencyHold() noexcept : file_(open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC)) {
  const std::int32_t longest_us = 0;
  if (file_ >= 0 && write(file_, &longest_us, sizeof longest_us) == sizeof longest_us) return;
  error_ = errno;
  if (file_ >= 0) (void)close(file_);
  file_ = -1;
}

IdleLatencyHold::~IdleLatencyHold() {
  if (file_ >= 0) (void)close(file_);
}

std::string IdleLatencyHold::describe() const {
  if (file_ >= 0) return "held at 0 us";
  return std::string("as the kernel likes: /dev/cpu_dma_latency: ") + std::strerror(error_);
}

}  // namespace roborun::rt
