// Where the library is libgpiod 1.6; gpiod_line_v2.cpp is for version 2.
#include "platform/gpio/gpiod_line.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <gpiod.h>

#include <cerrno>
#include <cstring>

#include "platform/gpio/line_name.hpp"

namespace roborun::gpio {

struct LineHandle {
  gpiod_chip* chip{};
  gpiod_line* line{};
};

namespace {

constexpr const char* kConsumer = "roborun";

int flags_of(const LineConfig& config) {
  int flags = config.active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0;
  if (config.bias == firmware_if::GpioBias::kPullUp) flags |= GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_UP;
  if (config.bias == firmware_if::GpioBias::kPullDown) flags |= GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_DOWN;
  return flags;
}

void release(LineHandle*& handle) noexcept {
  if (handle == nullptr) return;
  gpiod_chip_close(handle->chip);
  delete handle;
  handle = nullptr;
}

/// The line, not yet requested; null and `why` if there is none.
LineHandle* find(const std::string& name, std::string& why) {
  LineName wanted;
  if (!parse(name, wanted, why)) return nullptr;
  if (wanted.chip.empty()) {
    gpiod_line* line = gpiod_line_find(name.c_str());
    if (line != nullptr) return new LineHandle{gpiod_line_get_chip(line), line};
    why = fmt::format("line '{}': no chip has a line of this name (roborun gpio list)", name);
    return nullptr;
  }
  gpiod_chip* chip = gpiod_chip_open_lookup(wanted.chip.c_str());
  if (chip == nullptr) {
    why = fmt::format("line '{}': chip cannot be opened: {}", name, std::strerror(errno));
    return nullptr;
  }
  gpiod_line* line = gpiod_chip_get_line(chip, wanted.offset);
  if (line == nullptr) {
    gpiod_chip_close(chip);
    why = fmt::format("line '{}': the chip has no line {}", name, wanted.offset);
    return nullptr;
  }
  return new LineHandle{chip, line};
}

std::string refusal(const std::string& name, gpiod_line* line) {
  const int error = errno;
  const char* consumer = gpiod_line_consumer(line);
  if (error == EBUSY)
    return fmt::format("line '{}': busy, used by '{}'", name, consumer == nullptr ? "unknown" : consumer);
  return fmt::format("line '{}': {}", name, std::strerror(error));
}

}  // namespace

std::vector<LineInfo> list_lines() {
  std::vector<LineInfo> out;
  gpiod_chip_iter* chips = gpiod_chip_iter_new();
  if (chips == nullptr) return out;
  while (gpiod_chip* chip = gpiod_chip_iter_next(chips)) {
    for (unsigned i = 0; i < gpiod_chip_num_lines(chip); ++i) {
      gpiod_line* line = gpiod_chip_get_line(chip, i);
      if (line == nullptr) continue;
      const char* name = gpiod_line_name(line);
      const char* consumer = gpiod_line_consumer(line);
      const bool used = gpiod_line_is_used(line);
      out.push_back({gpiod_chip_name(chip), i, name == nullptr ? "" : name,
                     consumer != nullptr ? consumer : (used ? "kernel" : ""),
                     gpiod_line_direction(line) == GPIOD_LINE_DIRECTION_OUTPUT});
    }
  }
  gpiod_chip_iter_free(chips);
  return out;
}

GpiodInput::~GpiodInput() { release(line_); }

std::string GpiodInput::open(const LineConfig& config) {
  release(line_);
  std::string why;
  line_ = find(config.name, why);
  if (line_ == nullptr) return why;
  if (gpiod_line_request_both_edges_events_flags(line_->line, kConsumer, flags_of(config)) != 0) {
    why = refusal(config.name, line_->line);
    release(line_);
    return why;
  }
  edges_ = gpiod_line_event_get_fd(line_->line);
  if (fcntl(edges_, F_SETFL, O_NONBLOCK) != 0) {  // NOLINT(cppcoreguidelines-pro-type-vararg): POSIX
    why = fmt::format("line '{}': {}", config.name, std::strerror(errno));
    release(line_);
  }
  return why;
}

Result<bool> GpiodInput::active() noexcept {
  if (line_ == nullptr) return Status::kIo;
  const int value = gpiod_line_get_value(line_->line);
  if (value < 0) return Status::kIo;
  return value != 0;
}

Status GpiodInput::next_edge(firmware_if::GpioEdge& edge) noexcept {
  if (line_ == nullptr) return Status::kIo;
  gpiod_line_event event{};
  if (gpiod_line_event_read_fd(edges_, &event) != 0)
    return errno == EAGAIN || errno == EINTR ? Status::kNotReady : Status::kIo;
  edge.stamp = MonotonicTime{Nanos{std::int64_t{event.ts.tv_sec} * 1'000'000'000 + event.ts.tv_nsec}};
  edge.active = event.event_type == GPIOD_LINE_EVENT_RISING_EDGE;
  return Status::kOk;
}

GpiodOutput::~GpiodOutput() {
  if (line_ != nullptr) (void)gpiod_line_set_value(line_->line, 0);
  release(line_);
}

std::string GpiodOutput::open(const LineConfig& config) {
  release(line_);
  std::string why;
  line_ = find(config.name, why);
  if (line_ == nullptr) return why;
  if (gpiod_line_request_output_flags(line_->line, kConsumer, flags_of(config), 0) != 0) {
    why = refusal(config.name, line_->line);
    release(line_);
  }
  return why;
}

Status GpiodOutput::set(bool active) noexcept {
  if (line_ == nullptr) return Status::kIo;
  return gpiod_line_set_value(line_->line, active ? 1 : 0) == 0 ? Status::kOk : Status::kIo;
}

}  // namespace roborun::gpio
