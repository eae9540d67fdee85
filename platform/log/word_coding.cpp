#include "platform/log/word_coding.hpp"

#include <cstdint>
#include <cstring>
#include <vector>

#include "firmware_if/assert.hpp"

namespace roborun::log {
namespace {

constexpr std::uint32_t kNothing = 0x7F800000U;  // +infinity

/// Small differences of either sign become small numbers; 0 is left for kNothing.
constexpr std::uint32_t symbol_of(std::uint32_t word, std::uint32_t before) {
  const std::uint32_t difference = word - before;
  return ((difference << 1U) ^ (0U - (difference >> 31U))) + 1U;
}
constexpr std::uint32_t word_of(std::uint32_t symbol, std::uint32_t before) {
  const std::uint32_t folded = symbol - 1U;
  return before + ((folded >> 1U) ^ (0U - (folded & 1U)));
}

}  // namespace

void append_coded_words(std::string& to, std::string_view words, std::size_t stride) {
  ROBORUN_ASSERT(words.size() % 4 == 0 && stride > 0);
  const std::size_t count = words.size() / 4;
  const std::size_t begin = to.size();
  to.resize(begin + words.size());
  std::vector<std::uint32_t> before(stride, 0);
  for (std::size_t i = 0; i < count; ++i) {
    std::uint32_t word = 0;
    std::memcpy(&word, words.data() + 4 * i, 4);
    std::uint32_t& last = before[i % stride];
    std::uint32_t symbol = 0;
    if (word != kNothing) {
      symbol = symbol_of(word, last);
      // Of all differences one has no symbol left; that of kNothing is free, because kNothing is 0.
      if (symbol == 0) symbol = symbol_of(kNothing, last);
      last = word;
    }
    for (std::size_t plane = 0; plane < 4; ++plane)
      to[begin + plane * count + i] = static_cast<char>(symbol >> (8 * plane));
  }
}

void append_decoded_words(std::string& to, std::string_view coded, std::size_t stride) {
  ROBORUN_ASSERT(coded.size() % 4 == 0 && stride > 0);
  const std::size_t count = coded.size() / 4;
  const std::size_t begin = to.size();
  to.resize(begin + coded.size());
  std::vector<std::uint32_t> before(stride, 0);
  for (std::size_t i = 0; i < count; ++i) {
    std::uint32_t symbol = 0;
    for (std::size_t plane = 0; plane < 4; ++plane)
      symbol |= std::uint32_t{static_cast<std::uint8_t>(coded[plane * count + i])} << (8 * plane);
    std::uint32_t& last = before[i % stride];
    std::uint32_t word = kNothing;
    if (symbol != 0) {
      word = word_of(symbol, last);
      if (word == kNothing) word = last + 0x80000000U;
      last = word;
    }
    std::memcpy(to.data() + begin + 4 * i, &word, 4);
  }
}

}  // namespace roborun::log
