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
/// Of a call with words of 32 bits, before its runs.
constexpr char kBits = 0, kThousandths = 1;
/// What a run is of, before its length.
enum class Run : char { kNumbers, kOpen, kLost };
constexpr unsigned kMostBitsAtOnce = 32;

Run run_of(std::uint64_t word) {
  return word == kNothing ? Run::kOpen : word == kInvalid ? Run::kLost : Run::kNumbers;
}

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

template <typename Word>
std::uint64_t load(std::string_view words, std::size_t i) {
  Word word{};
  std::memcpy(&word, words.data() + sizeof word * i, sizeof word);
  return word;
}
std::uint64_t word_at(std::string_view words, std::size_t bytes, std::size_t i) {
  if (bytes == 4) return load<std::uint32_t>(words, i);
  return bytes == 8 ? load<std::uint64_t>(words, i) : load<std::uint16_t>(words, i);
}

/// Words of 32 bits with a count in place of each number; none if one of them is not whole.
std::optional<std::string> as_thousandths(std::string_view words) {
  std::string counts(words);
  for (std::size_t i = 0; i < words.size() / 4; ++i) {
    const std::uint64_t word = word_at(words, 4, i);
    if (run_of(word) != Run::kNumbers) continue;
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

/// Numbers as a Golomb-Rice code whose parameter is the mean width of those before, which a few large ones hardly move: the
/// quotient as ones and a zero, then the lowest bits. After `kMostOnes` ones a number is written with its width.
class RiceCode {
 public:
  void put(PutBits& to, std::uint64_t number) {
    const unsigned low = bits_below();
    if (const std::uint64_t quotient = number >> low; quotient < kMostOnes) {
      to.put((std::uint64_t{1} << quotient) - 1, static_cast<unsigned>(quotient) + 1);
      to.put(number, low);
    } else {
      const auto width = static_cast<unsigned>(std::bit_width(number));
      to.put((std::uint64_t{1} << kMostOnes) - 1, kMostOnes);
      to.put(width - 1, kWidthBits);
      to.put(number, width - 1);  // below the highest one
    }
    count(number);
  }
  [[nodiscard]] std::uint64_t get(GetBits& from) {
    const unsigned low = bits_below();
    unsigned quotient = 0;
    while (quotient < kMostOnes && from.get(1) == 1) ++quotient;
    std::uint64_t number = std::uint64_t{quotient} << low;
    if (quotient < kMostOnes) {
      number |= from.get(low);
    } else {
      const auto below = static_cast<unsigned>(from.get(kWidthBits));
      number = std::uint64_t{1} << below | from.get(below);
    }
    count(number);
    return number;
  }

 private:
  static constexpr unsigned kMostOnes = 8, kWidthBits = 6;
  static constexpr unsigned kWeight = 8;  ///< Numbers that the mean is of, about.

  [[nodiscard]] unsigned bits_below() const { return std::min(widths_ / kWeight, 63U); }
  void count(std::uint64_t number) {
    const auto width = static_cast<unsigned>(std::bit_width(number));
    widths_ = widths_ == 0 ? kWeight * width : widths_ - widths_ / kWeight + width;
  }
  unsigned widths_{0};  ///< kWeight times the mean.
};

/// Numbers of one meaning.
class Column {
 public:
  void put(PutBits& to, const Folding& folding, std::uint64_t word, std::optional<std::uint64_t> guess) {
    if (begun_)
      code_.put(to, folding.fold(folding.cut(word - guess.value_or(last_))));
    else
      to.put(word, 64 - folding.shift);
    begun_ = true;
    last_ = word;
  }
  [[nodiscard]] std::uint64_t get(GetBits& from, const Folding& folding, std::optional<std::uint64_t> guess) {
    last_ = begun_ ? folding.cut(guess.value_or(last_) + folding.unfold(code_.get(from)))
                   : from.get(64 - folding.shift);
    begun_ = true;
    return last_;
  }

 private:
  RiceCode code_;
  std::uint64_t last_{0};
  bool begun_{false};
};

/// From the numbers above a word of an image and to its left. `words` holds those before it, counts in place of depths.
std::optional<std::uint64_t> guess_of(std::string_view words, const WordLayout& layout, std::size_t i) {
  if (layout.row == 0 || i < layout.row) return {};
  const std::uint64_t above = word_at(words, layout.bytes, i - layout.row);
  if (run_of(above) != Run::kNumbers) return {};
  const std::uint64_t left = word_at(words, layout.bytes, i - 1);
  if (i % layout.row == 0 || run_of(left) != Run::kNumbers) return above;
  return (above + left) / 2;
}

void append_runs(std::string& to, std::string_view words) {
  for (std::size_t i = 0; i < words.size() / 4;) {
    const Run run = run_of(word_at(words, 4, i));
    std::size_t length = 1;
    while (i + length < words.size() / 4 && run_of(word_at(words, 4, i + length)) == run) ++length;
    i += length;
    to += static_cast<char>(run);
    for (; length > 0x7F; length >>= 7U) to += static_cast<char>(length | 0x80U);
    to += static_cast<char>(length);
  }
}

/// Takes a run of at most `most` words from the front of `runs`.
std::pair<Run, std::size_t> take_run(std::string_view& runs, std::size_t most) {
  if (runs.empty() || static_cast<std::uint8_t>(runs.front()) > static_cast<std::uint8_t>(Run::kLost))
    throw InputError("no run of words");
  const auto run = static_cast<Run>(runs.front());
  std::size_t length = 0, at = 1;
  for (unsigned shift = 0;; shift += 7) {
    if (at == runs.size() || shift > 28) throw InputError("a run of words without an end");
    const auto byte = static_cast<std::uint8_t>(runs[at++]);
    length |= std::size_t{byte & 0x7FU} << shift;
    if (byte < 0x80U) break;
  }
  if (length == 0 || length > most) throw InputError("a run of another length than its words");
  runs.remove_prefix(at);
  return {run, length};
}

}  // namespace

void append_coded_words(std::string& runs, std::string& bits, std::string_view words,
                        const WordLayout& layout) {
  ROBORUN_ASSERT(words.size() % layout.bytes == 0 && layout.stride > 0);
  if (words.empty()) return;
  const bool may_be_none = layout.bytes == 4;
  const std::optional<std::string> counts = may_be_none ? as_thousandths(words) : std::nullopt;
  if (counts) words = *counts;
  if (may_be_none) {
    runs += counts ? kThousandths : kBits;
    append_runs(runs, words);
  }
  const Folding folding(layout.bytes);
  std::vector<Column> columns(layout.stride);
  PutBits put(bits);
  for (std::size_t i = 0; i < words.size() / layout.bytes; ++i) {
    const std::uint64_t word = word_at(words, layout.bytes, i);
    if (may_be_none && run_of(word) != Run::kNumbers) continue;
    columns[i % layout.stride].put(put, folding, word, guess_of(words, layout, i));
  }
  put.end();
}

void append_decoded_words(std::string& to, std::size_t count, const WordLayout& layout,
                          std::string_view& runs, std::string_view& bits) {
  ROBORUN_ASSERT(layout.stride > 0);
  if (count == 0) return;
  const bool may_be_none = layout.bytes == 4;
  char form = kBits;
  if (may_be_none) {
    if (runs.empty() || (runs.front() != kBits && runs.front() != kThousandths))
      throw InputError("no form of words");
    form = runs.front();
    runs.remove_prefix(1);
  }
  const Folding folding(layout.bytes);
  const std::size_t begin = to.size();
  to.resize(begin + layout.bytes * count);
  char* const words = to.data() + begin;
  const std::string_view written(words, layout.bytes * count);
  std::vector<Column> columns(layout.stride);
  GetBits get(bits);
  for (std::size_t i = 0; i < count;) {
    const auto [run, length] = may_be_none ? take_run(runs, count - i) : std::pair(Run::kNumbers, count);
    const std::size_t end = i + length;
    if (run == Run::kNumbers) {
      for (; i < end; ++i) {
        const std::uint64_t word = columns[i % layout.stride].get(get, folding, guess_of(written, layout, i));
        std::memcpy(words + layout.bytes * i, &word, layout.bytes);
      }
    } else {
      const auto none = static_cast<std::uint32_t>(run == Run::kOpen ? kNothing : kInvalid);
      for (; i < end; ++i) std::memcpy(words + sizeof none * i, &none, sizeof none);
    }
  }
  bits.remove_prefix(get.taken());
  if (form == kBits) return;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t word = word_at(written, 4, i);
    if (run_of(word) != Run::kNumbers) continue;
    const std::uint32_t depth = word_of_thousandths(static_cast<std::uint32_t>(word));
    std::memcpy(words + sizeof depth * i, &depth, sizeof depth);
  }
}

}  // namespace roborun::log
