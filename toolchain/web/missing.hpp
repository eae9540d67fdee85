/// What the tree uses of the standard library and Debian's Emscripten (libc++ 13) does not have: included before each source.
#pragma once

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <iterator>
#include <string>
#include <type_traits>

namespace std {

template <typename To, typename From>
[[nodiscard]] constexpr To bit_cast(const From& from) noexcept {
  static_assert(sizeof(To) == sizeof(From) && is_trivially_copyable_v<To> && is_trivially_copyable_v<From>);
  return __builtin_bit_cast(To, from);
}

namespace ranges {

template <typename Range, typename Is>
[[nodiscard]] constexpr bool all_of(Range&& range, Is is) {
  return std::all_of(std::begin(range), std::end(range), is);
}
template <typename Range, typename Is>
[[nodiscard]] constexpr auto find_if(Range&& range, Is is) {
  return std::find_if(std::begin(range), std::end(range), is);
}
template <typename Range, typename Is>
[[nodiscard]] constexpr auto count_if(Range&& range, Is is) {
  return std::count_if(std::begin(range), std::end(range), is);
}
template <typename Range, typename Out>
constexpr void copy(Range&& range, Out out) {
  std::copy(std::begin(range), std::end(range), out);
}
template <typename A, typename B>
[[nodiscard]] constexpr bool equal(A&& a, B&& b) {
  return std::equal(std::begin(a), std::end(a), std::begin(b), std::end(b));
}

}  // namespace ranges

/// Of strtod's numbers those that from_chars takes: no space or sign before them, no hexadecimal ones.
inline from_chars_result from_chars(const char* first, const char* last, double& value) {
  const string text(first, std::find_if(first, last, [](char c) { return c == 'x' || c == 'X'; }));
  const bool begins =
      !text.empty() && text.front() != '+' && isspace(static_cast<unsigned char>(text.front())) == 0;
  char* end = nullptr;
  errno = 0;
  const double read = begins ? strtod(text.c_str(), &end) : 0.0;
  if (!begins || end == text.c_str()) return {first, errc::invalid_argument};
  const char* const after = first + (end - text.c_str());
  if (errno == ERANGE) return {after, errc::result_out_of_range};
  value = read;
  return {after, errc{}};
}

}  // namespace std
