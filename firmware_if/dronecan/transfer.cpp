#include "firmware_if/dronecan/transfer.hpp"

#include <algorithm>

namespace roborun::firmware_if::dronecan {
namespace {

constexpr std::uint8_t kStart = 0x80;
constexpr std::uint8_t kEnd = 0x40;
constexpr std::uint8_t kToggle = 0x20;
constexpr std::uint8_t kTransferIdMask = 0x1f;
constexpr std::size_t kBytesAFrame = 7;
constexpr std::uint32_t kPriorityMask = 0x1f000000;

static_assert(std::ranges::all_of(kAllTypes,
                                  [](const DataType& type) {
                                    return type.max_payload_bytes <= Reassembler::kMostPayload_bytes;
                                  }),
              "a message does not fit into a session");

bool header_fits(const TransferHeader& header) noexcept {
  const bool service = header.kind != TransferKind::kMessage;
  if (header.source_node_id > kMostNodeId || header.priority > kLowestPriority ||
      header.transfer_id > kTransferIdMask)
    return false;
  if (service)
    return header.data_type_id <= 0xff && header.source_node_id != 0 && header.destination_node_id != 0 &&
           header.destination_node_id <= kMostNodeId;
  return header.destination_node_id == 0 && (header.source_node_id != 0 || header.data_type_id <= 3);
}

bool same_bytes(const CanFrame& a, const CanFrame& b) noexcept {
  return a.id == b.id && std::ranges::equal(a.bytes(), b.bytes());
}

bool timed_out(MonotonicTime from, MonotonicTime to) noexcept {
  const Nanos elapsed = to - from;
  return elapsed > kTransferTimeout || elapsed < -kTransferTimeout;
}

}  // namespace

const char* to_string(FrameVerdict verdict) noexcept {
  switch (verdict) {
    case FrameVerdict::kDelivered:
      return "delivered";
    case FrameVerdict::kAccepted:
      return "accepted";
    case FrameVerdict::kNotOurs:
      return "unknown type";
    case FrameVerdict::kDuplicate:
      return "duplicate";
    case FrameVerdict::kMalformed:
      return "malformed";
    case FrameVerdict::kMissedStart:
      return "missed start";
    case FrameVerdict::kWrongTransferId:
      return "wrong transfer id";
    case FrameVerdict::kWrongToggle:
      return "wrong toggle";
    case FrameVerdict::kTimedOut:
      return "timed out";
    case FrameVerdict::kTooLong:
      return "too long";
    case FrameVerdict::kBadCrc:
      return "bad crc";
  }
  return "unknown";
}

Result<std::size_t> split(const TransferHeader& header, std::uint64_t signature,
                          std::span<const std::uint8_t> payload, MonotonicTime stamp,
                          std::span<CanFrame> frames) noexcept {
  if (!header_fits(header)) return Status::kInvalidArgument;
  if (frames.empty()) return Status::kCapacity;
  if (payload.size() <= kBytesAFrame) {
    CanFrame& frame = frames[0];
    // Anonymous senders that say different things must not win arbitration together.
    frame.id = to_can_id(header, header.source_node_id == 0 ? crc16(payload) : std::uint16_t{0});
    frame.size = static_cast<std::uint8_t>(payload.size() + 1);
    frame.stamp = stamp;
    for (std::size_t i = 0; i < payload.size(); ++i) frame.data[i] = payload[i];
    frame.data[payload.size()] = static_cast<std::uint8_t>(kStart | kEnd | header.transfer_id);
    return std::size_t{1};
  }
  if (header.source_node_id == 0) return Status::kInvalidArgument;
  const std::size_t total = payload.size() + 2;
  const std::size_t count = (total + kBytesAFrame - 1) / kBytesAFrame;
  if (count > frames.size()) return Status::kCapacity;
  const std::uint16_t crc = crc16(payload, transfer_crc_seed(signature));
  const auto byte_at = [&](std::size_t i) {
    if (i == 0) return static_cast<std::uint8_t>(crc & 0xffU);
    return i == 1 ? static_cast<std::uint8_t>(crc >> 8U) : payload[i - 2];
  };
  for (std::size_t k = 0; k < count; ++k) {
    CanFrame& frame = frames[k];
    const std::size_t from = k * kBytesAFrame;
    const std::size_t length = std::min(kBytesAFrame, total - from);
    frame.id = to_can_id(header);
    frame.size = static_cast<std::uint8_t>(length + 1);
    frame.stamp = stamp;
    for (std::size_t i = 0; i < length; ++i) frame.data[i] = byte_at(from + i);
    frame.data[length] = static_cast<std::uint8_t>((k == 0 ? kStart : 0) | (k + 1 == count ? kEnd : 0) |
                                                   (k % 2 == 1 ? kToggle : 0) | header.transfer_id);
  }
  return count;
}

FrameVerdict Reassembler::receive(const CanFrame& frame, Transfer& transfer) noexcept {
  const FrameVerdict verdict = take(frame, transfer);
  ++counters_.verdicts[static_cast<std::size_t>(verdict)];
  return verdict;
}

std::size_t Reassembler::unfinished() const noexcept {
  std::size_t count = 0;
  for (const Session& session : sessions_) count += session.receiving ? 1U : 0U;
  return count;
}

FrameVerdict Reassembler::take(const CanFrame& frame, Transfer& transfer) noexcept {
  TransferHeader header = from_can_id(frame.id);
  const auto type = std::ranges::find_if(
      types_, [&](const DataType& t) { return t.kind == header.kind && t.id == header.data_type_id; });
  if (type == types_.end()) return FrameVerdict::kNotOurs;
  if (header.kind != TransferKind::kMessage && local_node_id_ != 0 &&
      header.destination_node_id != local_node_id_)
    return FrameVerdict::kNotOurs;
  if (frame.size == 0 || frame.size > frame.data.size()) return FrameVerdict::kMalformed;
  const std::uint8_t tail = frame.data[frame.size - 1U];
  if (header.source_node_id == 0) {
    if ((tail & (kStart | kEnd | kToggle)) != (kStart | kEnd) || header.kind != TransferKind::kMessage)
      return FrameVerdict::kMalformed;
    header.transfer_id = tail & kTransferIdMask;
    std::ranges::copy(frame.bytes(), anonymous_.begin());
    transfer = {header, frame.stamp, std::span<const std::uint8_t>(anonymous_).first(frame.size - 1U)};
    return FrameVerdict::kDelivered;
  }
  // Priority is no part of a sender's sequence.
  Session& session = session_of(frame.id & ~kPriorityMask);
  const FrameVerdict verdict =
      (tail & kStart) != 0 ? start(session, frame, transfer) : resume(session, *type, frame, transfer);
  session.heard = frame.stamp;
  return verdict;
}

FrameVerdict Reassembler::start(Session& session, const CanFrame& frame, Transfer& transfer) noexcept {
  const std::uint8_t tail = frame.data[frame.size - 1U];
  const std::uint8_t transfer_id = tail & kTransferIdMask;
  const bool single = (tail & kEnd) != 0;
  if ((tail & kToggle) != 0 || (!single && frame.size != frame.data.size())) {
    session.receiving = false;
    return FrameVerdict::kMalformed;
  }
  if (!timed_out(session.completed_at, frame.stamp) && same_bytes(session.completed_first, frame))
    return FrameVerdict::kDuplicate;

  session.transfer_id = transfer_id;
  session.started = frame.stamp;
  session.first = frame;
  if (single) {
    session.receiving = false;
    session.completed_at = frame.stamp;
    session.completed_first = frame;
    std::ranges::copy(frame.bytes(), session.payload.begin());
    transfer.header = from_can_id(frame.id);
    transfer.header.transfer_id = transfer_id;
    transfer.stamp = frame.stamp;
    transfer.payload = {session.payload.data(), frame.size - 1U};
    return FrameVerdict::kDelivered;
  }
  const bool repeated = session.receiving && same_bytes(session.last, frame);
  session.receiving = true;
  session.last = frame;
  session.toggle = true;
  session.crc = static_cast<std::uint16_t>(frame.data[0] | (frame.data[1] << 8U));
  session.size = static_cast<std::uint16_t>(kBytesAFrame - 2);
  std::copy_n(frame.data.begin() + 2, session.size, session.payload.begin());
  return repeated ? FrameVerdict::kDuplicate : FrameVerdict::kAccepted;
}

FrameVerdict Reassembler::resume(Session& session, const DataType& type, const CanFrame& frame,
                                 Transfer& transfer) noexcept {
  if (!session.receiving) return FrameVerdict::kMissedStart;
  const auto give_up = [&session](FrameVerdict why) {
    session.receiving = false;
    return why;
  };
  const std::uint8_t tail = frame.data[frame.size - 1U];
  const bool end = (tail & kEnd) != 0;
  const std::size_t length = frame.size - 1U;
  if (timed_out(session.started, frame.stamp)) return give_up(FrameVerdict::kTimedOut);
  if ((tail & kTransferIdMask) != session.transfer_id) return FrameVerdict::kWrongTransferId;
  if (same_bytes(session.last, frame)) return FrameVerdict::kDuplicate;
  if (((tail & kToggle) != 0) != session.toggle) return give_up(FrameVerdict::kWrongToggle);
  if (length == 0 || (!end && length != kBytesAFrame)) return give_up(FrameVerdict::kMalformed);
  if (session.size + length > std::min(type.max_payload_bytes, kMostPayload_bytes))
    return give_up(FrameVerdict::kTooLong);

  std::copy_n(frame.data.begin(), length, session.payload.begin() + session.size);
  session.size = static_cast<std::uint16_t>(session.size + length);
  session.toggle = !session.toggle;
  session.last = frame;
  if (!end) return FrameVerdict::kAccepted;

  session.receiving = false;
  const std::span<const std::uint8_t> payload{session.payload.data(), session.size};
  if (crc16(payload, transfer_crc_seed(type.signature)) != session.crc) return FrameVerdict::kBadCrc;
  session.completed_at = frame.stamp;
  session.completed_first = session.first;
  transfer.header = from_can_id(session.first.id);
  transfer.header.transfer_id = session.transfer_id;
  transfer.stamp = session.started;
  transfer.payload = payload;
  return FrameVerdict::kDelivered;
}

Reassembler::Session& Reassembler::session_of(std::uint32_t key) noexcept {
  Session* oldest = sessions_.data();
  for (Session& session : sessions_) {
    if (session.key == key) return session;
    if (oldest->key != Session{}.key && (session.key == Session{}.key || session.heard < oldest->heard))
      oldest = &session;
  }
  if (oldest->key != Session{}.key) ++counters_.evicted;
  oldest->key = key;
  oldest->receiving = false;
  return *oldest;
}

}  // namespace roborun::firmware_if::dronecan
