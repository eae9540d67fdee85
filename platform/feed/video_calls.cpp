#include "platform/feed/video_calls.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <thread>

namespace roborun::feed {

int LinuxVideo::open(const std::string& path) {
  const int fd = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  return fd < 0 ? -errno : fd;
}

int LinuxVideo::control(int fd, unsigned long request, void* argument) {
  int result = 0;
  do result = ioctl(fd, request, argument);
  while (result < 0 && errno == EINTR);
  return result < 0 ? -errno : result;
}

void* LinuxVideo::map(int fd, std::size_t bytes, std::int64_t offset) {
  void* const memory =
      mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, static_cast<off_t>(offset));
  return memory == MAP_FAILED ? nullptr : memory;
}

void LinuxVideo::unmap(void* memory, std::size_t bytes) { (void)munmap(memory, bytes); }

int LinuxVideo::wait(int fd, Nanos most) {
  pollfd one{fd, POLLIN, 0};
  const int result = poll(&one, 1, static_cast<int>(most.count() / 1'000'000));
  if (result < 0) return errno == EINTR ? 0 : -errno;
  return result;
}

void LinuxVideo::close(int fd) { (void)::close(fd); }

Nanos LinuxVideo::now() { return std::chrono::steady_clock::now().time_since_epoch(); }

void LinuxVideo::pause(Nanos duration) { std::this_thread::sleep_for(duration); }

}  // namespace roborun::feed
