/// DroneCAN frames of any number of senders. Frames come raw, or as those of a good transfer of which some are left out, sent
/// twice or damaged: random frames alone never pass a transfer's CRC.
/// Oracle: what is delivered, split again, is a sequence of frames that came in this order, from its start frame to now; and a
/// payload that a message accepts is the same message after it was written and read again.
#include <array>
#include <vector>

#include "firmware_if/dronecan/transfer.hpp"
#include "tests/fuzz/fuzz.hpp"

namespace roborun::fuzz {
namespace {

namespace dc = firmware_if::dronecan;
using firmware_if::CanFrame;

constexpr std::size_t kMostFrames = 256;  ///< Of one run.

template <typename... Entries>
void read_as(const dc::Transfer& transfer, std::tuple<Entries...>* /*dictionary*/) {
  const auto check = [&]<typename Message>(Message message) {
    if (dc::decode(transfer.payload, message) != Status::kOk) return;
    std::array<std::uint8_t, dc::Reassembler::kMostPayload_bytes> once{};
    std::array<std::uint8_t, dc::Reassembler::kMostPayload_bytes> twice{};
    const auto size = dc::encode(message, once);
    require(size.ok() && size.value() <= dc::kMaxPayload_bytes<Message>, "what was read can be written");
    Message again{};
    require(dc::decode(std::span<const std::uint8_t>(once.data(), size.value()), again) == Status::kOk,
            "what was written can be read");
    const auto size_again = dc::encode(again, twice);
    require(size_again.ok() && size_again.value() == size.value() && once == twice,
            "written, read and written is written");
  };
  (check(typename Entries::Message{}), ...);
}

class Stream {
 public:
  void push(CanFrame frame) {
    now_ += Nanos{1'000'000};
    frame.stamp = now_;
    if (frames_.size() == kMostFrames) return;
    frames_.push_back(frame);
    dc::Transfer transfer;
    if (sut_.receive(frame, transfer) == dc::FrameVerdict::kDelivered) check(transfer);
    std::uint64_t verdicts = 0;
    for (const std::uint64_t count : sut_.counters().verdicts) verdicts += count;
    require(verdicts == frames_.size(), "every frame has one verdict");
    require(sut_.unfinished() <= sessions_.size(), "no more transfers than sessions");
  }
  void wait(Nanos time) { now_ += time; }

 private:
  void check(const dc::Transfer& transfer) {
    std::uint64_t signature = 0;
    for (const dc::DataType& type : dc::kAllTypes) {
      if (type.kind == transfer.header.kind && type.id == transfer.header.data_type_id)
        signature = type.signature;
    }
    std::array<CanFrame, 64> wanted{};
    const auto count = dc::split(transfer.header, signature, transfer.payload, {}, wanted);
    require(count.ok(), "what is delivered can be sent");
    // Back from the newest frame; of anonymous senders the discriminator is theirs to choose.
    std::size_t left = count.value();
    for (std::size_t i = frames_.size(); i-- > 0 && left > 0;) {
      const CanFrame& came = frames_[i];
      const CanFrame& frame = wanted.at(left - 1);
      const bool same_sender = transfer.header.source_node_id == 0
                                   ? (came.id & 0xffU) == 0 && ((came.id ^ frame.id) & 0x300U) == 0
                                   : ((came.id ^ frame.id) & 0xffffffU) == 0;
      if (same_sender && std::ranges::equal(came.bytes(), frame.bytes())) {
        --left;
        require(left > 0 || came.stamp == transfer.stamp || count.value() > 1,
                "the stamp is that of a frame");
      }
    }
    require(left == 0, "nothing is delivered that was not sent");
    read_as(transfer, static_cast<dc::Dictionary*>(nullptr));
  }

  std::array<dc::Reassembler::Session, 6> sessions_{};
  dc::Reassembler sut_{dc::kAllTypes, sessions_, 42};
  std::vector<CanFrame> frames_;
  MonotonicTime now_{};
};

void push_raw(Choices& choices, Stream& stream) {
  CanFrame frame;
  frame.id = choices.number<std::uint32_t>() & 0x1fffffffU;
  if (const std::uint8_t type = choices.byte(); type < dc::kAllTypes.size())
    frame.id = dc::to_can_id({.kind = dc::kAllTypes.at(type).kind,
                              .data_type_id = dc::kAllTypes.at(type).id,
                              .source_node_id = static_cast<std::uint8_t>(frame.id & 0x7fU),
                              .destination_node_id = 42});
  frame.size = choices.byte();  // more than 8 is not for a bus to give, but nothing here knows the bus
  std::ranges::copy(choices.take(frame.data.size()), frame.data.begin());
  stream.push(frame);
}

void push_transfer(Choices& choices, Stream& stream) {
  const dc::DataType& type = dc::kAllTypes.at(choices.byte() % dc::kAllTypes.size());
  const bool service = type.kind != dc::TransferKind::kMessage;
  const dc::TransferHeader header{.kind = type.kind,
                                  .data_type_id = type.id,
                                  .source_node_id = static_cast<std::uint8_t>(choices.byte() % 128U),
                                  .destination_node_id = static_cast<std::uint8_t>(service ? 42 : 0),
                                  .priority = 16,
                                  .transfer_id = static_cast<std::uint8_t>(choices.byte() % 32U)};
  std::array<CanFrame, 64> frames{};
  const auto count = dc::split(header, type.signature, choices.take(choices.byte()), {}, frames);
  if (!count.ok()) return;
  const std::uint8_t deed = choices.byte();
  const std::size_t at = choices.byte() % count.value();
  for (std::size_t i = 0; i < count.value(); ++i) {
    CanFrame frame = frames.at(i);
    if (deed == 1 && i == at) continue;
    if (deed == 2 && i == at) stream.push(frame);
    if (deed == 3 && i == at) frame.data.at(choices.byte() % 8U) ^= choices.byte();
    if (deed == 4 && i == at) frame.size = choices.byte();
    if (deed == 5 && i == at) stream.wait(Nanos{choices.number<std::uint32_t>()});
    if (deed == 6 && i == at) push_raw(choices, stream);
    stream.push(frame);
  }
}

}  // namespace
}  // namespace roborun::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace roborun::fuzz;
  Choices choices(data, size);
  Stream stream;
  while (!choices.empty()) {
    if (choices.byte() % 2U == 0) {
      push_raw(choices, stream);
    } else {
      push_transfer(choices, stream);
    }
  }
  return 0;
}
