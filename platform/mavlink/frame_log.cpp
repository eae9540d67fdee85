#include "platform/mavlink/frame_log.hpp"

#include <algorithm>
#include <array>
#include <vector>

namespace roborun::mavlink {
namespace {

namespace mav = firmware_if::mavlink;
using mav::Event;
using mav::FrameState;

constexpr std::size_t kBlock_bytes = 1U << 16U;
constexpr std::size_t kTime_bytes = 8;

/// The bytes of a file, a window at a time.
class Window {
 public:
  explicit Window(input::InputFile& file) : file_(file) {}
  /// At least `wanted` bytes from here on, fewer only at the end.
  std::span<const std::uint8_t> view(std::size_t wanted) {
    if (bytes_.size() - at_ < wanted && !ended_) {
      bytes_.erase(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(at_));
      at_ = 0;
      std::array<char, kBlock_bytes> block;  // NOLINT(*-member-init): read() fills what is used
      const std::size_t count = file_.read(block);
      std::transform(block.begin(), block.begin() + count, std::back_inserter(bytes_),
                     [](char c) { return static_cast<std::uint8_t>(c); });
      ended_ = count < block.size();
    }
    return std::span(bytes_).subspan(at_);
  }
  void advance(std::size_t count) { at_ += count; }

 private:
  input::InputFile& file_;
  std::vector<std::uint8_t> bytes_;
  std::size_t at_{0};
  bool ended_{false};
};

std::uint64_t time_of(std::span<const std::uint8_t> record) {
  std::uint64_t time_us = 0;
  for (const std::uint8_t byte : record.first<kTime_bytes>()) time_us = (time_us << 8U) | byte;
  return time_us;
}

}  // namespace

mav::Receiver::Counters read_stream(input::InputFile& file, mav::Verifier* verifier,
                                    const FrameVisit& visit) {
  Window window(file);
  mav::Receiver receiver(verifier);
  mav::Frame frame;
  const auto drain = [&] {
    for (Event event = receiver.next(frame); event != Event::kNothing; event = receiver.next(frame))
      visit(event, frame, std::nullopt);
  };
  for (auto bytes = window.view(1); !bytes.empty(); bytes = window.view(1)) {
    window.advance(receiver.push(bytes));
    drain();
  }
  receiver.give_up();
  drain();
  return receiver.counters();
}

mav::Receiver::Counters read_tlog(input::InputFile& file, mav::Verifier* verifier, const FrameVisit& visit) {
  Window window(file);
  mav::Receiver receiver(verifier);
  mav::Frame frame;
  std::size_t garbage_bytes = 0;
  std::array<std::size_t, mav::kEventCount> damaged{};
  bool in_step = true;  // a record ended here
  for (auto bytes = window.view(kTime_bytes + mav::kMostFrame_bytes); !bytes.empty();
       bytes = window.view(kTime_bytes + mav::kMostFrame_bytes)) {
    FrameState state = FrameState::kNoStart;
    if (bytes.size() > kTime_bytes && bytes[0] == 0)
      state = mav::read_frame(bytes.subspan(kTime_bytes), frame);
    const bool whole = state == FrameState::kComplete || (in_step && state == FrameState::kUnknownId);
    if (!whole) {
      if (in_step && state == FrameState::kBadCrc) ++damaged[static_cast<std::size_t>(Event::kBadCrc)];
      if (in_step && state == FrameState::kBadFlags) ++damaged[static_cast<std::size_t>(Event::kBadFlags)];
      if (in_step && state == FrameState::kNeedsMore) ++damaged[static_cast<std::size_t>(Event::kCut)];
      in_step = false;
      ++garbage_bytes;
      window.advance(1);
      continue;
    }
    in_step = true;
    const std::uint64_t time_us = time_of(bytes);
    const std::size_t record_bytes = kTime_bytes + frame.bytes.size();
    (void)receiver.push(frame.bytes);  // one whole frame into an empty receiver
    const Event event = receiver.next(frame);
    visit(event, frame, time_us);
    window.advance(record_bytes);
  }
  mav::Receiver::Counters counters = receiver.counters();
  counters.garbage_bytes += garbage_bytes;
  for (std::size_t i = 0; i < damaged.size(); ++i) counters.events.at(i) += damaged.at(i);
  return counters;
}

}  // namespace roborun::mavlink
