/// MAVLink frames: out of a payload, and out of bytes. Source: MAVLink developer guide, "Packet
/// serialization" and "MAVLink 2".
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware_if/mavlink/message_type.hpp"
#include "firmware_if/mavlink/signing.hpp"
#include "firmware_if/status.hpp"

namespace roborun::firmware_if::mavlink {

inline constexpr std::uint8_t kStart1 = 0xfe;  ///< Of a MAVLink 1 frame.
inline constexpr std::uint8_t kStart2 = 0xfd;
inline constexpr std::size_t kHeader1_bytes = 6;
inline constexpr std::size_t kHeader2_bytes = 10;
inline constexpr std::size_t kCrc_bytes = 2;
inline constexpr std::size_t kMostFrame_bytes =
    kHeader2_bytes + kMostPayload_bytes + kCrc_bytes + kSignatureBlock_bytes;
inline constexpr std::uint8_t kSignedFlag = 0x01;  ///< The only incompatibility flag that there is.

/// Who says it, and the how manieth of his frames it is.
struct FrameHeader {
  std::uint8_t seq{};
  std::uint8_t sysid{};
  std::uint8_t compid{};
  friend constexpr bool operator==(const FrameHeader&, const FrameHeader&) = default;
};

/// A frame whose checksum is right. The spans are valid as long as the bytes that it was read from.
struct Frame {
  const MessageType* type{nullptr};  ///< Of the dictionary; nullptr: unknown id, nothing was checked.
  std::uint32_t msgid{};
  FrameHeader header{};
  std::uint8_t version{};                   ///< 1 or 2.
  bool has_signature{false};                ///< Carries a signature, right or wrong.
  bool is_authenticated{false};             ///< A verifier found it right and new.
  std::span<const std::uint8_t> payload{};  ///< As it came: cut by the sender, or longer than we know it.
  std::span<const std::uint8_t> bytes{};    ///< The whole frame.
};

enum class FrameState : std::uint8_t {
  kComplete,   ///< Known message, checksum right.
  kUnknownId,  ///< Whole, but without its CRC_EXTRA nobody can check it.
  kNeedsMore,  ///< The bytes end before the frame does.
  kNoStart,    ///< The first byte starts no frame.
  kBadFlags,   ///< An incompatibility flag that we do not know: not to be understood.
  kBadCrc,
};

/// Reads the frame that begins with the first byte. `frame` is complete with kComplete and kUnknownId, and of
/// no use otherwise. A length that does not fit the message is no error: MAVLink 2 senders cut zeros and may
/// know more fields than we do.
/// RT-safe: O(frame), no allocation.
[[nodiscard]] FrameState read_frame(std::span<const std::uint8_t> bytes, Frame& frame) noexcept;

/// Writes a MAVLink 2 frame: trailing zeros of the payload cut but for its first byte, signed if there is a
/// signer (which then takes its next time stamp). The result is the length; kCapacity: `out` is too small
/// (kMostFrame_bytes always suffices), the signer is untouched.
/// Bytes of `payload` behind type.max_bytes are not sent.
/// RT-safe: O(frame), no allocation.
[[nodiscard]] Result<std::size_t> write_frame(const MessageType& type, const FrameHeader& header,
                                              const Payload& payload, Signer* signer,
                                              std::span<std::uint8_t> out) noexcept;

/// The same as MAVLink 1, without extension fields: for tests and tools; roborun sends MAVLink 2.
/// kInvalidArgument: the id is above 255.
[[nodiscard]] Result<std::size_t> write_frame_v1(const MessageType& type, const FrameHeader& header,
                                                 const Payload& payload,
                                                 std::span<std::uint8_t> out) noexcept;

}  // namespace roborun::firmware_if::mavlink
