/// A million random and mutated pieces, compared with a plain model of the same rules: it has the whole stream
/// at once, computes the checksum bit by bit, and keeps its own replay table. Deterministic.
#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <tuple>

#include "core/random/counter_rng.hpp"
#include "firmware_if/mavlink/dictionary.hpp"
#include "firmware_if/sha256.hpp"
#include "tests/firmware_if/mavlink/vectors.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::firmware_if::mavlink {
namespace {

using test::Bytes;
using View = std::span<const std::uint8_t>;

constexpr SigningTime kClock = 100'000'000;
constexpr std::size_t kStreams = 4;  // fewer than the generator has senders

/// An event, and which bytes it was about (of whole frames).
struct Seen {
  Event event{};
  std::uint64_t hash{};
  bool is_authenticated{};
  friend bool operator==(const Seen&, const Seen&) = default;
};

std::uint64_t hash_of(View bytes) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;  // FNV-1a
  for (const std::uint8_t byte : bytes) hash = (hash ^ byte) * 0x100000001b3ULL;
  return hash;
}

// ---- the model

class Model {
 public:
  explicit Model(bool has_key) : has_key_(has_key) {}

  std::vector<Seen> read(View all) {
    std::vector<Seen> seen;
    std::size_t at = 0;
    while (at < all.size()) {
      if (all[at] != 0xfd && all[at] != 0xfe) {
        ++at;
        continue;
      }
      const auto [event, length] = judge(all.subspan(at));
      if (event == Event::kNothing) break;
      const bool whole = length > 1;
      seen.push_back(
          {event, whole ? hash_of(all.subspan(at, length)) : 0, has_key_ && event == Event::kFrame});
      at += length;
    }
    return seen;
  }

 private:
  static std::uint16_t slow_crc(View bytes, std::uint8_t extra) {
    std::uint16_t crc = 0xffff;
    const auto add = [&crc](std::uint8_t byte) {
      for (unsigned bit = 0; bit < 8; ++bit) {
        const bool out = ((crc ^ (unsigned{byte} >> bit)) & 1U) != 0;
        crc = static_cast<std::uint16_t>((crc >> 1U) ^ (out ? 0x8408U : 0U));
      }
    };
    for (const std::uint8_t byte : bytes) add(byte);
    add(extra);
    return crc;
  }

  /// What stands at the front, and how far to go on.
  std::pair<Event, std::size_t> judge(View b) {
    const bool v2 = b[0] == 0xfd;
    const std::size_t head = v2 ? 10 : 6;
    if (v2 && b.size() >= 3 && b[2] > 1) return {Event::kBadFlags, 1};
    if (b.size() < head) return {Event::kNothing, 0};
    const bool has_signature = v2 && b[2] == 1;
    const std::size_t end = head + b[1] + 2U;
    const std::size_t length = end + (has_signature ? 13U : 0U);
    if (b.size() < length) return {Event::kNothing, 0};
    const std::uint32_t id = v2 ? b[7] + 256U * b[8] + 65536U * b[9] : b[5];
    std::optional<std::uint8_t> extra;
    for (const MessageType& type : kAllMessages) {
      if (type.id == id) extra = type.crc_extra;
    }
    if (!extra) return {Event::kUnknownId, length};
    if (slow_crc(b.subspan(1, end - 3), *extra) != b[end - 2] + 256U * b[end - 1]) return {Event::kBadCrc, 1};
    if (!has_key_) return {Event::kFrame, length};
    if (!has_signature) return {Event::kUnsigned, length};
    return {check(b.first(length)), length};
  }

  Event check(View b) {
    Sha256 sha;
    sha.add(test::key());
    sha.add(b.first(b.size() - 6));
    const Sha256::Digest digest = sha.finish();
    if (!std::equal(digest.begin(), digest.begin() + 6, b.end() - 6)) return Event::kBadSignature;
    const View block = b.last(13);
    std::uint64_t stamp = 0;
    for (std::size_t i = 6; i > 0; --i) stamp = 256 * stamp + block[i];
    const auto key = std::tuple(b[5], b[6], block[0]);
    const auto known = last_.find(key);
    if (known != last_.end() ? stamp <= known->second : stamp + 6'000'000 < clock_) return Event::kReplayed;
    if (known == last_.end() && last_.size() == kStreams) return Event::kNoRoom;
    last_[key] = stamp;
    clock_ = std::max(clock_, stamp);
    return Event::kFrame;
  }

  bool has_key_;
  std::uint64_t clock_{kClock};
  std::map<std::tuple<std::uint8_t, std::uint8_t, std::uint8_t>, std::uint64_t> last_;
};

// ---- the generator

class Pieces {
 public:
  explicit Pieces(std::uint64_t seed) : rng_(seed) {}

  /// Appends one piece: a frame, a damaged one, or garbage.
  void add(Bytes& stream) {
    switch (roll(8)) {
      case 0:
        return garbage(stream);
      case 1:
      case 2:
        return append(stream, frame());
      default:
        return append(stream, mutated(roll(4) == 0 && !earlier_.empty() ? earlier_ : frame()));
    }
  }
  std::size_t roll(std::size_t below) { return static_cast<std::size_t>(rng_.below(below)); }

 private:
  static void append(Bytes& stream, const Bytes& piece) {
    stream.insert(stream.end(), piece.begin(), piece.end());
  }
  std::uint8_t byte() { return static_cast<std::uint8_t>(roll(256)); }

  void garbage(Bytes& stream) {
    for (std::size_t n = roll(40); n > 0; --n) stream.push_back(roll(16) == 0 ? start() : byte());
  }
  std::uint8_t start() { return roll(2) == 0 ? kStart1 : kStart2; }

  /// A right one, signed with our key or another one, or not, with a stamp that rises or not. One in eight
  /// carries the last one in its payload.
  Bytes frame() {
    const MessageType& type = kAllMessages[roll(kAllMessages.size())];
    Payload payload{};
    for (std::size_t i = roll(type.max_bytes + 1U); i > 0; --i) payload[i - 1] = byte();
    if (roll(8) == 0 && earlier_.size() <= type.max_bytes)
      std::copy(earlier_.begin(), earlier_.end(), payload.begin());
    const FrameHeader header{.seq = byte(),
                             .sysid = static_cast<std::uint8_t>(roll(3)),
                             .compid = static_cast<std::uint8_t>(roll(2))};
    std::array<std::uint8_t, kMostFrame_bytes> out{};
    std::size_t length = 0;
    if (roll(8) == 0 && type.id < 256) {
      length = write_frame_v1(type, header, payload, out).value();
    } else {
      SigningKey key = test::key();
      if (roll(8) == 0) key[roll(key.size())] ^= 1U;
      stamp_ += roll(1000);
      const SigningTime back = roll(8) == 0 ? roll(8'000'000) : 0;
      Signer signer(key, static_cast<std::uint8_t>(roll(2)), stamp_ - back);
      length = write_frame(type, header, payload, roll(4) == 0 ? nullptr : &signer, out).value();
    }
    Bytes bytes(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(length));
    if (roll(4) == 0 && bytes.size() < 100) earlier_ = bytes;
    return bytes;
  }

  Bytes mutated(Bytes b) {
    switch (roll(8)) {
      case 0:
        b[roll(b.size())] ^= static_cast<std::uint8_t>(1U << roll(8));
        break;
      case 1:
        b[roll(b.size())] = byte();
        break;
      case 2:
        b.erase(b.begin() + static_cast<std::ptrdiff_t>(roll(b.size())));
        break;
      case 3:
        b.insert(b.begin() + static_cast<std::ptrdiff_t>(roll(b.size())), byte());
        break;
      case 4:
        b.resize(1 + roll(b.size()));
        break;
      case 5:
        b.insert(b.begin(), start());
        break;
      case 6:
        b[1] = byte();
        break;
      default:  // as it was: a repetition, if it is an earlier one
        break;
    }
    return b;
  }

  core::CounterRng rng_;
  SigningTime stamp_{kClock};
  Bytes earlier_;
};

// ---- both

/// `pieces` pieces in streams of 500, each fed in chunks of random length. Counts what was seen.
std::map<Event, std::size_t> compare(std::uint64_t seed, std::size_t pieces, bool has_key) {
  constexpr std::size_t kPiecesOfStream = 500;
  std::map<Event, std::size_t> counts;
  Pieces generator(seed);
  std::vector<Seen> seen;
  seen.reserve(1'000'000);
  for (std::size_t done = 0; done < pieces; done += kPiecesOfStream) {
    Bytes stream;
    for (std::size_t i = 0; i < kPiecesOfStream; ++i) generator.add(stream);
    std::array<Verifier::Stream, kStreams> streams{};
    Verifier verifier(test::key(), streams, kClock);
    Receiver sut(has_key ? &verifier : nullptr);
    seen.clear();
    const ::roborun::test::NoAllocScope scope;
    for (std::size_t at = 0; at < stream.size();) {
      const std::size_t size = std::min(1 + generator.roll(700), stream.size() - at);
      test::feed(sut, View(stream).subspan(at, size), [&seen](Event event, const Frame& frame) {
        const bool part = event == Event::kBadCrc || event == Event::kBadFlags;
        seen.push_back({event, part ? 0 : hash_of(frame.bytes), frame.is_authenticated});
      });
      at += size;
    }
    EXPECT_EQ(scope.count(), 0U);
    for (Seen& s : seen) s.is_authenticated = s.is_authenticated && s.event == Event::kFrame;
    EXPECT_TRUE(Model(has_key).read(stream) == seen) << "seed " << seed << ", stream from piece " << done;
    for (const Seen& s : seen) ++counts[s.event];
    if (::testing::Test::HasFailure()) break;
  }
  return counts;
}

TEST(MavlinkHostile, WithoutKeyIsReadAsTheModelReadsIt) {
  auto counts = compare(23, 500'000, false);
  for (const Event event : {Event::kFrame, Event::kUnknownId, Event::kBadCrc, Event::kBadFlags})
    EXPECT_GT(counts[event], 10'000U) << to_string(event);
  EXPECT_EQ(counts.size(), 4U);
}

TEST(MavlinkHostile, WithKeyNothingUnsignedForgedOrOldIsTaken) {
  auto counts = compare(24, 500'000, true);
  for (const Event event : {Event::kFrame, Event::kUnknownId, Event::kBadCrc, Event::kBadFlags,
                            Event::kUnsigned, Event::kBadSignature, Event::kReplayed, Event::kNoRoom})
    EXPECT_GT(counts[event], 5'000U) << to_string(event);
  EXPECT_EQ(counts.size(), 8U);
}

TEST(MavlinkHostile, PureNoiseGivesNoFrame) {
  core::CounterRng rng(25);
  Bytes noise(2'000'000);
  for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(rng.below(256));
  Receiver sut;
  std::size_t starts = 0;
  std::size_t frames = 0;
  test::feed(sut, noise, [&](Event event, const Frame&) {
    ++starts;
    if (event == Event::kFrame) ++frames;
  });
  EXPECT_GT(starts, 1'000U);
  EXPECT_EQ(frames, 0U);  // of this seed: one in 65,536 of the known ids would pass
}

}  // namespace
}  // namespace roborun::firmware_if::mavlink
