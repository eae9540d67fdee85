#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <tuple>

#include "core/executive/frame_table.hpp"
#include "platform/report/audit_report.hpp"

namespace roborun::report {
namespace {

std::int64_t ns(MonotonicTime time) { return time.time_since_epoch().count(); }

/// Microseconds with all digits: slices that touch must still touch.
std::string us(std::int64_t ns) { return fmt::format("{}.{:03}", ns / 1000, ns % 1000); }

}  // namespace

std::string perfetto_trace(const AuditReport& r) {
  std::string text = "{\"traceEvents\":[\n";
  for (std::size_t i = 0; i < core::kLaneCount; ++i)
    text += fmt::format(
        "{{\"name\":\"thread_name\",\"ph\":\"M\",\"pid\":1,\"tid\":{},\"args\":{{\"name\":\"{}\"}}}},\n",
        i + 1, core::kLanes[i].name);
  // A frame before its first piece, with which it begins: readers nest in the order of the file.
  std::vector<const core::TraceEvent*> in_order;
  in_order.reserve(r.trace.size());
  for (const core::TraceEvent& e : r.trace) in_order.push_back(&e);
  std::stable_sort(in_order.begin(), in_order.end(),
                   [](const core::TraceEvent* a, const core::TraceEvent* b) {
                     return std::make_tuple(a->begin, a->lane, !a->is_frame) <
                            std::make_tuple(b->begin, b->lane, !b->is_frame);
                   });
  for (const core::TraceEvent* const event : in_order) {
    const core::TraceEvent& e = *event;
    text += fmt::format(
        R"({{"name":"{}","ph":"X","pid":1,"tid":{},"ts":{},"dur":{},"args":{{"frame":{},"{}":{}{}}}}},)"
        "\n",
        e.is_frame ? "frame" : core::slot(e.slot).name, static_cast<std::size_t>(e.lane) + 1, us(ns(e.begin)),
        us((e.end - e.begin).count()), e.frame, e.is_frame ? "missed" : "overrun", e.overrun,
        e.is_frame ? fmt::format(R"(,"woken_late_us":{})",
                                 us(std::max<std::int64_t>((e.begin - e.release).count(), 0)))
                   : "");
  }
  text +=
      "{\"name\":\"process_name\",\"ph\":\"M\",\"pid\":1,\"args\":{\"name\":\"roborun\"}}\n],"
      "\"displayTimeUnit\":\"ns\"}\n";
  return text;
}

std::string sample_file(const AuditReport& r) {
  static_assert(std::endian::native == std::endian::little, "the format below says little-endian");
  constexpr std::size_t kRecord = 32;
  std::string head = fmt::format(
      "{{'descr': [('frame', '<u4'), ('lane', '|u1'), ('slot', '|u1'), ('overrun', '|u1'), ('reserved', "
      "'|u1'), "
      "('release_ns', '<i8'), ('begin_ns', '<i8'), ('end_ns', '<i8')], 'fortran_order': False, 'shape': "
      "({},), }}",
      r.trace.size());
  // Magic, version and length take 10 bytes; all of it ends with a line feed at a multiple of 64.
  head.resize((10 + head.size() + 1 + 63) / 64 * 64 - 10 - 1, ' ');
  head += '\n';
  std::string file("\x93NUMPY\x01\x00", 8);
  file += static_cast<char>(head.size() % 256);
  file += static_cast<char>(head.size() / 256);
  file += head;
  file.reserve(file.size() + kRecord * r.trace.size());
  const auto put = [&file](const auto& value) {
    file.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  for (const core::TraceEvent& e : r.trace) {
    put(e.frame);
    put(static_cast<std::uint8_t>(e.lane));
    put(static_cast<std::uint8_t>(e.is_frame ? 255U : static_cast<unsigned>(e.slot)));
    put(static_cast<std::uint8_t>(e.overrun ? 1 : 0));
    put(std::uint8_t{0});
    put(ns(e.release));
    put(ns(e.begin));
    put(ns(e.end));
  }
  return file;
}

}  // namespace roborun::report
