/// The log format of can-utils: `(1436509052.249713) can0 1104067A#9D64C0`.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "firmware_if/can.hpp"

namespace roborun::can {

struct LogLine {
  std::string interface;
  firmware_if::CanFrame frame;  ///< stamp counts from the clock of the log.
  bool data_frame{};  ///< False: a standard (11-bit), remote, error or CAN FD frame: none of DroneCAN's.
};

/// Empty: not a line of such a log. A direction letter at the end is ignored.
[[nodiscard]] std::optional<LogLine> parse_log_line(std::string_view line);
[[nodiscard]] std::string format_log_line(const LogLine& line);

}  // namespace roborun::can
