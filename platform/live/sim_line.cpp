#include "platform/live/sim_line.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string_view>

#include "platform/input/input_error.hpp"

namespace roborun::live {

SimLine::SimLine(const std::string& option, const std::string& path)
    : file_(::open(path.c_str(), O_WRONLY | O_CLOEXEC)) {
  if (file_ < 0)
    throw InputError(
        fmt::format("{}: {}: {}: must be the pull of a gpio-sim line", option, path, std::strerror(errno)));
}

SimLine::~SimLine() { (void)::close(file_); }

bool SimLine::pull(bool up) noexcept {
  if (is_up_ == up) return true;
  const std::string_view text = up ? "pull-up" : "pull-down";
  if (::pwrite(file_, text.data(), text.size(), 0) != static_cast<ssize_t>(text.size())) return false;
  is_up_ = up;
  return true;
}

}  // namespace roborun::live
