/// Frames that the public reference implementation made: ours must be the same, bit for bit, both ways.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "firmware_if/dronecan/transfer.hpp"
#include "platform/can/message_json.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::firmware_if::dronecan {
namespace {

using Json = nlohmann::ordered_json;

Json vectors() {
  std::ifstream in(ROBORUN_TEST_DATA "/dronecan_vectors.json");
  return Json::parse(in).at("vectors");
}

TransferHeader header_of(const Json& v) {
  TransferHeader header;
  header.data_type_id = v.at("data_type_id");
  header.source_node_id = v.at("source_node_id");
  header.priority = v.at("priority");
  header.transfer_id = v.at("transfer_id");
  return header;
}

CanFrame frame_of(const Json& f) {
  CanFrame frame;
  frame.id = static_cast<std::uint32_t>(std::stoul(f.at("id").get<std::string>(), nullptr, 16));
  const auto data = f.at("data").get<std::string>();
  frame.size = static_cast<std::uint8_t>(data.size() / 2);
  for (std::size_t i = 0; i < frame.size; ++i)
    frame.data.at(i) = static_cast<std::uint8_t>(std::stoul(data.substr(2 * i, 2), nullptr, 16));
  return frame;
}

TEST(GoldenVectors, EncodeBitForBit) {
  int checked = 0;
  for (const Json& v : vectors()) {
    const DataType* type = can::find_type(v.at("type"), TransferKind::kMessage);
    ASSERT_NE(type, nullptr) << v.at("type");
    EXPECT_EQ(type->id, v.at("data_type_id"));
    EXPECT_EQ(fmt::format("{:016x}", type->signature), v.at("signature"));
    const std::vector<std::uint8_t> payload = can::from_json(*type, v.at("fields"));
    std::array<CanFrame, CanBus::kMostFrames> frames;
    auto count = split(header_of(v), type->signature, payload, {}, frames);
    ASSERT_TRUE(count.ok());
    ASSERT_EQ(count.value(), v.at("frames").size()) << v.dump();
    for (std::size_t i = 0; i < count.value(); ++i) {
      const CanFrame wanted = frame_of(v.at("frames")[i]);
      EXPECT_EQ(frames.at(i).id, wanted.id);
      EXPECT_EQ(frames.at(i).size, wanted.size);
      EXPECT_EQ(frames.at(i).data, wanted.data) << v.dump();
    }
    ++checked;
  }
  EXPECT_EQ(checked, 126);
}

TEST(GoldenVectors, DecodeToTheSameFields) {
  int checked = 0;
  std::vector<Reassembler::Session> sessions(256);
  Reassembler sut(kAllTypes, sessions, 0);
  for (const Json& v : vectors()) {
    Transfer transfer;
    FrameVerdict verdict = FrameVerdict::kMalformed;
    for (const Json& f : v.at("frames")) {
      EXPECT_NE(verdict, FrameVerdict::kDelivered);
      verdict = sut.receive(frame_of(f), transfer);
    }
    ASSERT_EQ(verdict, FrameVerdict::kDelivered) << v.dump();
    EXPECT_EQ(transfer.header, header_of(v));
    const DataType* type = can::find_type(v.at("type"), TransferKind::kMessage);
    Json got = can::to_json(*type, transfer.payload);
    // The order of the fields is not part of the vectors.
    EXPECT_EQ(nlohmann::json(got), nlohmann::json(v.at("fields")));
    ++checked;
  }
  EXPECT_EQ(checked, 126);
}

TEST(GoldenVectors, EncodingARawCommandDoesNotAllocate) {
  EscRawCommand command;
  for (std::int16_t i = 0; i < 4; ++i) ASSERT_TRUE(command.cmd.push_back(i));
  std::array<std::uint8_t, kMaxPayload_bytes<EscRawCommand>> payload{};
  std::array<CanFrame, 1> frame;
  const test::NoAllocScope scope;
  auto size = encode(command, payload);
  auto count = split({.data_type_id = 1030, .source_node_id = 1}, kType<EscRawCommand>.signature,
                     std::span<const std::uint8_t>(payload).first(size.value()), {}, frame);
  EXPECT_EQ(count.value(), 1U);
  EXPECT_EQ(scope.count(), 0U);
}

TEST(Codec, SaturatesIntegersBeyondTheirRange) {
  EscRawCommand command;
  ASSERT_TRUE(command.cmd.push_back(32767));
  ASSERT_TRUE(command.cmd.push_back(-32768));
  std::array<std::uint8_t, 8> payload{};
  auto size = encode(command, payload);
  ASSERT_TRUE(size.ok());
  EscRawCommand back;
  EXPECT_EQ(decode(std::span<const std::uint8_t>(payload).first(size.value()), back), Status::kOk);
  EXPECT_EQ(back.cmd.items[0], 8191);
  EXPECT_EQ(back.cmd.items[1], -8192);
}

TEST(Codec, RefusesEveryLengthThatIsNotThatOfTheType) {
  // A NodeStatus is 56 bits: 7 bytes and nothing else.
  std::array<std::uint8_t, 16> bytes{};
  NodeStatus message;
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    EXPECT_EQ(decode(std::span<const std::uint8_t>(bytes).first(n), message) == Status::kOk, n == 7);
  }
}

TEST(Codec, RefusesMoreItemsThanTheArrayHolds) {
  std::array<std::uint8_t, 64> bytes{};
  EscRawCommand message;  // 20 items of 14 bits: 35 bytes; 36 bytes are 20 items and a whole byte too many.
  EXPECT_EQ(decode(std::span<const std::uint8_t>(bytes).first(35), message), Status::kOk);
  EXPECT_EQ(message.cmd.count, 20);
  EXPECT_EQ(decode(std::span<const std::uint8_t>(bytes).first(36), message), Status::kInvalidArgument);
  EXPECT_EQ(decode(std::span<const std::uint8_t>(bytes).first(37), message), Status::kInvalidArgument);
}

TEST(Codec, SaysWhenTheMemoryIsTooSmall) {
  NodeStatus message;
  std::array<std::uint8_t, 6> bytes{};
  EXPECT_EQ(encode(message, bytes).status(), Status::kCapacity);
}

TEST(Codec, RoundTripsNestedArraysAndServices) {
  const Json fix = Json::parse(R"({"ecef_position_velocity":[{"velocity_xyz":[1.5,-2.5,0.25],
      "position_xyz_mm":[-34359738368,34359738367,7],"covariance":[0.5]}],"pdop":1.5,"status":3})");
  const DataType& type = kType<GnssFix2>;
  const Json back = can::to_json(type, can::from_json(type, fix));
  EXPECT_EQ(back.at("ecef_position_velocity"), fix.at("ecef_position_velocity"));
  EXPECT_EQ(back.at("status"), 3);
  const Json info =
      Json::parse(R"({"name":"org.r\u00e9gie","software_version":{"image_crc":18446744073709551615},
      "hardware_version":{"certificate_of_authenticity":[1,2,3]}})");
  const DataType& response = kType<GetNodeInfoResponse>;
  const Json answer = can::to_json(response, can::from_json(response, info));
  EXPECT_EQ(answer.at("name"), info.at("name"));
  EXPECT_EQ(answer.at("software_version").at("image_crc"), 18446744073709551615ULL);
  EXPECT_EQ(answer.at("hardware_version").at("certificate_of_authenticity"), Json::parse("[1,2,3]"));
}

}  // namespace
}  // namespace roborun::firmware_if::dronecan
