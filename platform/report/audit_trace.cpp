#include <fmt/format.h>

#include "core/executive/frame_table.hpp"
#include "platform/report/audit_report.hpp"

namespace roborun::report {

std::string perfetto_trace(const AuditReport& r) {
  std::string text = "{\"traceEvents\":[\n";
  for (std::size_t i = 0; i < core::kLaneCount; ++i)
    text += fmt::format(
        "{{\"name\":\"thread_name\",\"ph\":\"M\",\"pid\":1,\"tid\":{},\"args\":{{\"name\":\"{}\"}}}},\n",
        i + 1, core::kLanes[i].name);
  for (const AuditTraceEvent& e : r.trace) {
    const core::SlotSpec& spec = core::kFrameTable[e.slot];
    text += fmt::format(
        "{{\"name\":\"{}\",\"ph\":\"X\",\"pid\":1,\"tid\":{},\"ts\":{:.3f},\"dur\":{:.3f},\"args\":{{"
        "\"frame\":{},"
        "\"overrun\":{}}}}},\n",
        spec.name, static_cast<std::size_t>(spec.lane) + 1, e.begin_us, e.spent_us, e.frame, e.overrun);
  }
  text +=
      "{\"name\":\"process_name\",\"ph\":\"M\",\"pid\":1,\"args\":{\"name\":\"roborun\"}}\n],"
      "\"displayTimeUnit\":\"ns\"}\n";
  return text;
}

}  // namespace roborun::report
