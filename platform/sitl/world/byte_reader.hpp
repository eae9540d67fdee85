/// Numbers and words out of bytes in memory, never past their end.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "platform/input/input_error.hpp"

namespace roborun::sitl {

/// A value at a place that the caller knows to be inside.
template <typename T>
[[nodiscard]] T value_at(std::span<const unsigned char> bytes, std::size_t at, bool swapped = false) {
  std::array<unsigned char, sizeof(T)> raw;
  std::memcpy(raw.data(), bytes.data() + at, sizeof(T));
  if (swapped) std::reverse(raw.begin(), raw.end());
  return std::bit_cast<T>(raw);
}

/// The whole word is a number; nothing otherwise. nan and inf are numbers.
template <typename T>
[[nodiscard]] std::optional<T> number_of(std::string_view word) {
  T value{};
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

/// Lines and words of text, with the line's number for complaints.
class WordReader {
 public:
  explicit WordReader(std::string_view text) : text_(text) {}
  WordReader(std::span<const unsigned char> bytes, std::size_t from)
      : text_(reinterpret_cast<const char*>(bytes.data()), bytes.size()), at_(from) {}

  /// Where the next line begins.
  [[nodiscard]] std::size_t at() const { return at_; }
  [[nodiscard]] std::size_t line_number() const { return line_number_; }
  /// The next line without its end; false after the last. Lines longer than a MiB are cut.
  [[nodiscard]] bool next_line(std::string_view& line) {
    if (at_ >= text_.size()) return false;
    std::size_t end = text_.find('\n', at_);
    if (end == std::string_view::npos) end = text_.size();
    line = text_.substr(at_, end - at_);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    at_ = end + 1;
    ++line_number_;
    return true;
  }
  /// The next word of the rest of the text, over lines; empty after the last.
  [[nodiscard]] std::string_view next_word() {
    while (at_ < text_.size() && is_space(text_[at_])) line_number_ += text_[at_++] == '\n' ? 1U : 0U;
    const std::size_t from = at_;
    while (at_ < text_.size() && !is_space(text_[at_])) ++at_;
    return text_.substr(from, at_ - from);
  }
  /// The first word of `line`, taken off it; empty if there is none.
  [[nodiscard]] static std::string_view take_word(std::string_view& line) {
    std::size_t from = 0;
    while (from < line.size() && is_space(line[from])) ++from;
    std::size_t end = from;
    while (end < line.size() && !is_space(line[end])) ++end;
    const std::string_view word = line.substr(from, end - from);
    line.remove_prefix(end);
    return word;
  }

 private:
  [[nodiscard]] static bool is_space(char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\v' || c == '\f';
  }

  std::string_view text_;
  std::size_t at_{0};
  std::size_t line_number_{0};
};

}  // namespace roborun::sitl
