/// Words of an image, a cloud or a sample, coded without loss for any bits. A word is guessed from the number `stride` before it,
/// in an image from the mean of its neighbours to the left and above; the difference from the guess, of bits or where all words of a
/// call are whole thousandths, as the depths of cameras are, of these, goes into an adaptive Golomb-Rice code. What is no number
/// (the open air, lost pixels) comes in runs, which are coded apart.
#pragma once

#include <string>
#include <string_view>

namespace roborun::log {

/// Where in a record words are, and of which size.
struct WordLayout {
  std::size_t bytes;   ///< Of a word: 2, 4 or 8, in the byte order of the machine.
  std::size_t stride;  ///< Words from one to the next of the same meaning, > 0.
  std::size_t row{0};  ///< Words of a row of an image, 0: no image.
};

/// Precondition: `words` holds whole words. Adds nothing to `runs` unless a word has 4 bytes, and whole bytes to `bits`.
void append_coded_words(std::string& runs, std::string& bits, std::string_view words,
                        const WordLayout& layout);
/// The inverse for `count` words: takes what it reads from the front of `runs` and `bits`. Throws InputError where they end
/// early or hold no run.
void append_decoded_words(std::string& to, std::size_t count, const WordLayout& layout,
                          std::string_view& runs, std::string_view& bits);

}  // namespace roborun::log
