/// Digital lines of the Linux kernel, through libgpiod: gpiod_line.cpp for version 1.6, gpiod_line_v2.cpp for version 2.
#pragma once

#include <string>
#include <vector>

#include "firmware_if/gpio.hpp"

namespace roborun::gpio {

/// Which line, and how it is wired. A line goes by the name that the device tree gives it, or by CHIP:OFFSET.
struct LineConfig {
  std::string name;
  bool active_low{false};
  firmware_if::GpioBias bias{firmware_if::GpioBias::kNone};
};

struct LineInfo {
  std::string chip;
  unsigned offset{};
  std::string name;      ///< Empty: unnamed.
  std::string consumer;  ///< Empty: free.
  bool output{};
};
/// All lines of all chips that we may open.
[[nodiscard]] std::vector<LineInfo> list_lines();

struct LineHandle;  ///< The library's line and its chip.

class GpiodInput final : public firmware_if::GpioInput {
 public:
  GpiodInput() = default;
  ~GpiodInput() override;
  GpiodInput(const GpiodInput&) = delete;
  GpiodInput& operator=(const GpiodInput&) = delete;

  /// Empty: requested, as consumer "roborun". Otherwise what is wrong, by name, in one line: not there, busy
  /// (and by whom), not permitted. Not for the loop.
  [[nodiscard]] std::string open(const LineConfig& config);
  [[nodiscard]] Result<bool> active() noexcept override;
  [[nodiscard]] Status next_edge(firmware_if::GpioEdge& edge) noexcept override;

 private:
  LineHandle* line_{nullptr};
  int edges_{-1};
};

class GpiodOutput final : public firmware_if::GpioOutput {
 public:
  GpiodOutput() = default;
  /// Leaves the line inactive; if the process dies without it, what the kernel and the wiring do with a
  /// released line decides: wire it so that released is safe.
  ~GpiodOutput() override;
  GpiodOutput(const GpiodOutput&) = delete;
  GpiodOutput& operator=(const GpiodOutput&) = delete;

  /// As GpiodInput::open(). The line starts inactive.
  [[nodiscard]] std::string open(const LineConfig& config);
  [[nodiscard]] Status set(bool active) noexcept override;

 private:
  LineHandle* line_{nullptr};
};

}  // namespace roborun::gpio
