#include "platform/sensor_port/port_receiver.hpp"

#include <algorithm>
#include <cstring>

#include "platform/sensor_port/port_names.hpp"

namespace roborun::sensor_port {
namespace {

/// A picture of which nothing came for so long lacks something; asked for again no sooner.
constexpr Nanos kWaits{2'000'000};
constexpr Nanos kAsksAgain{5'000'000};
constexpr std::uint64_t kMostNumber = std::uint64_t{1} << 62U;
/// The clocks are matched again and again: what seems to go back by less stands still.
constexpr std::int64_t kStands_ns = 2'000'000;

std::string suffix_of(const BridgeStream& told) {
  return {told.suffix.begin(), std::find(told.suffix.begin(), told.suffix.end(), '\0')};
}

bool is_same(const BridgeStream& a, const BridgeStream& b) noexcept {
  return a.suffix == b.suffix && a.kind == b.kind && a.slots == b.slots &&
         a.payload_room_bytes == b.payload_room_bytes;
}

/// A port that may be made.
bool is_port(const BridgeStream& told) noexcept {
  const std::uint32_t sample_bytes = roborun_port_sample_bytes(told.kind);
  return is_suffix(suffix_of(told)) && sample_bytes > 0 && told.slots >= 2 &&
         told.slots <= ROBORUN_PORT_MOST_SLOTS && told.payload_room_bytes <= ROBORUN_PORT_MOST_BYTES - 1024 &&
         told.slots * (std::uint64_t{sample_bytes} + told.payload_room_bytes) <=
             PortReceiver::kMostFile_bytes;
}

}  // namespace

void PortReceiver::open(Stream& stream, const BridgeStream& told) {
  if (!stream.port.is_open() || !is_same(stream.told, told))
    open_port(stream.port, port_path(name_) + "-" + suffix_of(told), told.kind, told.payload_room_bytes,
              told.slots);
  stream.told = told;
  stream.is_known = true;
  stream.number = 0;
  stream.missing = 0;
  const std::size_t most_bytes =
      is_picture(told.kind) ? roborun_port_sample_bytes(told.kind) + told.payload_room_bytes : 0;
  stream.held.assign(most_bytes, std::byte{});
  stream.has.assign(pieces_of(most_bytes), false);
}

void PortReceiver::announced(std::span<const std::uint8_t> streams, std::size_t count) {
  if (count > kMostStreams || streams.size() != count * sizeof(BridgeStream)) return refuse();
  BridgeStream told;
  for (std::size_t i = 0; take(streams, told); ++i) {
    if (i == streams_.size()) streams_.push_back(std::make_unique<Stream>());
    Stream& stream = *streams_[i];
    // A hello may come late.
    if (told.generation == 0 || (stream.is_known && told.generation <= stream.told.generation)) continue;
    if (is_port(told) && takes_(suffix_of(told)))
      open(stream, told);
    else
      refuse();
  }
}

PortReceiver::Stream* PortReceiver::find(std::uint32_t stream, std::uint32_t generation, bool pictures) {
  if (stream >= streams_.size() || !streams_[stream]->is_known ||
      streams_[stream]->told.generation != generation)
    return nullptr;  // not announced yet
  if (is_picture(streams_[stream]->told.kind) == pictures) return streams_[stream].get();
  refuse();
  return nullptr;
}

void PortReceiver::write(Stream& stream, std::span<std::byte> sample, std::span<const std::byte> payload,
                         Nanos shift) {
  roborun_port_stamp stamp;
  std::memcpy(&stamp, sample.data(), sizeof stamp);
  stamp.stamp_ns = moved_ns(stamp.stamp_ns, shift.count());
  const auto back_ns =
      static_cast<std::uint64_t>(stream.stamp_ns) - static_cast<std::uint64_t>(stamp.stamp_ns);
  if (back_ns < static_cast<std::uint64_t>(kStands_ns)) stamp.stamp_ns = stream.stamp_ns;
  stream.stamp_ns = stamp.stamp_ns;
  std::memcpy(sample.data(), &stamp, sizeof stamp);
  (void)stream.port.write_bytes(sample, payload);
}

void PortReceiver::samples(std::span<const std::uint8_t> message, std::size_t count, Nanos shift) {
  BridgeSamples head;
  if (!take(message, head)) return refuse();
  Stream* const stream = find(head.stream, head.generation, false);
  if (stream == nullptr) return;
  const std::size_t bytes = roborun_port_sample_bytes(stream->told.kind);
  if (message.size() != count * bytes || count == 0 || head.number > kMostNumber) return refuse();
  std::array<std::byte, kDatagram_bytes> sample{};
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t number = head.number + i;
    if (number < stream->number) continue;
    if (stream->number > 0) counters_.lost += number - stream->number;
    stream->number = number + 1;
    std::memcpy(sample.data(), message.data() + i * bytes, bytes);
    write(*stream, std::span(sample).first(bytes), {}, shift);
    ++counters_.samples;
  }
}

void PortReceiver::begin(Stream& stream, const BridgePiece& piece) {
  if (stream.missing > 0) ++counters_.lost;
  if (stream.number > 0) counters_.lost += piece.number - stream.number - 1;
  const std::size_t pieces = pieces_of(piece.picture_bytes);
  stream.number = piece.number;
  stream.held.resize(piece.picture_bytes);
  std::fill_n(stream.has.begin(), pieces, false);
  stream.missing = pieces;
}

void PortReceiver::piece(MonotonicTime now, std::span<const std::uint8_t> message, Nanos shift) {
  BridgePiece piece;
  if (!take(message, piece)) return refuse();
  Stream* const stream = find(piece.stream, piece.generation, true);
  if (stream == nullptr) return;
  const std::size_t sample_bytes = roborun_port_sample_bytes(stream->told.kind);
  if (piece.picture_bytes < sample_bytes ||
      piece.picture_bytes > sample_bytes + stream->told.payload_room_bytes ||
      piece.index >= pieces_of(piece.picture_bytes) || piece.number == 0 || piece.number > kMostNumber)
    return refuse();
  const std::size_t at = piece.index * kPiece_bytes;
  if (message.size() != std::min(kPiece_bytes, piece.picture_bytes - at)) return refuse();
  if (piece.number < stream->number) {
    ++counters_.late;
    return;
  }
  if (piece.number > stream->number) begin(*stream, piece);
  if (piece.picture_bytes != stream->held.size()) return refuse();
  stream->heard = now;
  if (stream->missing == 0 || stream->has[piece.index]) return;
  stream->has[piece.index] = true;
  std::memcpy(stream->held.data() + at, message.data(), message.size());
  if (--stream->missing > 0) return;
  const std::span<std::byte> picture(stream->held);
  write(*stream, picture.first(sample_bytes), picture.subspan(sample_bytes), shift);
  ++counters_.pictures;
}

void PortReceiver::ask(MonotonicTime now, std::uint32_t session, const SendDatagram& send) {
  for (std::size_t i = 0; i < streams_.size(); ++i) {
    Stream& stream = *streams_[i];
    if (!stream.is_known || stream.missing == 0 || now - stream.heard < kWaits ||
        now - stream.asked < kAsksAgain)
      continue;
    stream.asked = now;
    Datagram again(BridgeMessage::kAgain, session);
    again.put(BridgeAgain{static_cast<std::uint32_t>(i), stream.told.generation, stream.number});
    const std::size_t pieces = pieces_of(stream.held.size());
    std::size_t gaps = 0;
    for (std::size_t first = 0; first < pieces && again.room_bytes() >= sizeof(BridgeGap);) {
      std::size_t end = first;
      while (end < pieces && !stream.has[end]) ++end;
      if (end > first) {
        again.put(BridgeGap{static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(end - first)});
        ++gaps;
      }
      first = end + 1;
    }
    again.send(gaps, send);
  }
}

void PortReceiver::forget() noexcept {
  for (const auto& stream : streams_) stream->is_known = false;
}

}  // namespace roborun::sensor_port
