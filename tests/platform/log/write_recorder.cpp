// Loaded before the C library (LD_PRELOAD) into a program under test: records when the file $RECORD_FILE was written and synced, as
// RecordedCall in the file $RECORD_TO. Allocates nothing: the program may have forbidden it.
#include "tests/platform/log/write_recorder.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdarg>
#include <cstdlib>
#include <cstring>
#include <ctime>

namespace {

using roborun::test::RecordedCall;

int file_fd = -1;
int folder_fd = -1;
std::int64_t size_bytes = 0;

std::int64_t now_ns() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * 1'000'000'000LL + t.tv_nsec;
}

void record(RecordedCall::What what, std::int64_t begin_ns) {
  static const int to = static_cast<int>(syscall(SYS_openat, AT_FDCWD, std::getenv("RECORD_TO"),
                                                 O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644));
  const RecordedCall call{what, begin_ns, now_ns(), size_bytes};
  if (syscall(SYS_write, to, &call, sizeof call) != sizeof call) std::abort();
}

bool is_folder_of_file(const char* path, const char* file) {
  const char* const slash = std::strrchr(file, '/');
  return slash != nullptr && std::strncmp(path, file, static_cast<std::size_t>(slash - file)) == 0 &&
         std::strlen(path) == static_cast<std::size_t>(slash - file);
}

int opened(const char* path, int flags, unsigned mode) {
  const int fd = static_cast<int>(syscall(SYS_openat, AT_FDCWD, path, flags, mode));
  const char* const file = std::getenv("RECORD_FILE");
  if (file == nullptr || fd < 0) return fd;
  if (std::strcmp(path, file) == 0 && (flags & O_WRONLY) != 0) file_fd = fd;
  if (is_folder_of_file(path, file)) folder_fd = fd;
  return fd;
}

template <typename Call>
auto recorded(int fd, RecordedCall::What what, const Call& call) {
  const std::int64_t begin_ns = now_ns();
  const auto result = call();
  if (fd == file_fd && result >= 0) {
    if (what == RecordedCall::What::kWritten) size_bytes += result;
    record(what, begin_ns);
  } else if (fd == folder_fd && what == RecordedCall::What::kSynced && result >= 0) {
    record(RecordedCall::What::kFolderSynced, begin_ns);
    folder_fd = -1;
  }
  return result;
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const unsigned mode = (flags & O_CREAT) != 0 ? va_arg(more, unsigned) : 0U;
  va_end(more);
  return opened(path, flags, mode);
}
int __open_2(const char* path, int flags) { return opened(path, flags, 0); }
ssize_t write(int fd, const void* bytes, size_t count) {
  return recorded(fd, RecordedCall::What::kWritten, [&] { return syscall(SYS_write, fd, bytes, count); });
}
int fdatasync(int fd) {
  return recorded(fd, RecordedCall::What::kSynced,
                  [&] { return static_cast<int>(syscall(SYS_fdatasync, fd)); });
}
int fsync(int fd) {
  return recorded(fd, RecordedCall::What::kSynced, [&] { return static_cast<int>(syscall(SYS_fsync, fd)); });
}
int ftruncate(int fd, off_t size) noexcept {
  const int result = static_cast<int>(syscall(SYS_ftruncate, fd, size));
  if (fd != file_fd || result != 0) return result;
  size_bytes = size;
  record(RecordedCall::What::kCutOff, now_ns());
  return result;
}
}
