#include "firmware_if/mavlink/frame.hpp"

#include "firmware_if/mavlink/crc.hpp"
#include "firmware_if/mavlink/dictionary.hpp"

namespace roborun::firmware_if::mavlink {
namespace {

/// Of header and payload, start byte first.
std::uint16_t checksum(std::span<const std::uint8_t> bytes, std::uint8_t crc_extra) noexcept {
  Crc crc;
  crc.add(bytes.subspan(1));
  crc.add(crc_extra);
  return crc.value();
}

/// Appends the checksum behind header and payload; the new length.
std::size_t close_frame(std::span<std::uint8_t> out, std::size_t length, std::uint8_t crc_extra) noexcept {
  const std::uint16_t crc = checksum(out.first(length), crc_extra);
  out[length] = static_cast<std::uint8_t>(crc);
  out[length + 1] = static_cast<std::uint8_t>(crc >> 8U);
  return length + kCrc_bytes;
}

}  // namespace

FrameState read_frame(std::span<const std::uint8_t> bytes, Frame& frame) noexcept {
  if (bytes.empty()) return FrameState::kNeedsMore;
  if (bytes[0] != kStart1 && bytes[0] != kStart2) return FrameState::kNoStart;
  const bool v2 = bytes[0] == kStart2;
  // The flags alone may tell that there is nothing to wait for.
  if (v2 && bytes.size() > 2 && (bytes[2] & ~kSignedFlag) != 0) return FrameState::kBadFlags;
  const std::size_t header = v2 ? kHeader2_bytes : kHeader1_bytes;
  if (bytes.size() < header) return FrameState::kNeedsMore;
  const bool has_signature = v2 && (bytes[2] & kSignedFlag) != 0;
  const std::size_t covered = header + bytes[1];
  const std::size_t length = covered + kCrc_bytes + (has_signature ? kSignatureBlock_bytes : 0U);
  if (bytes.size() < length) return FrameState::kNeedsMore;

  frame.version = v2 ? 2 : 1;
  frame.has_signature = has_signature;
  frame.is_authenticated = false;
  const std::size_t seq = v2 ? 4 : 2;
  frame.header = {.seq = bytes[seq], .sysid = bytes[seq + 1], .compid = bytes[seq + 2]};
  frame.msgid = v2 ? bytes[7] | (std::uint32_t{bytes[8]} << 8U) | (std::uint32_t{bytes[9]} << 16U)
                   : std::uint32_t{bytes[5]};
  frame.payload = bytes.subspan(header, bytes[1]);
  frame.bytes = bytes.first(length);
  frame.type = find_message(frame.msgid);
  if (frame.type == nullptr) return FrameState::kUnknownId;
  const std::uint32_t crc = bytes[covered] | (std::uint32_t{bytes[covered + 1]} << 8U);
  return crc == checksum(bytes.first(covered), frame.type->crc_extra) ? FrameState::kComplete
                                                                      : FrameState::kBadCrc;
}

Result<std::size_t> write_frame(const MessageType& type, const FrameHeader& header, const Payload& payload,
                                Signer* signer, std::span<std::uint8_t> out) noexcept {
  std::size_t size = type.max_bytes;
  while (size > 1 && payload[size - 1] == 0) --size;
  const std::size_t unsigned_length = kHeader2_bytes + size + kCrc_bytes;
  if (out.size() < unsigned_length + (signer != nullptr ? kSignatureBlock_bytes : 0U))
    return Status::kCapacity;
  const std::array<std::uint8_t, kHeader2_bytes> head{kStart2,
                                                      static_cast<std::uint8_t>(size),
                                                      signer != nullptr ? kSignedFlag : std::uint8_t{0},
                                                      0,
                                                      header.seq,
                                                      header.sysid,
                                                      header.compid,
                                                      static_cast<std::uint8_t>(type.id),
                                                      static_cast<std::uint8_t>(type.id >> 8U),
                                                      static_cast<std::uint8_t>(type.id >> 16U)};
  std::copy(head.begin(), head.end(), out.begin());
  std::copy_n(payload.begin(), size, out.begin() + kHeader2_bytes);
  const std::size_t length = close_frame(out, kHeader2_bytes + size, type.crc_extra);
  if (signer == nullptr) return length;
  signer->sign(out.first(length), out.subspan(length).first<kSignatureBlock_bytes>());
  return length + kSignatureBlock_bytes;
}

Result<std::size_t> write_frame_v1(const MessageType& type, const FrameHeader& header, const Payload& payload,
                                   std::span<std::uint8_t> out) noexcept {
  if (type.id > 0xff) return Status::kInvalidArgument;
  const std::size_t size = type.min_bytes;
  if (out.size() < kHeader1_bytes + size + kCrc_bytes) return Status::kCapacity;
  const std::array<std::uint8_t, kHeader1_bytes> head{
      kStart1, type.min_bytes, header.seq, header.sysid, header.compid, static_cast<std::uint8_t>(type.id)};
  std::copy(head.begin(), head.end(), out.begin());
  std::copy_n(payload.begin(), size, out.begin() + kHeader1_bytes);
  return close_frame(out, kHeader1_bytes + size, type.crc_extra);
}

}  // namespace roborun::firmware_if::mavlink
