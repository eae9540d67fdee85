/// Typed access, lengths at their limits, SHA-256, and the rules of signing.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string_view>

#include "firmware_if/mavlink/flight_messages.hpp"
#include "firmware_if/sha256.hpp"
#include "tests/firmware_if/mavlink/vectors.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::firmware_if::mavlink {
namespace {

using FrameBytes = std::array<std::uint8_t, kMostFrame_bytes>;
using Block = std::array<std::uint8_t, kSignatureBlock_bytes>;

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};  // NOLINT(*-reinterpret-cast)
}

// ---- typed access

TEST(MavlinkTyped, ReadsBackWhatItWrote) {
  SetPositionTargetLocalNed sut;
  sut.time_boot_ms = 4'000'000'000U;
  sut.coordinate_frame = 1;
  sut.type_mask = 0x9c0;
  sut.x = -1.5F;
  sut.z = -std::numeric_limits<float>::infinity();
  sut.yaw = std::numeric_limits<float>::denorm_min();
  const Payload payload = pack(sut);
  const auto back = unpack<SetPositionTargetLocalNed>(payload);
  EXPECT_EQ(back.time_boot_ms, 4'000'000'000U);
  EXPECT_EQ(back.coordinate_frame, 1);
  EXPECT_EQ(back.type_mask, 0x9c0);
  EXPECT_EQ(back.x, -1.5F);
  EXPECT_EQ(back.z, -std::numeric_limits<float>::infinity());
  EXPECT_EQ(back.yaw, std::numeric_limits<float>::denorm_min());
}

TEST(MavlinkTyped, PutsFieldsWhereTheDefinitionHasThem) {
  // Wire order of HEARTBEAT: custom_mode (4 bytes), type, autopilot, base_mode, system_status, version.
  const Payload payload = pack(
      Heartbeat{.type = 18, .autopilot = 8, .base_mode = 1, .custom_mode = 0x04030201, .system_status = 4});
  EXPECT_EQ(test::to_hex(std::span(payload).first(10)), "01020304120801040300");
}

TEST(MavlinkTyped, CarriesSignedNumbersAndArrays) {
  const Timesync question{.tc1 = 0, .ts1 = std::numeric_limits<std::int64_t>::min()};
  EXPECT_EQ(unpack<Timesync>(pack(question)).ts1, std::numeric_limits<std::int64_t>::min());
  Odometry odometry;
  odometry.quality = -1;
  odometry.velocity_covariance[20] = 2.5F;
  odometry.pose_covariance[0] = std::numeric_limits<float>::quiet_NaN();
  const auto back = unpack<Odometry>(pack(odometry));
  EXPECT_EQ(back.quality, -1);
  EXPECT_EQ(back.velocity_covariance[20], 2.5F);
  EXPECT_TRUE(std::isnan(back.pose_covariance[0]));
}

TEST(MavlinkTyped, TakesWhatIsMissingAsZeroAndLeavesOutWhatItDoesNotKnow) {
  CommandAck ack{.command = 400, .result = 0xff, .result_param2 = 0x01020304};
  Payload payload = pack(ack);
  EXPECT_EQ(unpack<CommandAck>(std::span(payload).first(1)).command, 400 & 0xff);
  EXPECT_EQ(unpack<CommandAck>(std::span(payload).first(0)).result, 0);
  // Cut in the middle of result_param2 (bytes 4 .. 7): its high bytes were zeros, says the sender.
  EXPECT_EQ(unpack<CommandAck>(std::span(payload).first(6)).result_param2, 0x0304);
  payload.fill(0xff);
  EXPECT_EQ(unpack<CommandAck>(payload).target_component, 0xff);
}

// ---- frames

TEST(MavlinkFrame, NeverCutsTheFirstByteOfThePayload) {
  FrameBytes out{};
  EXPECT_EQ(write_frame(kPing, {}, Payload{}, nullptr, out).value(), kHeader2_bytes + 1 + kCrc_bytes);
}

TEST(MavlinkFrame, SaysWhenTheMemoryIsTooSmallAndSpendsNoTimeStamp) {
  Payload payload{};
  payload[13] = 1;  // the last byte of PING
  FrameBytes out{};
  Signer signer(test::key(), 1, 1000);
  const std::size_t needed = kHeader2_bytes + 14 + kCrc_bytes;
  EXPECT_EQ(write_frame(kPing, {}, payload, nullptr, std::span(out).first(needed - 1)).status(),
            Status::kCapacity);
  EXPECT_TRUE(write_frame(kPing, {}, payload, nullptr, std::span(out).first(needed)).ok());
  EXPECT_EQ(write_frame(kPing, {}, payload, &signer, std::span(out).first(needed + kSignatureBlock_bytes - 1))
                .status(),
            Status::kCapacity);
  EXPECT_EQ(signer.clock(), 1000U);
  EXPECT_TRUE(
      write_frame(kPing, {}, payload, &signer, std::span(out).first(needed + kSignatureBlock_bytes)).ok());
  EXPECT_EQ(signer.clock(), 1001U);
  EXPECT_EQ(write_frame_v1(kPing, {}, payload, std::span(out).first(6 + 14 + 1)).status(), Status::kCapacity);
  EXPECT_EQ(write_frame_v1(kObstacleDistance, {}, payload, out).status(), Status::kInvalidArgument);
}

TEST(MavlinkFrame, SendingAndReceivingDoNotAllocate) {
  std::array<Verifier::Stream, 1> streams{};
  Verifier verifier(test::key(), streams, 0);
  Receiver receiver(&verifier);
  Signer signer(test::key(), 1, 1);
  FrameBytes out{};
  int got = 0;
  const ::roborun::test::NoAllocScope scope;
  for (std::uint8_t i = 0; i < 10; ++i) {
    auto length = write_frame(Heartbeat::kType, {.seq = i, .sysid = 1, .compid = 191},
                              pack(Heartbeat{.custom_mode = i}), &signer, out);
    (void)receiver.push(std::span<const std::uint8_t>(out).first(length.value()));
    Frame frame;
    while (receiver.next(frame) == Event::kFrame) {
      if (unpack<Heartbeat>(frame.payload).custom_mode == i) ++got;
    }
  }
  EXPECT_EQ(scope.count(), 0U);
  EXPECT_EQ(got, 10);
}

TEST(MavlinkReceiver, FindsWhatAFalseStartByteHidOnceItGivesUp) {
  FrameBytes out{};
  auto length = write_frame(Heartbeat::kType, {}, pack(Heartbeat{.custom_mode = 7}), nullptr, out);
  const std::array<std::uint8_t, 2> false_start{kStart1, 200};  // waits for 208 bytes
  Receiver sut;
  Frame frame;
  (void)sut.push(false_start);
  (void)sut.push(std::span<const std::uint8_t>(out).first(length.value()));
  EXPECT_EQ(sut.next(frame), Event::kNothing);
  sut.give_up();
  EXPECT_EQ(sut.next(frame), Event::kCut);
  EXPECT_EQ(sut.next(frame), Event::kFrame);
  EXPECT_EQ(sut.next(frame), Event::kNothing);
  EXPECT_EQ(sut.counters().garbage_bytes, 2U);
  // The next bytes end it: a frame in two pieces is not torn.
  (void)sut.push(std::span<const std::uint8_t>(out).first(5));
  EXPECT_EQ(sut.next(frame), Event::kNothing);
  (void)sut.push(std::span<const std::uint8_t>(out).first(length.value()).subspan(5));
  EXPECT_EQ(sut.next(frame), Event::kFrame);
}

// ---- signing

TEST(Sha256, IsThatOfTheStandard) {
  const auto hash = [](std::string_view text) {
    Sha256 sut;
    sut.add(bytes_of(text));
    return test::to_hex(sut.finish());
  };
  // FIPS 180-4's examples: none, one and two blocks.
  EXPECT_EQ(hash(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(hash("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(hash("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
}

/// Signs with a stamp and asks the verifier.
SignatureVerdict verdict_of(Verifier& sut, std::uint8_t sysid, std::uint8_t link, SigningTime stamp) {
  Block block{};
  Signer(test::key(), link, stamp).sign(bytes_of("frame"), block);
  return sut.check(sysid, 1, bytes_of("frame"), block);
}

TEST(MavlinkSigning, TakesRisingStampsOfEachStreamAlone) {
  std::array<Verifier::Stream, 3> streams{};
  Verifier sut(test::key(), streams, 0);
  EXPECT_EQ(verdict_of(sut, 1, 1, 100), SignatureVerdict::kGood);
  EXPECT_EQ(verdict_of(sut, 1, 1, 100), SignatureVerdict::kReplayed);
  EXPECT_EQ(verdict_of(sut, 1, 1, 99), SignatureVerdict::kReplayed);
  EXPECT_EQ(verdict_of(sut, 1, 1, 101), SignatureVerdict::kGood);
  EXPECT_EQ(verdict_of(sut, 1, 2, 50), SignatureVerdict::kGood);
  EXPECT_EQ(verdict_of(sut, 2, 1, 50), SignatureVerdict::kGood);
  EXPECT_EQ(verdict_of(sut, 3, 1, 500), SignatureVerdict::kNoRoom);
  EXPECT_EQ(verdict_of(sut, 1, 2, 51), SignatureVerdict::kGood);  // the known ones go on
}

TEST(MavlinkSigning, RefusesANewStreamMoreThanAMinuteBehind) {
  constexpr SigningTime kNow = 20'000'000;
  std::array<Verifier::Stream, 2> streams{};
  Verifier sut(test::key(), streams, kNow);
  EXPECT_EQ(verdict_of(sut, 1, 1, kNow - kMostBehind - 1), SignatureVerdict::kTooOld);
  EXPECT_EQ(verdict_of(sut, 1, 1, kNow - kMostBehind), SignatureVerdict::kGood);
  // Good frames move the clock; a known stream may be as far behind as it likes.
  EXPECT_EQ(verdict_of(sut, 2, 1, kNow + kMostBehind), SignatureVerdict::kGood);
  EXPECT_EQ(sut.clock(), kNow + kMostBehind);
  EXPECT_EQ(verdict_of(sut, 1, 1, kNow - kMostBehind + 1), SignatureVerdict::kGood);
}

TEST(MavlinkSigning, IsMovedByNoForgedFrame) {
  std::array<Verifier::Stream, 1> streams{};
  Verifier sut(test::key(), streams, 1000);
  Block block{};
  SigningKey other = test::key();
  other[31] ^= 1U;
  Signer(other, 1, kMostSigningTime).sign(bytes_of("frame"), block);
  EXPECT_EQ(sut.check(1, 1, bytes_of("frame"), block), SignatureVerdict::kWrong);
  EXPECT_EQ(sut.clock(), 1000U);
  EXPECT_EQ(verdict_of(sut, 1, 1, 1000), SignatureVerdict::kGood);
}

TEST(MavlinkSigning, SeesEveryFlippedBit) {
  std::array<Verifier::Stream, 1> streams{};
  Verifier sut(test::key(), streams, 0);
  Block block{};
  Signer(test::key(), 9, 12345).sign(bytes_of("frame"), block);
  for (std::size_t bit = 0; bit < 8 * block.size(); ++bit) {
    Block flipped = block;
    flipped.at(bit / 8) ^= static_cast<std::uint8_t>(1U << (bit % 8));
    EXPECT_EQ(sut.check(1, 1, bytes_of("frame"), flipped), SignatureVerdict::kWrong) << bit;
  }
  EXPECT_EQ(sut.check(1, 1, bytes_of("frame"), block), SignatureVerdict::kGood);
}

TEST(MavlinkSigning, CountsTimeInTensOfMicrosecondsSince2015) {
  EXPECT_EQ(signing_time(1'420'070'400'000'000), 0U);
  EXPECT_EQ(signing_time(1'420'070'401'000'000), 100'000U);
  EXPECT_EQ(signing_time(0), 0U);
}

TEST(MavlinkSigning, FollowsAClockThatIsAheadAndNeverGoesBack) {
  Signer sut(test::key(), 1, 100);
  sut.advance_clock(50);
  EXPECT_EQ(sut.clock(), 100U);
  sut.advance_clock(6'000'100);
  EXPECT_EQ(sut.clock(), 6'000'100U);
}

// A radio of the SiK family: 9 bytes, the two counters first. The tables' CRC_EXTRA are checked at compile time.
TEST(MavlinkDictionary, KnowsWhatRadiosAndArduCopterSend) {
  ASSERT_EQ(find_message("RADIO_STATUS"), find_message(109));
  EXPECT_EQ(find_message(109)->max_bytes, 9);
  EXPECT_EQ(find_message(109)->fields[5].offset_bytes, 0);
  ASSERT_EQ(find_message("MISSION_REQUEST"), find_message(40));
  EXPECT_EQ(find_message(40)->min_bytes, 4);
  EXPECT_EQ(find_message(40)->max_bytes, 5);
}

}  // namespace
}  // namespace roborun::firmware_if::mavlink
