/// Lines of a candump log. Oracle: a data frame that is read, written and read again is the same, to the microsecond.
#include "platform/can/candump.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace roborun;
  const std::string text = fuzz::Choices(data, size).text();
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const auto line = can::parse_log_line(std::string_view(text).substr(at, end - at));
    at = end + 1;
    if (!line || !line->data_frame) continue;
    const std::string written = can::format_log_line(*line);
    const auto again = can::parse_log_line(written);
    fuzz::require(again && again->data_frame && again->interface == line->interface &&
                      again->frame.id == line->frame.id &&
                      std::ranges::equal(again->frame.bytes(), line->frame.bytes()),
                  "a frame is the same behind its line");
    const Nanos lost = line->frame.stamp - again->frame.stamp;
    fuzz::require(lost >= Nanos{0} && lost < Nanos{1000}, "a stamp loses less than a microsecond");
  }
  return 0;
}
