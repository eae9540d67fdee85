/// The WebSocket protocol (RFC 6455) as bytes: no socket, no extension.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace roborun::viewer {

enum class Opcode : std::uint8_t { kContinue = 0, kText = 1, kBinary = 2, kClose = 8, kPing = 9, kPong = 10 };

/// The answer to a client's Sec-WebSocket-Key.
[[nodiscard]] std::string accept_key(std::string_view key);

/// Appends a whole message of the server.
void append_frame(std::string& to, Opcode opcode, std::string_view payload);

/// A message of a client, or a part of one that `last` does not end. The mask is always the same: it is there
/// for proxies, and here are none.
[[nodiscard]] std::string masked_frame(Opcode opcode, std::string_view payload, bool last = true);

/// Puts messages of the other side together. Believes nothing: memory is bounded by the longest message that is taken.
class FrameReader {
 public:
  enum class Peer : std::uint8_t { kClient, kServer };
  static constexpr std::size_t kMostMessage_bytes = 1U << 16U;  ///< Of a client.
  static constexpr std::size_t kMostServerMessage_bytes = 8U << 20U;

  enum class Status : std::uint8_t { kMore, kMessage, kBad };
  struct Message {
    Opcode opcode{};
    std::string payload;
  };

  explicit FrameReader(Peer peer = Peer::kClient) : peer_(peer) {}
  void feed(std::string_view bytes) { bytes_.append(bytes); }
  /// kMessage: a whole one, or a control frame. kMore: feed() first. kBad: it does not keep to the protocol, or says too
  /// much; for ever.
  [[nodiscard]] Status next(Message& message);

 private:
  /// One frame, if it is whole.
  [[nodiscard]] Status take(Message& frame, bool& last);

  [[nodiscard]] std::size_t most_bytes() const {
    return peer_ == Peer::kClient ? kMostMessage_bytes : kMostServerMessage_bytes;
  }

  Peer peer_;
  std::string bytes_;
  Message begun_;  ///< Of a message in several frames.
  bool joining_{false};
  bool bad_{false};
};

}  // namespace roborun::viewer
