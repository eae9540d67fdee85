#include "platform/log/log_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <filesystem>
#include <system_error>

#include "platform/input/input_error.hpp"

namespace roborun::log {
namespace {

std::string cannot_log(const std::string& path, int error) {
  return fmt::format("{}: cannot be written: {}", path, std::generic_category().message(error));
}

/// After a power loss the file has its name only if the folder was written, too.
void sync_folder_of(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  const int fd = open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return;
  (void)fsync(fd);
  (void)close(fd);
}

}  // namespace

LogFile::LogFile(const std::string& path, bool synced) : path_(path), synced_(synced) {
  if (path.empty()) return;
  fd_ = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (fd_ < 0) throw InputError(cannot_log(path, errno));
  struct stat status {};
  regular_ = fstat(fd_, &status) == 0 && S_ISREG(status.st_mode);
  // Who reads a FIFO and goes away ends the log and not the flight.
  if (!regular_) (void)std::signal(SIGPIPE, SIG_IGN);
  if (synced_ && regular_) sync_folder_of(path);
}

LogFile::~LogFile() {
  if (fd_ >= 0) (void)close(fd_);
}

bool LogFile::append(std::string_view bytes) noexcept {
  if (dead_) return false;
  if (fd_ < 0) return true;
  std::size_t at = 0;
  while (at < bytes.size()) {
    const ssize_t n = ::write(fd_, bytes.data() + at, bytes.size() - at);
    if (n > 0) at += static_cast<std::size_t>(n);
    if (n >= 0 || errno == EINTR) continue;
    if (error_ == 0) error_ = errno;
    dead_ = !regular_ || ftruncate(fd_, size_) != 0 || lseek(fd_, size_, SEEK_SET) != size_;
    return false;
  }
  size_ += static_cast<long long>(bytes.size());
  if (synced_ && regular_) (void)fdatasync(fd_);
  return true;
}

std::string LogFile::error() const { return error_ == 0 ? std::string() : cannot_log(path_, error_); }

}  // namespace roborun::log
