/// The golden vectors (tests/data/mavlink_vectors.json; its `about` says what is in it).
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "firmware_if/mavlink/receiver.hpp"

namespace roborun::firmware_if::mavlink::test {

using Json = nlohmann::ordered_json;
using Bytes = std::vector<std::uint8_t>;

[[nodiscard]] const Json& vectors();

inline Bytes from_hex(const std::string& hex) {
  Bytes bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    bytes.push_back(static_cast<std::uint8_t>(std::stoul(hex.substr(i, 2), nullptr, 16)));
  return bytes;
}
inline std::string to_hex(std::span<const std::uint8_t> bytes) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string hex;
  for (const std::uint8_t byte : bytes) {
    hex += kDigits[byte >> 4U];
    hex += kDigits[byte & 15U];
  }
  return hex;
}

inline SigningKey key() {
  const Bytes bytes = from_hex(vectors().at("key"));
  SigningKey key{};
  std::copy(bytes.begin(), bytes.end(), key.begin());
  return key;
}

/// Feeds `bytes` in chunks and calls visit(event, frame) for each event.
template <typename Visit>
void feed(Receiver& receiver, std::span<const std::uint8_t> bytes, Visit&& visit) {
  Frame frame;
  while (!bytes.empty()) {
    bytes = bytes.subspan(receiver.push(bytes));
    for (Event event = receiver.next(frame); event != Event::kNothing; event = receiver.next(frame))
      visit(event, frame);
  }
}

}  // namespace roborun::firmware_if::mavlink::test
