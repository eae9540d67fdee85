/// Whoever looks at a log while it is written.
#pragma once

#include <cstdint>
#include <string_view>

#include "platform/log/mcap_records.hpp"

namespace roborun::log {

/// Both are called by the thread that writes the log. show() neither throws nor waits for anybody.
class LogViewer {
 public:
  virtual ~LogViewer() = default;
  /// Once for each topic, before its first message.
  virtual void add(const Channel& channel, const Schema& schema) = 0;
  virtual void show(std::uint16_t channel, std::int64_t time_ns, std::string_view json) noexcept = 0;
};

}  // namespace roborun::log
