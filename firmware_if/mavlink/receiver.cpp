#include "firmware_if/mavlink/receiver.hpp"

#include <algorithm>

namespace roborun::firmware_if::mavlink {

const char* to_string(Event event) noexcept {
  constexpr std::array<const char*, kEventCount> kNames{"nothing",           "frame",
                                                        "unknown id",        "unknown incompatibility flag",
                                                        "wrong checksum",    "cut short",
                                                        "not signed",        "wrong signature",
                                                        "signature not new", "no room for its sender"};
  return kNames[static_cast<std::size_t>(event)];
}

std::size_t Receiver::push(std::span<const std::uint8_t> bytes) noexcept {
  gave_up_ = false;
  if (buffer_.size() - end_ < bytes.size()) {
    std::copy(buffer_.begin() + static_cast<std::ptrdiff_t>(begin_),
              buffer_.begin() + static_cast<std::ptrdiff_t>(end_), buffer_.begin());
    end_ -= begin_;
    begin_ = 0;
  }
  const std::size_t taken = std::min(bytes.size(), buffer_.size() - end_);
  std::copy_n(bytes.begin(), taken, buffer_.begin() + static_cast<std::ptrdiff_t>(end_));
  end_ += taken;
  return taken;
}

void Receiver::skip_garbage() noexcept {
  const auto bytes = pending();
  const auto start = std::find_if(bytes.begin(), bytes.end(),
                                  [](std::uint8_t byte) { return byte == kStart1 || byte == kStart2; });
  const auto skipped = static_cast<std::size_t>(start - bytes.begin());
  begin_ += skipped;
  counters_.garbage_bytes += skipped;
}

Event Receiver::next(Frame& frame) noexcept {
  skip_garbage();
  Event event = Event::kNothing;
  switch (read_frame(pending(), frame)) {
    case FrameState::kComplete:
      event = judge(frame);
      begin_ += frame.bytes.size();
      break;
    case FrameState::kUnknownId:
      event = Event::kUnknownId;
      begin_ += frame.bytes.size();
      break;
    case FrameState::kBadFlags:
      event = Event::kBadFlags;
      break;
    case FrameState::kBadCrc:
      event = Event::kBadCrc;
      break;
    case FrameState::kNeedsMore:
    case FrameState::kNoStart:  // not behind skip_garbage()
      if (!gave_up_ || begin_ == end_) return Event::kNothing;
      event = Event::kCut;
      break;
  }
  if (event == Event::kBadFlags || event == Event::kBadCrc || event == Event::kCut) {
    ++begin_;
    ++counters_.garbage_bytes;
  }
  ++counters_.events[static_cast<std::size_t>(event)];
  return event;
}

Event Receiver::judge(Frame& frame) noexcept {
  if (verifier_ == nullptr) return Event::kFrame;
  if (!frame.has_signature) return Event::kUnsigned;
  const auto signature = frame.bytes.last<kSignatureBlock_bytes>();
  const auto rest = frame.bytes.first(frame.bytes.size() - kSignatureBlock_bytes);
  switch (verifier_->check(frame.header.sysid, frame.header.compid, rest, signature)) {
    case SignatureVerdict::kGood:
      frame.is_authenticated = true;
      return Event::kFrame;
    case SignatureVerdict::kWrong:
      return Event::kBadSignature;
    case SignatureVerdict::kReplayed:
    case SignatureVerdict::kTooOld:
      return Event::kReplayed;
    case SignatureVerdict::kNoRoom:
      return Event::kNoRoom;
  }
  return Event::kBadSignature;
}

}  // namespace roborun::firmware_if::mavlink
