/// Text of a JSON object, written key by key: quicker and shorter than a tree of values for what is logged all the time.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <string>
#include <string_view>

namespace roborun::log {

/// `text` as a JSON string, quotes included. Bytes that are no ASCII become a question mark: our own texts have none.
inline void append_json_string(fmt::memory_buffer& to, std::string_view text) {
  to.push_back('"');
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\')
      fmt::format_to(std::back_inserter(to), "\\{}", c);
    else if (byte < 0x20)
      fmt::format_to(std::back_inserter(to), "\\u{:04x}", byte);
    else
      to.push_back(byte < 0x80 ? c : '?');
  }
  to.push_back('"');
}

class JsonText {
 public:
  JsonText() { buffer_.push_back('{'); }
  /// null if it is not finite; without zeros at its end.
  JsonText& number(std::string_view key, double value, int decimals = 4) {
    begin(key);
    if (!std::isfinite(value)) return raw("null");
    const std::size_t before = buffer_.size();
    fmt::format_to(std::back_inserter(buffer_), "{:.{}f}", value, decimals);
    std::size_t size = buffer_.size();
    while (decimals > 0 && size > before + 1 && buffer_[size - 1] == '0') --size;
    if (decimals > 0 && buffer_[size - 1] == '.') --size;
    buffer_.resize(size);
    return *this;
  }
  JsonText& text(std::string_view key, std::string_view value) {
    begin(key);
    append_json_string(buffer_, value);
    return *this;
  }
  /// `value` is JSON.
  JsonText& json(std::string_view key, std::string_view value) {
    begin(key);
    return raw(value);
  }
  /// {"x":..,"y":..,"z":..}
  template <typename Numbers>
  JsonText& vector(std::string_view key, const Numbers& v) {
    JsonText inner;
    inner.number("x", v[0]).number("y", v[1]).number("z", v[2]);
    return json(key, inner.done());
  }
  /// `timestamp` as Foxglove has it.
  JsonText& stamp(std::int64_t time_ns) {
    constexpr std::int64_t kSecond_ns = 1'000'000'000;
    return json("timestamp",
                fmt::format(R"({{"sec":{},"nsec":{}}})", time_ns / kSecond_ns, time_ns % kSecond_ns));
  }
  [[nodiscard]] std::string_view done() {
    buffer_.push_back('}');
    return {buffer_.data(), buffer_.size()};
  }

 private:
  void begin(std::string_view key) {
    if (buffer_.size() > 1) buffer_.push_back(',');
    append_json_string(buffer_, key);
    buffer_.push_back(':');
  }
  JsonText& raw(std::string_view json) {
    buffer_.append(json.data(), json.data() + json.size());
    return *this;
  }
  fmt::memory_buffer buffer_;
};

}  // namespace roborun::log
