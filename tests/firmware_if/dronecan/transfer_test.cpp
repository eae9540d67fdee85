/// Headers, identifiers and frames of whole transfers, and whose of them are heard. What becomes of damaged ones: reassembly_test.
#include "firmware_if/dronecan/transfer.hpp"

#include <gtest/gtest.h>

#include <array>
#include <span>
#include <vector>

#include "tests/firmware_if/dronecan/frames.hpp"

namespace roborun::firmware_if::dronecan {
namespace {

using std::chrono::milliseconds;

/// A message, a request with its number, and one that may be said without a node id.
constexpr std::array<DataType, 3> kMixed{DataType{"test.Message", TransferKind::kMessage, 1, 0x1111, 30},
                                         DataType{"test.Request", TransferKind::kRequest, 1, 0x2222, 30},
                                         DataType{"test.Long", TransferKind::kMessage, 2000, 0x3333, 500}};
struct Node10 {
  std::vector<Reassembler::Session> sessions = std::vector<Reassembler::Session>(4);
  Reassembler sut{kMixed, sessions, 10};
  Transfer transfer;

  /// The verdict on the last of its frames.
  FrameVerdict operator()(const TransferHeader& header, std::uint64_t signature, std::size_t bytes) {
    std::vector<std::uint8_t> payload(bytes, 5);
    std::vector<CanFrame> frames(80);
    const auto count = split(header, signature, payload, MonotonicTime{milliseconds{5}}, frames);
    EXPECT_TRUE(count.ok());
    FrameVerdict verdict = FrameVerdict::kMalformed;
    for (std::size_t i = 0; i < count.value(); ++i) verdict = sut.receive(frames[i], transfer);
    return verdict;
  }
};

TEST(Transfer, HearsServicesForItsOwnNodeAlone) {
  const TransferHeader request{TransferKind::kRequest, 1, 20, 10, 16, 3};
  Node10 node;
  EXPECT_EQ(node(request, 0x2222, 20), FrameVerdict::kDelivered) << "not the message of that number";
  EXPECT_EQ(node.transfer.header, request);
  TransferHeader of_another = request;
  of_another.destination_node_id = 11;
  EXPECT_EQ(node(of_another, 0x2222, 20), FrameVerdict::kNotOurs);
  EXPECT_EQ(node({TransferKind::kMessage, 1, 20, 0, 16, 3}, 0x1111, 20), FrameVerdict::kDelivered);
  Node10 monitor;
  Reassembler all{kMixed, monitor.sessions, 0};
  std::array<CanFrame, 1> frame;
  ASSERT_TRUE(split(of_another, 0x2222, std::array<std::uint8_t, 2>{1, 2}, {}, frame).ok());
  EXPECT_EQ(all.receive(frame[0], monitor.transfer), FrameVerdict::kDelivered);
}

TEST(Transfer, HearsAnonymousMessagesOfOneFrameAlone) {
  Node10 node;
  EXPECT_EQ(node({TransferKind::kMessage, 1, 0, 0, 30, 9}, 0x1111, 4), FrameVerdict::kDelivered);
  EXPECT_EQ(node.transfer.header.transfer_id, 9);
  EXPECT_EQ(node.transfer.header.source_node_id, 0);
  EXPECT_EQ(node.transfer.stamp, MonotonicTime{milliseconds{5}});
  EXPECT_EQ(node.transfer.payload.size(), 4U);
  EXPECT_EQ(node.transfer.payload[3], 5U);
  EXPECT_EQ(node.sut.unfinished(), 0U);
  std::array<CanFrame, 1> frame;
  ASSERT_TRUE(
      split({TransferKind::kMessage, 1, 0, 0, 30, 9}, 0, std::array<std::uint8_t, 2>{1, 2}, {}, frame).ok());
  for (const unsigned tail : {0x89U, 0x49U, 0x09U, 0xe9U, 0xa9U, 0x69U, 0x29U})
    EXPECT_EQ(node.sut.receive(test::with_tail(frame[0], tail), node.transfer), FrameVerdict::kMalformed)
        << tail;
  CanFrame service = frame[0];
  service.id = to_can_id({TransferKind::kRequest, 1, 0, 10, 16, 0});
  EXPECT_EQ(node.sut.receive(service, node.transfer), FrameVerdict::kMalformed) << "nobody to answer";
}

TEST(Transfer, KeepsNoMoreThanASessionHolds) {
  Node10 node;
  EXPECT_EQ(node({TransferKind::kMessage, 2000, 20, 0, 16, 3}, 0x3333, Reassembler::kMostPayload_bytes),
            FrameVerdict::kDelivered);
  EXPECT_NE(node({TransferKind::kMessage, 2000, 20, 0, 16, 4}, 0x3333, Reassembler::kMostPayload_bytes + 1),
            FrameVerdict::kDelivered);
  using enum FrameVerdict;
  EXPECT_EQ(node.sut.counters().verdicts[static_cast<std::size_t>(kTooLong)], 1U);
}

TEST(CanId, RoundTripsEveryHeader) {
  int checked = 0;
  for (std::uint32_t type = 0; type <= 0xffff; type += 37) {
    for (std::uint8_t source = 1; source <= 127; source = static_cast<std::uint8_t>(source + 6)) {
      const TransferHeader header{.data_type_id = static_cast<std::uint16_t>(type),
                                  .source_node_id = source,
                                  .priority = static_cast<std::uint8_t>(type % 32)};
      EXPECT_EQ(from_can_id(to_can_id(header)), header);
      const TransferHeader service{TransferKind::kRequest,
                                   static_cast<std::uint16_t>(type % 256),
                                   source,
                                   static_cast<std::uint8_t>(type % 127 + 1),
                                   3,
                                   0};
      EXPECT_EQ(from_can_id(to_can_id(service)), service);
      ++checked;
    }
  }
  EXPECT_GT(checked, 30'000);
}

TEST(Split, RefusesAHeaderThatNoIdentifierHolds) {
  const std::array<std::uint8_t, 3> payload{1, 2, 3};
  std::array<CanFrame, 4> frames;
  const TransferHeader good{TransferKind::kMessage, 1034, 10, 0, 16, 3};
  const auto fits = [&](const TransferHeader& header) {
    return split(header, 0x1234, payload, MonotonicTime{}, frames).ok();
  };
  ASSERT_TRUE(fits(good));
  TransferHeader bad = good;
  bad.source_node_id = 128;
  EXPECT_FALSE(fits(bad));
  bad = good;
  bad.priority = 32;
  EXPECT_FALSE(fits(bad));
  bad = good;
  bad.transfer_id = 32;
  EXPECT_FALSE(fits(bad));
  bad = good;
  bad.destination_node_id = 9;
  EXPECT_FALSE(fits(bad)) << "a message is for all";
  bad = good;
  bad.source_node_id = 0;
  EXPECT_FALSE(fits(bad)) << "anonymous, and its type needs more than two bits";
  bad.data_type_id = 3;
  EXPECT_TRUE(fits(bad));
  const TransferHeader request{TransferKind::kRequest, 1, 10, 20, 16, 3};
  ASSERT_TRUE(fits(request));
  bad = request;
  bad.destination_node_id = 0;
  EXPECT_FALSE(fits(bad));
  bad = request;
  bad.data_type_id = 256;
  EXPECT_FALSE(fits(bad));
  bad.data_type_id = 255;
  EXPECT_TRUE(fits(bad));
  bad = request;
  bad.source_node_id = 0;
  EXPECT_FALSE(fits(bad)) << "nobody to answer";
  bad = request;
  bad.destination_node_id = 128;
  EXPECT_FALSE(fits(bad));
  bad.destination_node_id = 127;
  EXPECT_TRUE(fits(bad));
  bad = good;
  bad.source_node_id = 0;
  bad.data_type_id = 4;
  EXPECT_EQ(split(bad, 0x1234, payload, MonotonicTime{}, frames).status(), Status::kInvalidArgument);
}

TEST(Split, WritesItsFramesAndNoOther) {
  const std::array<std::uint8_t, 12> payload{1, 2, 3, 4,  5,  6,
                                             7, 8, 9, 10, 11, 12};  // two whole frames with the CRC
  const TransferHeader header{TransferKind::kMessage, 1034, 10, 0, 16, 3};
  const MonotonicTime stamp{milliseconds{7}};
  std::array<CanFrame, 3> frames;
  frames[2].size = 5;
  ASSERT_EQ(split(header, 0x1234, payload, stamp, frames).value(), 2U);
  EXPECT_EQ(frames[0].stamp, stamp);
  EXPECT_EQ(frames[1].stamp, stamp);
  EXPECT_EQ(frames[2].size, 5U);
  EXPECT_EQ(split(header, 0x1234, payload, stamp, std::span(frames).first(1)).status(), Status::kCapacity);
  EXPECT_EQ(split(header, 0x1234, payload, stamp, {}).status(), Status::kCapacity);
  const auto few = std::span(payload).first(2);
  EXPECT_EQ(split(header, 0x1234, few, stamp, {}).status(), Status::kCapacity);
  ASSERT_EQ(split(header, 0x1234, few, stamp, frames).value(), 1U);
  EXPECT_EQ(frames[0].stamp, stamp);
  EXPECT_EQ(frames[0].id, to_can_id(header));
}

TEST(Split, AnonymousSendersOfDifferentWordsHaveDifferentIds) {
  const TransferHeader header{TransferKind::kMessage, 1, 0, 0, 30, 3};
  const std::array<std::uint8_t, 8> payload{1, 2, 3};
  std::array<CanFrame, 4> frames;
  const auto few = std::span(payload).first(3);
  ASSERT_TRUE(split(header, 0x1234, few, {}, frames).ok());
  EXPECT_EQ(frames[0].id, to_can_id(header, crc16(few)));
  EXPECT_NE(frames[0].id, to_can_id(header));
  EXPECT_EQ(split(header, 0x1234, payload, {}, frames).status(), Status::kInvalidArgument) << "two frames";
}

}  // namespace
}  // namespace roborun::firmware_if::dronecan
