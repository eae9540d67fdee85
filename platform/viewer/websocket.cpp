#include "platform/viewer/websocket.hpp"

#include <array>
#include <bit>

#include "platform/input/base64.hpp"

namespace roborun::viewer {
namespace {

constexpr std::size_t kKey_bytes = 4;

std::uint32_t big_endian(std::string_view bytes) {
  std::uint32_t value = 0;
  for (const char c : bytes.substr(0, 4)) value = value << 8U | static_cast<std::uint8_t>(c);
  return value;
}

void append_big_endian(std::string& to, std::uint64_t value, unsigned bytes) {
  while (bytes-- > 0) to += static_cast<char>(value >> (8 * bytes));
}

using Sha1State = std::array<std::uint32_t, 5>;

/// One block of 64 bytes; FIPS 180-4, 6.1.2.
void add_block(Sha1State& state, std::string_view block) {
  std::array<std::uint32_t, 80> w{};
  for (std::size_t t = 0; t < 16; ++t) w[t] = big_endian(block.substr(4 * t));
  for (std::size_t t = 16; t < w.size(); ++t)
    w[t] = std::rotl(w[t - 3] ^ w[t - 8] ^ w[t - 14] ^ w[t - 16], 1);
  auto [a, b, c, d, e] = state;
  for (std::size_t t = 0; t < w.size(); ++t) {
    const std::uint32_t mixed = t < 20              ? (b & c) ^ (~b & d)
                                : t < 40 || t >= 60 ? b ^ c ^ d
                                                    : (b & c) ^ (b & d) ^ (c & d);
    constexpr std::array<std::uint32_t, 4> kRound{0x5A827999U, 0x6ED9EBA1U, 0x8F1BBCDCU, 0xCA62C1D6U};
    const std::uint32_t next = std::rotl(a, 5) + mixed + e + kRound[t / 20] + w[t];
    e = d;
    d = c;
    c = std::rotl(b, 30);
    b = a;
    a = next;
  }
  const Sha1State add{a, b, c, d, e};
  for (std::size_t i = 0; i < add.size(); ++i) state[i] += add[i];
}

/// RFC 6455 asks for it; it protects nothing here.
std::string sha1(std::string text) {
  constexpr std::size_t kBlock_bytes = 64;
  constexpr std::size_t kLength_bytes = 8;
  const std::uint64_t bits = 8 * std::uint64_t{text.size()};
  text += static_cast<char>(0x80);
  while (text.size() % kBlock_bytes != kBlock_bytes - kLength_bytes) text += '\0';
  append_big_endian(text, bits, kLength_bytes);
  Sha1State state{0x67452301U, 0xEFCDAB89U, 0x98BADCFEU, 0x10325476U, 0xC3D2E1F0U};
  for (std::size_t at = 0; at < text.size(); at += kBlock_bytes)
    add_block(state, std::string_view(text).substr(at, kBlock_bytes));
  std::string digest;
  for (const std::uint32_t word : state) append_big_endian(digest, word, 4);
  return digest;
}

bool is_control(Opcode opcode) { return (static_cast<unsigned>(opcode) & 0x8U) != 0; }

/// Of a frame, up to its mask or payload.
void append_head(std::string& to, Opcode opcode, bool last, bool is_masked, std::size_t length) {
  const unsigned mask = is_masked ? 0x80U : 0U;
  to += static_cast<char>(static_cast<unsigned>(opcode) | (last ? 0x80U : 0U));
  if (length < 126) {
    to += static_cast<char>(mask | static_cast<unsigned>(length));
  } else if (length < 65536) {
    to += static_cast<char>(mask | 126U);
    append_big_endian(to, length, 2);
  } else {
    to += static_cast<char>(mask | 127U);
    append_big_endian(to, length, 8);
  }
}

}  // namespace

std::string accept_key(std::string_view key) {
  return input::to_base64(sha1(std::string(key) + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"));
}

void append_frame(std::string& to, Opcode opcode, std::string_view payload) {
  append_head(to, opcode, true, false, payload.size());
  to.append(payload);
}

std::string masked_frame(Opcode opcode, std::string_view payload, bool last) {
  const std::string key = "\x12\x34\x56\x78";
  std::string frame;
  append_head(frame, opcode, last, true, payload.size());
  frame += key;
  for (std::size_t i = 0; i < payload.size(); ++i)
    frame += static_cast<char>(payload[i] ^ key[i % key.size()]);
  return frame;
}

FrameReader::Status FrameReader::take(Message& frame, bool& last) {
  const auto byte = [this](std::size_t at) { return static_cast<std::uint8_t>(bytes_[at]); };
  if (bytes_.size() < 2) return Status::kMore;
  const unsigned first = byte(0);
  const unsigned second = byte(1);
  const bool is_masked = (second & 0x80U) != 0;
  std::size_t length = second & 0x7FU;
  frame.opcode = static_cast<Opcode>(first & 0x0FU);
  last = (first & 0x80U) != 0;
  const bool is_known =
      frame.opcode <= Opcode::kBinary || (frame.opcode >= Opcode::kClose && frame.opcode <= Opcode::kPong);
  const bool is_whole_control = last && length <= 125;
  const std::size_t key_bytes = is_masked ? kKey_bytes : 0;
  if (is_masked != (peer_ == Peer::kClient) || !is_known || (first & 0x70U) != 0 ||
      (is_control(frame.opcode) && !is_whole_control))
    return Status::kBad;
  std::size_t head = 2;
  if (length == 127 && peer_ == Peer::kClient) return Status::kBad;  // more than is taken
  if (length >= 126) {
    const std::size_t length_bytes = length == 126 ? 2 : 8;
    head += length_bytes;
    if (bytes_.size() < head) return Status::kMore;
    std::uint64_t value = 0;
    for (std::size_t i = 2; i < head; ++i) value = value << 8U | byte(i);
    if (value >= most_bytes()) return Status::kBad;
    length = static_cast<std::size_t>(value);
  }
  if (bytes_.size() < head + key_bytes + length) return Status::kMore;
  frame.payload = bytes_.substr(head + key_bytes, length);
  for (std::size_t i = 0; i < length && is_masked; ++i)
    frame.payload[i] = static_cast<char>(frame.payload[i] ^ bytes_[head + i % kKey_bytes]);
  bytes_.erase(0, head + key_bytes + length);
  return Status::kMessage;
}

FrameReader::Status FrameReader::next(Message& message) {
  while (!bad_) {
    bool last = false;
    const Status status = take(message, last);
    if (status == Status::kMore) return status;
    bad_ = status == Status::kBad ||
           (!is_control(message.opcode) && joining_ != (message.opcode == Opcode::kContinue));
    if (bad_) break;
    if (is_control(message.opcode)) return Status::kMessage;
    if (!joining_) begun_ = {message.opcode, {}};
    begun_.payload += message.payload;
    bad_ = begun_.payload.size() > most_bytes();
    joining_ = !last;
    if (bad_ || joining_) continue;
    message = std::move(begun_);
    return Status::kMessage;
  }
  return Status::kBad;
}

}  // namespace roborun::viewer
