#include "platform/can/candump.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdint>

namespace roborun::can {
namespace {

constexpr std::uint32_t kErrorFlag = 0x20000000;

template <typename T>
bool parse_all(std::string_view text, T& value, int base = 10) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  return !text.empty() && error == std::errc{} && end == text.data() + text.size();
}

std::string_view next_word(std::string_view& line) {
  line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
  const std::string_view word = line.substr(0, line.find_first_of(" \t"));
  line.remove_prefix(word.size());
  return word;
}

bool parse_stamp(std::string_view word, MonotonicTime& stamp) {
  if (word.size() < 3 || word.front() != '(' || word.back() != ')') return false;
  word = word.substr(1, word.size() - 2);
  const std::size_t dot = word.find('.');
  std::uint32_t whole_s = 0;
  if (!parse_all(word.substr(0, dot), whole_s)) return false;
  std::uint64_t nanos = 0;
  if (dot != std::string_view::npos) {
    const std::string fraction = fmt::format("{:0<9}", word.substr(dot + 1));
    if (fraction.size() != 9 || !parse_all(std::string_view(fraction), nanos)) return false;
  }
  stamp = MonotonicTime{Nanos{std::int64_t{whole_s} * 1'000'000'000 + static_cast<std::int64_t>(nanos)}};
  return true;
}

}  // namespace

std::optional<LogLine> parse_log_line(std::string_view line) {
  while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
  LogLine out;
  if (!parse_stamp(next_word(line), out.frame.stamp)) return std::nullopt;
  out.interface = next_word(line);
  const std::string_view frame = next_word(line);
  const std::string_view direction = next_word(line);
  const std::size_t hash = frame.find('#');
  if (hash == std::string_view::npos || !(direction.empty() || direction == "R" || direction == "T"))
    return std::nullopt;
  if (!parse_all(frame.substr(0, hash), out.frame.id, 16)) return std::nullopt;
  const std::string_view data = frame.substr(hash + 1);
  out.data_frame =
      hash == 8 && (out.frame.id & ~0x1fffffffU) == 0 && !data.starts_with('R') && !data.starts_with('#');
  if (!out.data_frame) {
    const bool known = hash == 3 || data.starts_with('R') || data.starts_with('#') ||
                       (hash == 8 && (out.frame.id & kErrorFlag) != 0);
    return known ? std::optional(out) : std::nullopt;
  }
  if (data.size() % 2 != 0 || data.size() > 16) return std::nullopt;
  out.frame.size = static_cast<std::uint8_t>(data.size() / 2);
  for (std::size_t i = 0; i < out.frame.size; ++i) {
    if (!parse_all(data.substr(2 * i, 2), out.frame.data.at(i), 16)) return std::nullopt;
  }
  return out;
}

std::string format_log_line(const LogLine& line) {
  const std::int64_t micros = line.frame.stamp.time_since_epoch().count() / 1000;
  std::string text = fmt::format("({}.{:06}) {} {:08X}#", micros / 1'000'000, micros % 1'000'000,
                                 line.interface, line.frame.id);
  for (const std::uint8_t byte : line.frame.bytes()) text += fmt::format("{:02X}", byte);
  return text;
}

}  // namespace roborun::can
