/// Words of an image, a cloud or a sample, coded without loss for any bits. Each is its difference from the word `stride` before
/// it that was a number: of its bits, or where all words of a call are whole thousandths, as the depths of cameras are, of
/// these. Of a difference the number of its bits goes into one text (few values, which zstd codes well) and the bits
/// themselves, which are mostly noise, into another one.
#pragma once

#include <string>
#include <string_view>

namespace roborun::log {

struct CodedWords {
  std::string widths;  ///< One byte per word; before those of 4 bytes one that says what was coded.
  std::string bits;    ///< Whole bytes per call.
};

/// Where in a record words are, and of which size.
struct WordLayout {
  std::size_t bytes;   ///< Of a word: 2, 4 or 8, in the byte order of the machine.
  std::size_t stride;  ///< Words from one to the next of the same meaning, > 0.
};

/// Precondition: `words` holds whole words.
void append_coded_words(CodedWords& to, std::string_view words, const WordLayout& layout);
/// The inverse for `count` words: takes what it reads from the front of `widths` and `bits`. Throws InputError where they end
/// early or hold no width.
void append_decoded_words(std::string& to, std::size_t count, const WordLayout& layout,
                          std::string_view& widths, std::string_view& bits);

}  // namespace roborun::log
