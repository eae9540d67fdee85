/// 32-bit words of an image or a cloud, so that zstd finds what they have in common: each as its difference from the one
/// `stride` before that was not "nothing" (+infinity as a float, what most of an image of the open air is), then all lowest
/// bytes, all second ones, and so on. Without loss for any bits.
#pragma once

#include <string>
#include <string_view>

namespace roborun::log {

/// Precondition: `words` holds whole words. Appends as many bytes.
void append_coded_words(std::string& to, std::string_view words, std::size_t stride);
/// The inverse. Precondition as above.
void append_decoded_words(std::string& to, std::string_view coded, std::size_t stride);

}  // namespace roborun::log
