#include "platform/log/word_coding.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <vector>

#include "firmware_if/assert.hpp"
#include "platform/input/input_error.hpp"

namespace roborun::log {
namespace {

// Of words of 32 bits, which are floats.
constexpr std::uint64_t kNothing = 0x7F800000U;  // +infinity: what most of an image of the open air is
constexpr std::uint64_t kInvalid = 0x7FC00000U;  // the usual NaN: a lost pixel
/// Of a call with words of 32 bits, before its widths.
constexpr char kBits = 0, kThousandths = 1;
/// Widths 0 to 64 are of differences.
constexpr std::uint8_t kWidthOfNothing = 65, kWidthOfInvalid = 66;
constexpr unsigned kMostBitsAtOnce = 32;

bool is_number(std::uint64_t word) { return word != kNothing && word != kInvalid; }

/// As sensor ports read a depth in millimetres, to the bit.
std::uint32_t word_of_thousandths(std::uint32_t count) {
  return std::bit_cast<std::uint32_t>(static_cast<float>(count) * 0.001F);
}
std::optional<std::uint32_t> thousandths_of(std::uint32_t word) {
  constexpr float kMost = 16'000.0F;  // above it not every thousandth is a float of its own
  const auto value = std::bit_cast<float>(word);
  if (!(value >= 0.0F && value < kMost)) return {};
  const auto count = static_cast<std::uint32_t>(std::lround(1000.0 * static_cast<double>(value)));
  return word_of_thousandths(count) == word ? std::optional(count) : std::nullopt;
}

std::uint64_t word_at(std::string_view words, std::size_t bytes, std::size_t i) {
  std::uint64_t word = 0;
  std::memcpy(&word, words.data() + bytes * i, bytes);
  return word;
}

/// Words of 32 bits with a count in place of each number; none if one of them is not whole.
std::optional<std::string> as_thousandths(std::string_view words) {
  std::string counts(words);
  for (std::size_t i = 0; i < words.size() / 4; ++i) {
    const std::uint64_t word = word_at(words, 4, i);
    if (!is_number(word)) continue;
    const std::optional<std::uint32_t> count = thousandths_of(static_cast<std::uint32_t>(word));
    if (!count) return {};
    std::memcpy(counts.data() + 4 * i, &*count, 4);
  }
  return counts;
}

/// Arithmetic on words of 16, 32 or 64 bits.
struct Folding {
  explicit Folding(std::size_t bytes) : shift(64 - 8 * static_cast<unsigned>(bytes)) {}
  unsigned shift;  ///< Bits of a word of 64 bits that are not in use.
  [[nodiscard]] std::uint64_t cut(std::uint64_t word) const { return word << shift >> shift; }
  /// Small differences of either sign become small numbers.
  [[nodiscard]] std::uint64_t fold(std::uint64_t difference) const {
    const std::uint64_t high = difference << shift;
    return cut(difference << 1U) ^ cut(0U - (high >> 63U));
  }
  [[nodiscard]] std::uint64_t unfold(std::uint64_t number) const {
    return (number >> 1U) ^ cut(0U - (number & 1U));
  }
};

/// Bits of a number below its highest one, which its width says already.
constexpr unsigned bits_below(unsigned width) { return width > 1 ? width - 1 : 0; }

class PutBits {
 public:
  explicit PutBits(std::string& to) : to_(to) {}
  /// The lowest bits of a number.
  void put(std::uint64_t number, unsigned bits) {
    while (bits > 0) {
      const unsigned now = std::min(bits, kMostBitsAtOnce);
      pending_ |= (number & ((std::uint64_t{1} << now) - 1)) << used_;
      for (used_ += now; used_ >= 8; used_ -= 8, pending_ >>= 8U) to_ += static_cast<char>(pending_);
      number >>= now;
      bits -= now;
    }
  }
  void end() {
    if (used_ > 0) to_ += static_cast<char>(pending_);
  }

 private:
  std::string& to_;
  std::uint64_t pending_{0};
  unsigned used_{0};
};

class GetBits {
 public:
  explicit GetBits(std::string_view from) : from_(from) {}
  [[nodiscard]] std::uint64_t get(unsigned bits) {
    std::uint64_t number = 0;
    for (unsigned done = 0; done < bits;) {
      const unsigned now = std::min(bits - done, kMostBitsAtOnce);
      for (; held_ < now; held_ += 8) {
        if (taken_ == from_.size()) throw InputError("fewer bits than words");
        pending_ |= std::uint64_t{static_cast<std::uint8_t>(from_[taken_++])} << held_;
      }
      number |= (pending_ & ((std::uint64_t{1} << now) - 1)) << done;
      pending_ >>= now;
      held_ -= now;
      done += now;
    }
    return number;
  }
  [[nodiscard]] std::size_t taken() const { return taken_; }

 private:
  std::string_view from_;
  std::size_t taken_{0};
  std::uint64_t pending_{0};
  unsigned held_{0};
};

}  // namespace

void append_coded_words(CodedWords& to, std::string_view words, const WordLayout& layout) {
  ROBORUN_ASSERT(words.size() % layout.bytes == 0 && layout.stride > 0);
  if (words.empty()) return;
  const Folding folding(layout.bytes);
  std::vector<std::uint64_t> before(layout.stride, 0);
  PutBits bits(to.bits);
  const std::optional<std::string> counts = layout.bytes == 4 ? as_thousandths(words) : std::nullopt;
  if (layout.bytes == 4) to.widths += counts ? kThousandths : kBits;
  if (counts) words = *counts;
  for (std::size_t i = 0; i < words.size() / layout.bytes; ++i) {
    const std::uint64_t word = word_at(words, layout.bytes, i);
    if (layout.bytes == 4 && !is_number(word)) {
      to.widths += static_cast<char>(word == kNothing ? kWidthOfNothing : kWidthOfInvalid);
      continue;
    }
    std::uint64_t& last = before[i % layout.stride];
    const std::uint64_t number = folding.fold(folding.cut(word - last));
    last = word;
    const auto width = static_cast<unsigned>(std::bit_width(number));
    to.widths += static_cast<char>(width);
    bits.put(number, bits_below(width));
  }
  bits.end();
}

void append_decoded_words(std::string& to, std::size_t count, const WordLayout& layout,
                          std::string_view& widths, std::string_view& bits) {
  ROBORUN_ASSERT(layout.stride > 0);
  if (count == 0) return;
  const std::size_t forms = layout.bytes == 4 ? 1 : 0;
  if (widths.size() < forms + count) throw InputError("fewer widths than words");
  const char form = forms > 0 ? widths.front() : kBits;
  if (form != kBits && form != kThousandths) throw InputError("no form of words");
  widths.remove_prefix(forms);
  const Folding folding(layout.bytes);
  const std::size_t begin = to.size();
  to.resize(begin + layout.bytes * count);
  std::vector<std::uint64_t> before(layout.stride, 0);
  GetBits get(bits);
  for (std::size_t i = 0; i < count; ++i) {
    const auto width = static_cast<std::uint8_t>(widths[i]);
    std::uint64_t word = width == kWidthOfNothing ? kNothing : kInvalid;
    if (width <= 8 * layout.bytes) {
      const std::uint64_t highest = width == 0 ? 0 : std::uint64_t{1} << bits_below(width);
      std::uint64_t& last = before[i % layout.stride];
      last = folding.cut(last + folding.unfold(highest | get.get(bits_below(width))));
      word = form == kThousandths ? word_of_thousandths(static_cast<std::uint32_t>(last)) : last;
    } else if (layout.bytes != 4 || width < kWidthOfNothing || width > kWidthOfInvalid) {
      throw InputError("no width of a word");
    }
    std::memcpy(to.data() + begin + layout.bytes * i, &word, layout.bytes);
  }
  widths.remove_prefix(count);
  bits.remove_prefix(get.taken());
}

}  // namespace roborun::log
