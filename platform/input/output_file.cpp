#include "platform/input/output_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string_view>

#include "platform/input/input_error.hpp"

namespace roborun::input {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBuffer = 1U << 16U;
constexpr int kMostLinks = 40;  // as the kernel
constexpr std::string_view kPart = ".part";

std::optional<struct stat> stat_of(const std::string& path) {
  struct stat s {};
  if (stat(path.c_str(), &s) != 0) return std::nullopt;
  return s;
}

bool same(const struct stat& a, const struct stat& b) { return a.st_dev == b.st_dev && a.st_ino == b.st_ino; }

/// Where a name leads that may be a symbolic link, also one to nothing.
std::string behind_links(const std::string& path) {
  fs::path target = path;
  std::error_code error;
  for (int i = 0; i < kMostLinks && fs::is_symlink(target, error); ++i) {
    const fs::path link = fs::read_symlink(target, error);
    if (error) break;
    target = link.is_absolute() ? link : target.parent_path() / link;
  }
  return target.string();
}

std::string folder_of(const std::string& file) {
  const std::string folder = fs::path(file).parent_path().string();
  return folder.empty() ? "." : folder;
}

/// The descriptor of this process that `path` names (/dev/stdout, /dev/fd/2), or -1.
int own_descriptor(fs::path path) {
  constexpr std::array<std::array<std::string_view, 3>, 2> kNames{
      {{"/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"}, {"/dev/stderr", "/dev/fd/2", "/proc/self/fd/2"}}};
  std::error_code error;
  for (int i = 0; i < kMostLinks; ++i) {
    for (std::size_t k = 0; k < kNames.size(); ++k) {
      if (std::find(kNames[k].begin(), kNames[k].end(), path.string()) != kNames[k].end())
        return k == 0 ? STDOUT_FILENO : STDERR_FILENO;
    }
    const fs::path link = fs::read_symlink(path, error);
    if (error) return -1;
    path = link.is_absolute() ? link : path.parent_path() / link;
  }
  return -1;
}

bool is_written_through(const std::string& path) {
  if (own_descriptor(path) >= 0) return true;
  const auto there = stat_of(path);
  return there && !S_ISREG(there->st_mode) && !S_ISDIR(there->st_mode);
}

/// 0, or why the file cannot be written.
int obstacle_to(const std::string& path) {
  if (own_descriptor(path) >= 0) return 0;
  if (const auto there = stat_of(path)) {
    if (S_ISDIR(there->st_mode)) return EISDIR;
    if (access(path.c_str(), W_OK) != 0) return errno;
    if (!S_ISREG(there->st_mode)) return 0;
  } else if (errno != ENOENT) {
    return errno;
  }
  const std::string target = behind_links(path);
  if (target.empty() || target.back() == '/') return EISDIR;
  const std::string folder = folder_of(target);
  const auto there = stat_of(folder);
  if (!there) return errno;
  if (!S_ISDIR(there->st_mode)) return ENOTDIR;
  return access(folder.c_str(), W_OK | X_OK) == 0 ? 0 : errno;
}

std::string cannot(const std::string& path, int error) {
  const bool folder = error == ENOENT || error == ENOTDIR || error == EACCES;
  return fmt::format("{}: cannot be written: {}{}", path, strerror(error),
                     folder ? ": it and its folder must be writable" : "");
}

/// Whether both names are, or would be, one file.
bool same_file(const std::string& a, const std::string& b) {
  const auto left = stat_of(a);
  const auto right = stat_of(b);
  if (left && right) return same(*left, *right);
  if (left || right) return false;
  const fs::path to_a = behind_links(a);
  const fs::path to_b = behind_links(b);
  const auto in_a = stat_of(folder_of(to_a));
  const auto in_b = stat_of(folder_of(to_b));
  return in_a && in_b && same(*in_a, *in_b) && to_a.filename() == to_b.filename();
}

/// Whether the name still leads to the open file.
bool is_still(int fd, const std::string& path) {
  struct stat open_file {};
  const auto there = stat_of(path);
  return there && fstat(fd, &open_file) == 0 && same(*there, open_file);
}

bool is_number(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

/// "PID" or "PID-TRY": what stands between a name and ".part".
bool is_of_a_writer(std::string_view text) {
  const std::size_t dash = text.find('-');
  return is_number(text.substr(0, dash)) &&
         (dash == std::string_view::npos || is_number(text.substr(dash + 1)));
}

/// Removes the parts of a file that nobody locks: their writer was killed. Whatever cannot be read or locked stays.
void remove_stale_parts(const std::string& folder, const std::string& name) {
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const std::string path = at->path().string();
    const std::string file = at->path().filename().string();
    if (!file.starts_with(name + ".") || !file.ends_with(kPart)) continue;
    const std::size_t around = name.size() + 1 + kPart.size();
    std::error_code none;
    if (file.size() <= around || !is_of_a_writer(file.substr(name.size() + 1, file.size() - around)) ||
        at->symlink_status(none).type() != fs::file_type::regular)
      continue;
    const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    if (fd < 0) continue;
    if (flock(fd, LOCK_EX | LOCK_NB) == 0 && is_still(fd, path)) (void)unlink(path.c_str());
    (void)close(fd);
  }
}

/// The file that standard output goes to, by its own name.
bool is_standard_output(const std::string& path) {
  struct stat out {};
  const auto there = stat_of(path);
  return there && fstat(STDOUT_FILENO, &out) == 0 && same(*there, out);
}

}  // namespace

OutputFile::OutputFile(const std::string& path)
    : path_(path), target_(is_written_through(path) ? path : behind_links(path)) {
  if (const int error = obstacle_to(path); error != 0) refuse(error);
  if (const int own = own_descriptor(path); own >= 0) {
    (void)std::fflush(own == STDOUT_FILENO ? stdout : stderr);
    fd_ = fcntl(own, F_DUPFD_CLOEXEC, 3);
  } else if (is_written_through(path)) {
    fd_ = open(target_.c_str(), O_WRONLY | O_CLOEXEC);
  } else {
    open_part();
  }
  if (fd_ < 0) refuse(errno);
  buffer_.reserve(kBuffer);
}

void OutputFile::open_part() {
  constexpr std::size_t kMostName = 200;  // the rest is for the ending
  constexpr int kTries = 100;             // of processes that were killed and had our number
  const std::string name = fs::path(target_).filename().string().substr(0, kMostName);
  remove_stale_parts(folder_of(target_), name);
  for (int i = 0; fd_ < 0 && i < kTries; ++i) {
    const std::string ending = i == 0 ? "" : fmt::format("-{}", i);
    part_ = fmt::format("{}/{}.{}{}{}", folder_of(target_), name, getpid(), ending, kPart);
    fd_ = open(part_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd_ < 0 && errno != EEXIST) break;
    // Before it is locked another writer may take it for a dead one's. Without locks nobody does.
    if (fd_ < 0 || flock(fd_, LOCK_EX) != 0 || is_still(fd_, part_)) continue;
    (void)close(fd_);
    fd_ = -1;
  }
  if (fd_ < 0) return;
  const auto before = stat_of(target_);
  if (!before) return;
  (void)!fchown(fd_, before->st_uid, before->st_gid);  // only root may; the permissions count
  if (fchmod(fd_, before->st_mode & 07777U) != 0) error_ = errno;
}

OutputFile::~OutputFile() {
  if (fd_ >= 0) (void)close(fd_);
  if (!part_.empty()) (void)unlink(part_.c_str());
}

void OutputFile::write(std::string_view bytes) noexcept {
  while (!bytes.empty() && error_ == 0) {
    const std::size_t n = std::min(bytes.size(), kBuffer - buffer_.size());
    buffer_.append(bytes.substr(0, n));  // within what is reserved
    bytes.remove_prefix(n);
    if (buffer_.size() == kBuffer) flush();
  }
}

void OutputFile::flush() noexcept {
  for (std::size_t at = 0; at < buffer_.size() && error_ == 0;) {
    const ssize_t n = ::write(fd_, buffer_.data() + at, buffer_.size() - at);
    if (n < 0 && errno != EINTR) error_ = errno;
    if (n > 0) at += static_cast<std::size_t>(n);
  }
  buffer_.clear();
}

void OutputFile::refuse(int error) const { throw InputError(cannot(path_, error)); }

void OutputFile::check() const {
  if (error_ != 0) refuse(error_);
}

void OutputFile::commit() {
  flush();
  check();
  if (!part_.empty() && fsync(fd_) != 0) refuse(errno);
  const int closed = close(fd_);
  fd_ = -1;
  if (closed != 0) refuse(errno);
  if (part_.empty()) return;
  if (rename(part_.c_str(), target_.c_str()) != 0) refuse(errno);
  part_.clear();
  const int folder = open(folder_of(target_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const bool kept = folder >= 0 && (fsync(folder) == 0 || errno == EINVAL);  // EINVAL: it has no such thing
  const int error = errno;
  if (folder >= 0) (void)close(folder);
  if (!kept) refuse(error);
}

void check_outputs(const std::vector<NamedOutput>& outputs, const std::vector<std::string>& inputs) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const auto& [option, path] = outputs[i];
    if (path.empty()) continue;
    if (const int error = obstacle_to(path); error != 0)
      throw InputError(fmt::format("{}: {}", option, cannot(path, error)));
    if (is_written_through(path)) continue;
    for (const std::string& in : inputs) {
      if (!in.empty() && same_file(path, in))
        throw InputError(fmt::format("{}: {}: is {}, which is read: must be another file", option, path, in));
    }
    if (is_standard_output(path))
      throw InputError(
          fmt::format("{}: {}: standard output goes there, too: must be another file", option, path));
    for (std::size_t k = 0; k < i; ++k) {
      if (!outputs[k].path.empty() && same_file(path, outputs[k].path))
        throw InputError(
            fmt::format("{}: {}: is the file of {}: must be another file", option, path, outputs[k].option));
    }
  }
}

}  // namespace roborun::input
