/// The transport of DroneCAN v0 over classic CAN: frames out of a transfer, and transfers out of frames.
/// Source: UAVCAN v0 specification, "CAN bus transport layer".
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware_if/can.hpp"
#include "firmware_if/dronecan/messages.hpp"
#include "firmware_if/status.hpp"
#include "firmware_if/time.hpp"

namespace roborun::firmware_if::dronecan {

inline constexpr std::uint8_t kMostNodeId = 127;
inline constexpr std::uint8_t kLowestPriority = 31;  ///< 0 wins arbitration.
inline constexpr Nanos kTransferTimeout{2'000'000'000};

/// Who says what to whom.
struct TransferHeader {
  TransferKind kind{TransferKind::kMessage};
  std::uint16_t data_type_id{};        ///< Of a service: at most 255. Anonymous: at most 3.
  std::uint8_t source_node_id{};       ///< 0: anonymous, a message of one frame only.
  std::uint8_t destination_node_id{};  ///< Of a service; 0 for messages.
  std::uint8_t priority{};
  std::uint8_t transfer_id{};  ///< 0 .. 31, one sequence for each (kind, type, destination) of a sender.
  friend constexpr bool operator==(const TransferHeader&, const TransferHeader&) = default;
};

/// The 29-bit identifier. `discriminator` (14 bits) tells anonymous senders apart; used only for them.
[[nodiscard]] constexpr std::uint32_t to_can_id(const TransferHeader& header,
                                                std::uint16_t discriminator = 0) noexcept {
  const std::uint32_t priority = (header.priority & 0x1fU) << 24U;
  const std::uint32_t source = header.source_node_id & 0x7fU;
  if (header.kind != TransferKind::kMessage) {
    const std::uint32_t request = header.kind == TransferKind::kRequest ? 0x8000U : 0U;
    return priority | ((header.data_type_id & 0xffU) << 16U) | request |
           ((header.destination_node_id & 0x7fU) << 8U) | 0x80U | source;
  }
  if (source == 0) return priority | ((discriminator & 0x3fffU) << 10U) | ((header.data_type_id & 3U) << 8U);
  return priority | (std::uint32_t{header.data_type_id} << 8U) | source;
}

/// Everything but the transfer id, for every 29-bit identifier.
[[nodiscard]] constexpr TransferHeader from_can_id(std::uint32_t id) noexcept {
  TransferHeader header;
  header.priority = static_cast<std::uint8_t>((id >> 24U) & 0x1fU);
  header.source_node_id = static_cast<std::uint8_t>(id & 0x7fU);
  if ((id & 0x80U) != 0) {
    header.kind = (id & 0x8000U) != 0 ? TransferKind::kRequest : TransferKind::kResponse;
    header.data_type_id = static_cast<std::uint16_t>((id >> 16U) & 0xffU);
    header.destination_node_id = static_cast<std::uint8_t>((id >> 8U) & 0x7fU);
  } else {
    header.data_type_id =
        static_cast<std::uint16_t>((id >> 8U) & (header.source_node_id == 0 ? 0x3U : 0xffffU));
  }
  return header;
}

/// Cuts a payload into frames, all stamped `stamp`. The result is their number, at least 1.
/// kCapacity: `frames` is too small. kInvalidArgument: a header field out of range, or an anonymous transfer
/// that is no message or does not fit into one frame. `frames` is of use only with kOk.
/// RT-safe: O(payload).
[[nodiscard]] Result<std::size_t> split(const TransferHeader& header, std::uint64_t signature,
                                        std::span<const std::uint8_t> payload, MonotonicTime stamp,
                                        std::span<CanFrame> frames) noexcept;

/// What became of a frame.
enum class FrameVerdict : std::uint8_t {
  kDelivered,  ///< It completed a transfer.
  kAccepted,   ///< It continues one.
  kNotOurs,    ///< A type that is not subscribed, or a service of another node.
  kDuplicate,  ///< Repeats the last frame taken, or the start of the last transfer delivered.
  /// No tail byte, a start with toggle, a short frame in the middle, an empty end, an anonymous multi-frame
  /// transfer. Ends the transfer that it belongs to.
  kMalformed,
  kMissedStart,      ///< In the middle of something whose start never came.
  kWrongTransferId,  ///< Belongs to another transfer than the one being received, which goes on.
  kWrongToggle,      ///< A frame was lost: the transfer is given up.
  kTimedOut,         ///< More than 2 s after the start: the transfer is given up.
  kTooLong,          ///< Longer than the type can be: the transfer is given up.
  kBadCrc,           ///< Complete, but damaged, or of another type than its id says: dropped.
};
inline constexpr std::size_t kVerdictCount = 11;
[[nodiscard]] const char* to_string(FrameVerdict verdict) noexcept;

struct Transfer {
  TransferHeader header{};
  MonotonicTime stamp{};                    ///< Of its first frame.
  std::span<const std::uint8_t> payload{};  ///< Valid until the next receive().
};

/// Puts transfers together from frames of any number of senders, in memory of its owner.
///
/// A transfer starts only with a start frame, and with every start frame (but a repetition of the one last
/// delivered: same transfer id, same bytes, within 2 s); so a sender that restarts is heard at once. A frame
/// that repeats the last one taken is skipped. Any other frame out of turn ends the transfer.
///
/// If all sessions are in use, the one heard longest ago is given up (counted in `evicted`).
/// RT-safe: O(sessions) a frame, no allocation; frames in the order of their arrival, one thread.
class Reassembler {
 public:
  static constexpr std::size_t kMostPayload_bytes = 384;

  /// What one sender is saying of one type. Opaque: only its size matters to the owner.
  struct Session {
    std::uint32_t key{0xffffffff};
    std::uint8_t transfer_id{};
    bool receiving{};
    bool toggle{};
    std::uint16_t crc{};
    std::uint16_t size{};
    MonotonicTime heard{};
    MonotonicTime started{};
    MonotonicTime completed_at{};
    CanFrame first{};            ///< Of the transfer being received.
    CanFrame last{};             ///< Last frame taken.
    CanFrame completed_first{};  ///< First frame of the last transfer delivered; empty: none was.
    std::array<std::uint8_t, kMostPayload_bytes> payload{};
  };
  struct Counters {
    std::array<std::uint64_t, kVerdictCount> verdicts{};  ///< Indexed by FrameVerdict. Never decrease.
    std::uint64_t evicted{};
  };

  /// @param types     Subscribed types; must outlive this.
  /// @param sessions  At least one; must outlive this.
  /// @param local_node_id  Services for others are not ours; 0: all services are received (a monitor).
  Reassembler(std::span<const DataType> types, std::span<Session> sessions,
              std::uint8_t local_node_id) noexcept
      : types_(types), sessions_(sessions), local_node_id_(local_node_id) {}

  /// `transfer` is written with kDelivered only. Time is frame.stamp.
  [[nodiscard]] FrameVerdict receive(const CanFrame& frame, Transfer& transfer) noexcept;
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }
  /// Transfers started and neither completed nor given up. O(sessions).
  [[nodiscard]] std::size_t unfinished() const noexcept;
  void set_local_node_id(std::uint8_t node_id) noexcept { local_node_id_ = node_id; }

 private:
  [[nodiscard]] FrameVerdict take(const CanFrame& frame, Transfer& transfer) noexcept;
  [[nodiscard]] FrameVerdict start(Session& session, const CanFrame& frame, Transfer& transfer) noexcept;
  [[nodiscard]] FrameVerdict resume(Session& session, const DataType& type, const CanFrame& frame,
                                    Transfer& transfer) noexcept;
  [[nodiscard]] Session& session_of(std::uint32_t key) noexcept;

  std::span<const DataType> types_;
  std::span<Session> sessions_;
  std::uint8_t local_node_id_;
  std::array<std::uint8_t, 8> anonymous_{};  ///< What was said without a node id belongs to no session.
  Counters counters_{};
};

}  // namespace roborun::firmware_if::dronecan
