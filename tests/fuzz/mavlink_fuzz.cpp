/// A stream of MAVLink bytes, raw and in good frames (checksums and signatures are right by themselves), in pieces of any size.
/// Oracle: the same bytes in one piece and in many give the same frames; a frame that is acted upon is one that was sent, and
/// written as JSON and back it is the same.
#include <array>
#include <vector>

#include "firmware_if/mavlink/dictionary.hpp"
#include "firmware_if/mavlink/receiver.hpp"
#include "platform/mavlink/message_json.hpp"
#include "tests/fuzz/fuzz.hpp"

namespace roborun::fuzz {
namespace {

namespace mav = firmware_if::mavlink;

constexpr mav::SigningTime kClock = 100'000'000;
constexpr mav::SigningKey kKey{1, 2, 3};

/// All events of a stream that comes in pieces of so many bytes.
std::vector<std::vector<std::uint8_t>> read(std::span<const std::uint8_t> bytes, std::size_t piece,
                                            bool demands_signature) {
  std::array<mav::Verifier::Stream, 4> streams{};
  mav::Verifier verifier(kKey, streams, kClock);
  mav::Receiver receiver(demands_signature ? &verifier : nullptr);
  std::vector<std::vector<std::uint8_t>> seen;
  mav::Frame frame;
  std::size_t events = 0;
  const auto drain = [&] {
    for (mav::Event event = receiver.next(frame); event != mav::Event::kNothing;
         event = receiver.next(frame)) {
      require(++events <= bytes.size(), "no more events than bytes");
      seen.push_back({static_cast<std::uint8_t>(event)});
      if (event != mav::Event::kFrame) continue;
      require(frame.type != nullptr && frame.is_authenticated == demands_signature,
              "a frame is known and checked");
      seen.back().insert(seen.back().end(), frame.bytes.begin(), frame.bytes.end());
    }
  };
  for (std::span<const std::uint8_t> left = bytes; !left.empty();) {
    const std::size_t taken = receiver.push(left.first(std::min(piece, left.size())));
    require(taken > 0, "there is always room for a byte");
    left = left.subspan(taken);
    drain();
  }
  receiver.give_up();
  drain();
  return seen;
}

void through_json(std::span<const std::uint8_t> bytes) {
  mav::Frame frame;
  require(mav::read_frame(bytes, frame) == mav::FrameState::kComplete, "a frame can be read again");
  const auto json = mavlink::to_json(frame);
  const std::vector<std::uint8_t> once = mavlink::from_json(json, 0, nullptr);
  require(mav::read_frame(once, frame) == mav::FrameState::kComplete, "JSON gives a frame");
  require(mavlink::to_json(frame) == json, "a frame is the same behind JSON");
}

std::vector<std::uint8_t> stream_of(Choices& choices) {
  mav::Signer signer(kKey, 1, kClock);
  std::vector<std::uint8_t> bytes;
  while (!choices.empty() && bytes.size() < 8192) {
    const std::uint8_t what = choices.byte();
    if (what % 2U == 0) {
      const auto raw = choices.take(what / 2U);
      bytes.insert(bytes.end(), raw.begin(), raw.end());
      continue;
    }
    const mav::MessageType& type = mav::kAllMessages.at(choices.byte() % mav::kAllMessages.size());
    const mav::FrameHeader header{choices.byte(), choices.byte(), choices.byte()};
    mav::Payload payload{};
    std::ranges::copy(choices.take(type.max_bytes), payload.begin());
    std::array<std::uint8_t, mav::kMostFrame_bytes> out{};
    const auto size =
        (what & 2U) != 0 ? mav::write_frame_v1(type, header, payload, out)
                         : mav::write_frame(type, header, payload, (what & 4U) != 0 ? &signer : nullptr, out);
    if (!size.ok()) continue;
    if ((what & 8U) != 0) out.at(choices.byte() % size.value()) ^= choices.byte();
    const std::size_t kept = (what & 16U) != 0 ? choices.byte() % size.value() : size.value();
    bytes.insert(bytes.end(), out.begin(), out.begin() + static_cast<std::ptrdiff_t>(kept));
  }
  return bytes;
}

}  // namespace
}  // namespace roborun::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace roborun::fuzz;
  Choices choices(data, size);
  const std::uint8_t first = choices.byte();
  const bool demands_signature = first % 2U == 1;
  const std::vector<std::uint8_t> bytes = stream_of(choices);
  const auto seen = read(bytes, bytes.size(), demands_signature);
  require(seen == read(bytes, first / 2U + 1U, demands_signature), "pieces change nothing");
  for (const auto& event : seen) {
    if (event.size() > 1) through_json(std::span(event).subspan(1));
  }
  return 0;
}
