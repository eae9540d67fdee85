#include "platform/mavlink/frame_log.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "firmware_if/mavlink/flight_messages.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::mavlink {
namespace {

namespace mav = firmware_if::mavlink;
using mav::Event;

/// A SYSTEM_TIME with this time_boot_ms.
std::string frame(std::uint32_t number, mav::Signer* signer = nullptr) {
  std::array<std::uint8_t, mav::kMostFrame_bytes> out{};
  auto length = mav::write_frame(mav::SystemTime::kType, {},
                                 mav::pack(mav::SystemTime{.time_boot_ms = number}), signer, out);
  return {out.begin(), out.begin() + static_cast<std::ptrdiff_t>(length.value())};
}

/// A record of a .tlog. The time's low bytes are start bytes: they are no frames.
std::string record(std::uint32_t number) {
  std::string time("\x00\x06\x10\xfe\x05\xfd\x05\x00", 8);
  time.back() = static_cast<char>(number);
  return time + frame(number);
}

struct Heard {
  std::vector<std::uint32_t> numbers;
  std::vector<std::optional<std::uint64_t>> times_us;
  mav::Receiver::Counters counters;
  std::uint64_t count(Event event) const { return counters.events.at(static_cast<std::size_t>(event)); }
};

Heard read(const std::string& bytes, bool tlog, mav::Verifier* verifier = nullptr) {
  input::InputFile file(roborun::test::scratch_file("log", bytes), "a log");
  Heard heard;
  const FrameVisit visit = [&heard](Event event, const mav::Frame& f, std::optional<std::uint64_t> time_us) {
    if (event != Event::kFrame) return;
    heard.numbers.push_back(mav::unpack<mav::SystemTime>(f.payload).time_boot_ms);
    heard.times_us.push_back(time_us);
  };
  heard.counters = tlog ? read_tlog(file, verifier, visit) : read_stream(file, verifier, visit);
  return heard;
}

TEST(MavlinkLog, ReadsAStreamToItsEnd) {
  // A false start byte in front of the last frame: it is found when nothing more comes.
  const Heard heard = read("boot" + frame(1) + frame(2) + "\xfe\xff" + frame(3), false);
  EXPECT_EQ(heard.numbers, (std::vector<std::uint32_t>{1, 2, 3}));
  EXPECT_EQ(heard.counters.garbage_bytes, 6U);
  EXPECT_EQ(heard.count(Event::kCut), 1U);
}

TEST(MavlinkLog, ReadsAStreamLargerThanItsWindow) {
  std::string bytes;
  for (std::uint32_t i = 0; i < 10'000; ++i) bytes += frame(i);
  const Heard heard = read(bytes, false);
  ASSERT_EQ(heard.numbers.size(), 10'000U);
  EXPECT_EQ(heard.numbers.back(), 9'999U);
  EXPECT_EQ(heard.counters.garbage_bytes, 0U);
}

TEST(MavlinkLog, ReadsTheTimesOfATlog) {
  std::string bytes;
  for (std::uint32_t i = 0; i < 10'000; ++i) bytes += record(i);
  const Heard heard = read(bytes, true);
  ASSERT_EQ(heard.numbers.size(), 10'000U);
  EXPECT_EQ(heard.numbers.back(), 9'999U);
  EXPECT_EQ(heard.times_us.at(3), 0x000610fe05fd0503ULL);
  EXPECT_EQ(heard.counters.garbage_bytes, 0U);
  EXPECT_EQ(heard.count(Event::kBadCrc), 0U);
}

TEST(MavlinkLog, FindsTheNextRecordOfADamagedTlog) {
  std::string damaged = record(2);
  damaged[20] = static_cast<char>(damaged[20] ^ 1);
  const Heard heard =
      read(record(1) + damaged + record(3) + record(4).substr(4) + record(5) + record(6).substr(0, 12), true);
  EXPECT_EQ(heard.numbers, (std::vector<std::uint32_t>{1, 3, 5}));
  EXPECT_EQ(heard.count(Event::kBadCrc), 1U);
  EXPECT_EQ(heard.counters.garbage_bytes, record(2).size() + record(4).size() - 4 + 12);
}

TEST(MavlinkLog, RefusesWhatIsNotSignedWithTheKey) {
  const mav::SigningKey key{9};
  mav::Signer signer(key, 1, 100);
  mav::Signer forger(mav::SigningKey{8}, 1, 200);
  const std::string first = frame(1, &signer);
  const std::string bytes = first + frame(2) + frame(3, &forger) + first + frame(4, &signer);
  std::array<mav::Verifier::Stream, 2> streams{};
  mav::Verifier verifier(key, streams, 0);
  const Heard heard = read(bytes, false, &verifier);
  EXPECT_EQ(heard.numbers, (std::vector<std::uint32_t>{1, 4}));
  EXPECT_EQ(heard.count(Event::kUnsigned), 1U);
  EXPECT_EQ(heard.count(Event::kBadSignature), 1U);
  EXPECT_EQ(heard.count(Event::kReplayed), 1U);
  EXPECT_EQ(read(bytes, false).numbers.size(), 5U);
}

}  // namespace
}  // namespace roborun::mavlink
