/// What a client of a WebSocket sends.
#pragma once

#include <string>
#include <string_view>

#include "platform/viewer/websocket.hpp"

namespace roborun::test {

/// Of at most 65,535 bytes; `last`: the message ends with it.
inline std::string masked_frame(viewer::Opcode opcode, std::string_view payload, bool last = true) {
  const std::string key = "\x12\x34\x56\x78";
  std::string frame(1, static_cast<char>(static_cast<unsigned>(opcode) | (last ? 0x80U : 0U)));
  if (payload.size() < 126) {
    frame += static_cast<char>(0x80U | payload.size());
  } else {
    frame += static_cast<char>(0x80U | 126U);
    frame += static_cast<char>(payload.size() >> 8U);
    frame += static_cast<char>(payload.size());
  }
  frame += key;
  for (std::size_t i = 0; i < payload.size(); ++i)
    frame += static_cast<char>(payload[i] ^ key[i % key.size()]);
  return frame;
}

}  // namespace roborun::test
