#include "platform/input/input_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "platform/input/input_error.hpp"

namespace roborun::input {

InputFile::InputFile(const std::string& path, std::string_view wanted)
    : InputFile(path, open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
  if (fd_ < 0) throw InputError(fmt::format("{}: cannot be opened: must be {}", path, wanted));
}

InputFile InputFile::standard_input() { return {"standard input", STDIN_FILENO}; }

InputFile::~InputFile() {
  if (fd_ > STDIN_FILENO) (void)close(fd_);
}

bool InputFile::fill() {
  constexpr std::size_t kBlock = 1U << 16U;
  buffer_.erase(0, at_);
  at_ = 0;
  const std::size_t before = buffer_.size();
  buffer_.resize(before + kBlock);
  ssize_t n = 0;
  do {
    n = ::read(fd_, buffer_.data() + before, kBlock);
  } while (n < 0 && errno == EINTR);
  buffer_.resize(before + static_cast<std::size_t>(std::max<ssize_t>(n, 0)));
  if (n < 0) throw InputError(fmt::format("{}: cannot be read: {}", name_, strerror(errno)));
  return n > 0;
}

std::size_t InputFile::read(std::span<char> to) {
  std::size_t done = 0;
  while (done < to.size() && (at_ < buffer_.size() || fill())) {
    const std::size_t bytes = std::min(to.size() - done, buffer_.size() - at_);
    std::copy_n(buffer_.data() + at_, bytes, to.data() + done);
    done += bytes;
    at_ += bytes;
  }
  return done;
}

void InputFile::seek(std::uint64_t at) {
  buffer_.clear();
  at_ = 0;
  if (lseek(fd_, static_cast<off_t>(at), SEEK_SET) < 0)
    throw InputError(fmt::format("{}: cannot be read from its byte {} on: {}", name_, at, strerror(errno)));
}

bool InputFile::line(std::string& to, std::size_t most_bytes) {
  ++lines_;
  std::size_t end = buffer_.find('\n', at_);
  while (end == std::string::npos) {
    const std::size_t seen = buffer_.size() - at_;
    if (seen > most_bytes || !fill()) break;
    end = buffer_.find('\n', seen);
  }
  const std::size_t size = std::min(end, buffer_.size()) - at_;
  if (size > most_bytes)
    throw InputError(
        fmt::format("{}: line {}: longer than {} bytes: must be a file of lines", name_, lines_, most_bytes));
  if (size == 0 && end == std::string::npos) return false;
  to.assign(buffer_, at_, size);
  at_ += size + (end == std::string::npos ? 0 : 1);
  return true;
}

}  // namespace roborun::input
