#include "platform/sensor_port/port_sender.hpp"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "platform/sensor_port/port_names.hpp"

namespace roborun::sensor_port {
namespace {

/// Pieces of pictures in one step: no more than a receiver's socket holds, which is asleep now.
constexpr std::size_t kMostPieces = 16;
constexpr int kMostSamples = 2048;  // twice what a port holds

/// How many samples of this kind a datagram holds.
std::size_t samples_in_datagram(std::uint32_t kind) noexcept {
  return (kDatagram_bytes - sizeof(BridgeHeader) - sizeof(BridgeSamples)) / roborun_port_sample_bytes(kind);
}

/// Puts sample and payload behind `out`, the stamp on the other machine's clock.
void append(const PortSample& port, Nanos shift, std::vector<std::byte>& out) {
  const std::size_t at = out.size();
  out.insert(out.end(), port.sample.begin(), port.sample.end());
  out.insert(out.end(), port.payload.begin(), port.payload.end());
  roborun_port_stamp stamp;
  std::memcpy(&stamp, out.data() + at, sizeof stamp);
  stamp.stamp_ns = moved_ns(moved_ns(stamp.stamp_ns, port.clock_offset_ns), shift.count());
  std::memcpy(out.data() + at, &stamp, sizeof stamp);
}

}  // namespace

bool is_picture(std::uint32_t kind) noexcept {
  return kind == ROBORUN_PORT_DEPTH || kind == ROBORUN_PORT_CLOUD;
}

bool is_suffix(std::string_view suffix) noexcept {
  return !suffix.empty() && suffix.size() < sizeof(BridgeStream::suffix) &&
         std::all_of(suffix.begin(), suffix.end(),
                     [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-'; });
}

PortSender::PortSender(const std::string& name, PortFilter sends, std::uint32_t session)
    : name_(name), sends_(sends), session_(session) {}

void PortSender::open(Stream& stream) {
  stream.is_open = stream.reader.open(port_path(name_) + "-" + stream.suffix, 0).empty();
  if (!stream.is_open) return;
  ++stream.generation;
  stream.number = 0;
  stream.fresh = stream.next_piece = 0;
  stream.held.clear();
}

void PortSender::look() {
  const std::filesystem::path base(port_path(name_) + "-");
  const std::string prefix = base.filename();
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(base.parent_path(), error)) {
    const std::string file = entry.path().filename();
    if (!file.starts_with(prefix)) continue;
    const std::string suffix = file.substr(prefix.size());
    const bool is_known = std::any_of(streams_.begin(), streams_.end(),
                                      [&suffix](const auto& stream) { return stream->suffix == suffix; });
    if (is_known || !is_suffix(suffix) || !sends_(suffix) || streams_.size() == kMostStreams) continue;
    streams_.push_back(std::make_unique<Stream>());
    streams_.back()->suffix = suffix;
  }
  for (const auto& stream : streams_)
    if (!stream->is_open || stream->reader.is_replaced()) open(*stream);
}

void PortSender::announce(std::int64_t asked_ns, const SendDatagram& send) const {
  Datagram hello(BridgeMessage::kHello, session_);
  hello.put(BridgeHello{asked_ns});
  for (const auto& stream : streams_) {
    BridgeStream told;
    std::copy(stream->suffix.begin(), stream->suffix.end(), told.suffix.begin());
    if (stream->generation > 0) {
      told.kind = stream->reader.kind();
      told.slots = stream->reader.slot_count();
      told.payload_room_bytes = is_picture(told.kind) ? stream->reader.payload_room_bytes() : 0;
      told.generation = stream->generation;
    }
    hello.put(told);
  }
  hello.send(streams_.size(), send);
}

void PortSender::flush(std::uint32_t index, const SendDatagram& send) {
  Stream& stream = *streams_[index];
  if (stream.fresh == 0) return;
  const std::size_t held = stream.held.size() / roborun_port_sample_bytes(stream.reader.kind());
  Datagram samples(BridgeMessage::kSamples, session_);
  samples.put(BridgeSamples{index, stream.generation, stream.number - held});
  samples.put_bytes(stream.held);
  samples.send(held, send);
  stream.fresh = 0;
}

void PortSender::step_samples(std::uint32_t index, Nanos shift, const SendDatagram& send) {
  Stream& stream = *streams_[index];
  const std::uint32_t bytes = roborun_port_sample_bytes(stream.reader.kind());
  const std::size_t most = samples_in_datagram(stream.reader.kind());
  PortSample port;
  for (int i = 0; i < kMostSamples; ++i) {
    const Status status = stream.reader.next(port);
    if (status == Status::kIo) stream.is_open = false;
    if (status != Status::kOk) break;
    port.payload = {};
    if (stream.fresh == most) flush(index, send);
    if (stream.held.size() == most * bytes)
      stream.held.erase(stream.held.begin(), stream.held.begin() + bytes);
    append(port, shift, stream.held);
    ++stream.number;
    ++stream.fresh;
    ++counters_.samples;
  }
  flush(index, send);
}

void PortSender::send_piece(std::uint32_t index, std::size_t piece, const SendDatagram& send) {
  const Stream& stream = *streams_[index];
  const std::span<const std::byte> picture(stream.held);
  Datagram datagram(BridgeMessage::kPiece, session_);
  datagram.put(BridgePiece{index, stream.generation, stream.number,
                           static_cast<std::uint32_t>(picture.size()), static_cast<std::uint32_t>(piece)});
  const std::size_t at = piece * kPiece_bytes;
  datagram.put_bytes(picture.subspan(at, std::min(kPiece_bytes, picture.size() - at)));
  datagram.send(0, send);
  ++counters_.pieces;
}

std::size_t PortSender::step_picture(std::uint32_t index, Nanos shift, std::size_t most,
                                     const SendDatagram& send) {
  Stream& stream = *streams_[index];
  if (stream.next_piece == pieces_of(stream.held.size())) {
    PortSample port;
    const Status status = stream.reader.newest(port);
    if (status == Status::kIo) stream.is_open = false;
    if (status != Status::kOk) return most;
    stream.held.clear();
    append(port, shift, stream.held);
    ++stream.number;
    stream.next_piece = 0;
    ++counters_.pictures;
  }
  for (; most > 0 && stream.next_piece < pieces_of(stream.held.size()); --most)
    send_piece(index, stream.next_piece++, send);
  return most;
}

void PortSender::step(Nanos shift, const SendDatagram& send) {
  const auto is_open = [this](std::size_t i, bool pictures) {
    return streams_[i]->is_open && is_picture(streams_[i]->reader.kind()) == pictures;
  };
  for (std::size_t i = 0; i < streams_.size(); ++i)
    if (is_open(i, false)) step_samples(static_cast<std::uint32_t>(i), shift, send);
  std::size_t most = kMostPieces;
  for (std::size_t i = 0; i < streams_.size() && most > 0; ++i) {
    const std::size_t at = (turn_ + i) % streams_.size();
    if (is_open(at, true)) most = step_picture(static_cast<std::uint32_t>(at), shift, most, send);
    if (most == 0) turn_ = at;  // it goes on there
  }
}

void PortSender::again(const BridgeAgain& which, std::span<const std::uint8_t> gaps,
                       const SendDatagram& send) {
  if (which.stream >= streams_.size()) return;
  const Stream& stream = *streams_[which.stream];
  if (!stream.is_open || !is_picture(stream.reader.kind()) || which.generation != stream.generation ||
      which.number != stream.number)
    return;
  std::size_t most = kMostPieces;
  for (BridgeGap gap; most > 0 && take(gaps, gap);) {
    const std::size_t end = std::min<std::size_t>(std::size_t{gap.first} + gap.count, stream.next_piece);
    for (std::size_t piece = gap.first; piece < end && most > 0; ++piece, --most) {
      send_piece(which.stream, piece, send);
      ++counters_.repeated;
    }
  }
}

}  // namespace roborun::sensor_port
