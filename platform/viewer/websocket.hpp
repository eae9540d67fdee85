/// The WebSocket protocol (RFC 6455) from the server's side, as bytes: no socket, no extension.
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

/// Puts messages of a client together. Believes nothing: memory is bounded by kMostMessage_bytes.
class FrameReader {
 public:
  static constexpr std::size_t kMostMessage_bytes = 1U << 16U;
  enum class Status : std::uint8_t { kMore, kMessage, kBad };
  struct Message {
    Opcode opcode{};
    std::string payload;
  };

  void feed(std::string_view bytes) { bytes_.append(bytes); }
  /// kMessage: a whole one, or a control frame. kMore: feed() first. kBad: the client does not keep to the protocol, or says too
  /// much; for ever.
  [[nodiscard]] Status next(Message& message);

 private:
  /// One frame, if it is whole.
  [[nodiscard]] Status take(Message& frame, bool& last);

  std::string bytes_;
  Message begun_;  ///< Of a message in several frames.
  bool joining_{false};
  bool bad_{false};
};

}  // namespace roborun::viewer
