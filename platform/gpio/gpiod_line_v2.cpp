// In the place of gpiod_line.cpp where the library is libgpiod 2.
#include <fcntl.h>
#include <fmt/format.h>
#include <gpiod.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "platform/gpio/gpiod_line.hpp"
#include "platform/gpio/line_name.hpp"

namespace roborun::gpio {

/// Objects of the library, with what frees them.
namespace owned {

template <auto kFree>
struct Freed {
  void operator()(auto* object) const noexcept { kFree(object); }
};
using Chip = std::unique_ptr<gpiod_chip, Freed<gpiod_chip_close>>;
using ChipInfo = std::unique_ptr<gpiod_chip_info, Freed<gpiod_chip_info_free>>;
using Info = std::unique_ptr<gpiod_line_info, Freed<gpiod_line_info_free>>;
using Settings = std::unique_ptr<gpiod_line_settings, Freed<gpiod_line_settings_free>>;
using Lines = std::unique_ptr<gpiod_line_config, Freed<gpiod_line_config_free>>;
using Wanted = std::unique_ptr<gpiod_request_config, Freed<gpiod_request_config_free>>;
using Request = std::unique_ptr<gpiod_line_request, Freed<gpiod_line_request_release>>;
using Edges = std::unique_ptr<gpiod_edge_event_buffer, Freed<gpiod_edge_event_buffer_free>>;

}  // namespace owned

struct LineHandle {
  owned::Chip chip;
  unsigned offset{};
  owned::Request request;
  owned::Edges edges;
  std::array<firmware_if::GpioEdge, 16> waiting{};  ///< Read, and not handed out: from `at` to `count`.
  std::size_t at{0}, count{0};
};

namespace {

using owned::Chip, owned::ChipInfo, owned::Info, owned::Lines, owned::Settings, owned::Wanted;

constexpr const char* kConsumer = "roborun";
// The kernel loses the oldest of more edges than it holds, the contract the newest of more than 16: it holds as many as it may.
constexpr std::size_t kHeldByKernel = 1024, kReadAtOnce = 64;

void release(LineHandle*& handle) noexcept {
  delete handle;
  handle = nullptr;
}

const char* text_or_empty(const char* text) noexcept { return text == nullptr ? "" : text; }

/// Asks all chips that we may open, in the order of their paths, until one says yes.
void ask_chips(const std::function<bool(Chip&)>& is_it) {
  std::vector<std::filesystem::path> paths;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/dev", ignored))
    if (gpiod_is_gpiochip_device(entry.path().c_str())) paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end(), [](const auto& a, const auto& b) {
    return std::pair(a.native().size(), a.native()) < std::pair(b.native().size(), b.native());
  });
  for (const auto& path : paths) {
    Chip chip(gpiod_chip_open(path.c_str()));
    if (chip && is_it(chip)) return;
  }
}

/// By name, path, number or label, as version 1 does.
Chip open_chip(const std::string& name) {
  const bool is_number = std::all_of(name.begin(), name.end(), [](char c) { return c >= '0' && c <= '9'; });
  const std::string path = name.front() == '/' ? name : (is_number ? "/dev/gpiochip" : "/dev/") + name;
  errno = 0;
  Chip chip(gpiod_is_gpiochip_device(path.c_str()) ? gpiod_chip_open(path.c_str()) : nullptr);
  if (chip || errno == EACCES) return chip;
  ask_chips([&](Chip& one) {
    const ChipInfo info(gpiod_chip_get_info(one.get()));
    if (!info || name != gpiod_chip_info_get_label(info.get())) return false;
    chip = std::move(one);
    return true;
  });
  if (!chip) errno = ENOENT;
  return chip;
}

/// The line, not yet requested; null and `why` if there is none.
LineHandle* find(const std::string& name, std::string& why) {
  LineName wanted;
  if (!parse(name, wanted, why)) return nullptr;
  auto found = std::make_unique<LineHandle>();
  if (wanted.chip.empty()) {
    ask_chips([&](Chip& chip) {
      const int offset = gpiod_chip_get_line_offset_from_name(chip.get(), name.c_str());
      if (offset < 0) return false;
      found->chip = std::move(chip);
      found->offset = static_cast<unsigned>(offset);
      return true;
    });
    if (found->chip) return found.release();
    why = fmt::format("line '{}': no chip has a line of this name (roborun gpio list)", name);
    return nullptr;
  }
  found->chip = open_chip(wanted.chip);
  if (!found->chip) {
    why = fmt::format("line '{}': chip cannot be opened: {}", name, std::strerror(errno));
    return nullptr;
  }
  found->offset = wanted.offset;
  if (Info(gpiod_chip_get_line_info(found->chip.get(), wanted.offset))) return found.release();
  why = fmt::format("line '{}': the chip has no line {}", name, wanted.offset);
  return nullptr;
}

/// All that the kernel holds; the first 16 of it are kept. kNotReady: nothing.
Status take_waiting(LineHandle& line) noexcept {
  line.at = line.count = 0;
  for (std::size_t i = 0; i < kHeldByKernel / kReadAtOnce; ++i) {
    const int count = gpiod_line_request_read_edge_events(line.request.get(), line.edges.get(), kReadAtOnce);
    if (count < 0 && errno != EAGAIN && errno != EINTR) return Status::kIo;
    for (int k = 0; k < count && line.count < line.waiting.size(); ++k) {
      gpiod_edge_event* event =
          gpiod_edge_event_buffer_get_event(line.edges.get(), static_cast<unsigned long>(k));
      line.waiting[line.count++] = {
          MonotonicTime{Nanos{static_cast<std::int64_t>(gpiod_edge_event_get_timestamp_ns(event))}},
          gpiod_edge_event_get_event_type(event) == GPIOD_EDGE_EVENT_RISING_EDGE};
    }
    if (count < static_cast<int>(kReadAtOnce)) break;
  }
  return line.count > 0 ? Status::kOk : Status::kNotReady;
}

/// Empty: it is ours.
std::string request(LineHandle& line, const LineConfig& config, gpiod_line_settings& how) {
  gpiod_line_settings_set_active_low(&how, config.active_low);
  if (config.bias != firmware_if::GpioBias::kNone)
    (void)gpiod_line_settings_set_bias(&how, config.bias == firmware_if::GpioBias::kPullUp
                                                 ? GPIOD_LINE_BIAS_PULL_UP
                                                 : GPIOD_LINE_BIAS_PULL_DOWN);
  const Lines lines(gpiod_line_config_new());
  const Wanted wanted(gpiod_request_config_new());
  if (!lines || !wanted || gpiod_line_config_add_line_settings(lines.get(), &line.offset, 1, &how) != 0)
    return fmt::format("line '{}': {}", config.name, std::strerror(errno));
  gpiod_request_config_set_consumer(wanted.get(), kConsumer);
  gpiod_request_config_set_event_buffer_size(wanted.get(), kHeldByKernel);
  line.request.reset(gpiod_chip_request_lines(line.chip.get(), wanted.get(), lines.get()));
  if (line.request) return {};
  const int error = errno;
  if (error != EBUSY) return fmt::format("line '{}': {}", config.name, std::strerror(error));
  const Info info(gpiod_chip_get_line_info(line.chip.get(), line.offset));
  const char* consumer = info ? gpiod_line_info_get_consumer(info.get()) : nullptr;
  return fmt::format("line '{}': busy, used by '{}'", config.name,
                     consumer == nullptr ? "unknown" : consumer);
}

}  // namespace

std::vector<LineInfo> list_lines() {
  std::vector<LineInfo> out;
  ask_chips([&out](Chip& chip) {
    const ChipInfo about(gpiod_chip_get_info(chip.get()));
    for (unsigned i = 0; about && i < gpiod_chip_info_get_num_lines(about.get()); ++i) {
      const Info line(gpiod_chip_get_line_info(chip.get(), i));
      if (!line) continue;
      const char* consumer = gpiod_line_info_get_consumer(line.get());
      const bool used = gpiod_line_info_is_used(line.get());
      out.push_back({gpiod_chip_info_get_name(about.get()), i,
                     text_or_empty(gpiod_line_info_get_name(line.get())),
                     consumer != nullptr ? consumer : (used ? "kernel" : ""),
                     gpiod_line_info_get_direction(line.get()) == GPIOD_LINE_DIRECTION_OUTPUT});
    }
    return false;
  });
  return out;
}

GpiodInput::~GpiodInput() { release(line_); }

std::string GpiodInput::open(const LineConfig& config) {
  release(line_);
  std::string why;
  line_ = find(config.name, why);
  if (line_ == nullptr) return why;
  const Settings how(gpiod_line_settings_new());
  (void)gpiod_line_settings_set_direction(how.get(), GPIOD_LINE_DIRECTION_INPUT);
  (void)gpiod_line_settings_set_edge_detection(how.get(), GPIOD_LINE_EDGE_BOTH);
  why = request(*line_, config, *how);
  if (why.empty()) {
    line_->edges.reset(gpiod_edge_event_buffer_new(kReadAtOnce));
    edges_ = gpiod_line_request_get_fd(line_->request.get());
    if (!line_->edges ||
        fcntl(edges_, F_SETFL, O_NONBLOCK) != 0)  // NOLINT(cppcoreguidelines-pro-type-vararg): POSIX
      why = fmt::format("line '{}': {}", config.name, std::strerror(errno));
  }
  if (!why.empty()) release(line_);
  return why;
}

Result<bool> GpiodInput::active() noexcept {
  if (line_ == nullptr) return Status::kIo;
  const gpiod_line_value value = gpiod_line_request_get_value(line_->request.get(), line_->offset);
  if (value == GPIOD_LINE_VALUE_ERROR) return Status::kIo;
  return value == GPIOD_LINE_VALUE_ACTIVE;
}

Status GpiodInput::next_edge(firmware_if::GpioEdge& edge) noexcept {
  if (line_ == nullptr) return Status::kIo;
  if (line_->at == line_->count) {
    if (const Status status = take_waiting(*line_); status != Status::kOk) return status;
  }
  edge = line_->waiting[line_->at++];
  return Status::kOk;
}

GpiodOutput::~GpiodOutput() {
  if (line_ != nullptr)
    (void)gpiod_line_request_set_value(line_->request.get(), line_->offset, GPIOD_LINE_VALUE_INACTIVE);
  release(line_);
}

std::string GpiodOutput::open(const LineConfig& config) {
  release(line_);
  std::string why;
  line_ = find(config.name, why);
  if (line_ == nullptr) return why;
  const Settings how(gpiod_line_settings_new());
  (void)gpiod_line_settings_set_direction(how.get(), GPIOD_LINE_DIRECTION_OUTPUT);
  (void)gpiod_line_settings_set_output_value(how.get(), GPIOD_LINE_VALUE_INACTIVE);
  why = request(*line_, config, *how);
  if (!why.empty()) release(line_);
  return why;
}

Status GpiodOutput::set(bool active) noexcept {
  if (line_ == nullptr) return Status::kIo;
  const gpiod_line_value value = active ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE;
  return gpiod_line_request_set_value(line_->request.get(), line_->offset, value) == 0 ? Status::kOk
                                                                                       : Status::kIo;
}

}  // namespace roborun::gpio
