/// What every fuzz target needs: choices out of bytes, what must hold, and a file for readers that take a path.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include "platform/input/input_error.hpp"
#include "tests/support/scratch.hpp"

/// The target of a program: returns 0, or ends the process. libFuzzer calls it (toolchain/fuzz), or replay_main.cpp.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace roborun::fuzz {

/// Ends the process with a line where what must hold does not.
inline void require(bool holds, const char* what) {
  if (holds) return;
  (void)std::fprintf(stderr, "fuzz: does not hold: %s\n", what);
  std::abort();
}

/// Calls a reader, which may refuse with one line and nothing else.
template <typename Read>
void refuse_or(const Read& read) {
  try {
    read();
  } catch (const InputError& error) {
    require(std::string_view(error.what()).find('\n') == std::string_view::npos, "a refusal is one line");
  }
}

/// The bytes of a fuzzer, taken from the front. Behind their end everything is 0.
class Choices {
 public:
  Choices(const std::uint8_t* data, std::size_t size) : rest_(data, size) {}

  [[nodiscard]] bool empty() const { return rest_.empty(); }
  template <typename T>
  [[nodiscard]] T number() {
    static_assert(std::is_trivially_copyable_v<T>);
    T value{};
    const auto bytes = take(sizeof value);
    if (!bytes.empty()) std::memcpy(&value, bytes.data(), bytes.size());
    return value;
  }
  [[nodiscard]] std::uint8_t byte() { return number<std::uint8_t>(); }
  [[nodiscard]] std::span<const std::uint8_t> take(std::size_t most) {
    const auto taken = rest_.first(std::min(most, rest_.size()));
    rest_ = rest_.subspan(taken.size());
    return taken;
  }
  [[nodiscard]] std::span<const std::uint8_t> rest() { return take(rest_.size()); }
  [[nodiscard]] std::string text() {
    const auto bytes = rest();
    return {bytes.begin(), bytes.end()};
  }

 private:
  std::span<const std::uint8_t> rest_;
};

/// A scratch file with these bytes.
inline std::string file(const std::string& name, std::span<const std::uint8_t> bytes) {
  return test::scratch_file(name, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace roborun::fuzz
