/// Reassembly against a second model that looks at the whole history of one sender instead of keeping state.
#include <gtest/gtest.h>

#include <array>
#include <optional>
#include <vector>

#include "firmware_if/dronecan/transfer.hpp"
#include "tests/firmware_if/dronecan/frames.hpp"
#include "tests/support/names.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::firmware_if::dronecan {
namespace {

using std::chrono::milliseconds;

constexpr std::uint64_t kSignature = 0x0123456789abcdefULL;
constexpr std::array<DataType, 1> kTypes{DataType{"test.Type", TransferKind::kMessage, 1000, kSignature, 60}};
constexpr std::uint32_t kId = 0x1003e801;

bool starts(const CanFrame& f) { return (f.data.at(f.size - 1U) & 0x80U) != 0; }
bool ends(const CanFrame& f) { return (f.data.at(f.size - 1U) & 0x40U) != 0; }
bool toggles(const CanFrame& f) { return (f.data.at(f.size - 1U) & 0x20U) != 0; }
unsigned id_of(const CanFrame& f) { return f.data.at(f.size - 1U) & 0x1fU; }
bool same(const CanFrame& a, const CanFrame& b) {
  return a.size == b.size && std::equal(a.data.begin(), a.data.begin() + a.size, b.data.begin());
}

/// Declarative: which transfer, if any, does the last frame of this history complete? All frames have at
/// least one byte, come from one sender, are of one type, and lie within 2 s.
class ReferenceModel {
 public:
  std::vector<CanFrame> history;

  /// The payload that the newest frame completes.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> last() {
    const std::size_t n = history.size() - 1;
    deliveries_.resize(n);  // what earlier frames of this history completed
    auto result = completed_by(n);
    deliveries_.push_back(result ? start_of_ : kNothing);
    return result;
  }

 private:
  static constexpr std::size_t kNothing = ~std::size_t{0};

  /// A start that says again what was delivered last before frame i.
  [[nodiscard]] bool repeats_a_delivery(std::size_t i) const {
    for (std::size_t k = i; k-- > 0;) {
      if (deliveries_[k] != kNothing) return same(history[deliveries_[k]], history[i]);
    }
    return false;
  }
  [[nodiscard]] bool valid_start(std::size_t i) const {
    const CanFrame& f = history[i];
    return starts(f) && !toggles(f) && (ends(f) || f.size == 8);
  }
  std::optional<std::vector<std::uint8_t>> completed_by(std::size_t n) {
    const CanFrame& f = history[n];
    if (!ends(f)) return std::nullopt;
    if (starts(f)) {
      if (!valid_start(n) || repeats_a_delivery(n)) return std::nullopt;
      start_of_ = n;
      return std::vector<std::uint8_t>(f.data.begin(), f.data.begin() + f.size - 1);
    }
    // The transfer can only be the one of the latest start frame, repetitions of delivered ones left out.
    std::size_t s = n;
    for (; s-- > 0;) {
      if (starts(history[s]) && !(valid_start(s) && repeats_a_delivery(s))) break;
    }
    if (s == kNothing || !valid_start(s) || ends(history[s])) return std::nullopt;
    std::vector<CanFrame> chain{history[s]};
    for (std::size_t i = s + 1; i <= n; ++i) {
      const CanFrame& g = history[i];
      if (starts(g) || id_of(g) != id_of(chain[0]) || same(g, chain.back())) {
        if (i == n) return std::nullopt;
        continue;
      }
      chain.push_back(g);
    }
    std::vector<std::uint8_t> bytes;
    for (std::size_t i = 0; i < chain.size(); ++i) {
      const bool is_last = i + 1 == chain.size();
      if (toggles(chain[i]) != (i % 2 == 1) || ends(chain[i]) != is_last) return std::nullopt;
      if (is_last ? chain[i].size < 2 : chain[i].size != 8) return std::nullopt;
      bytes.insert(bytes.end(), chain[i].data.begin(), chain[i].data.begin() + chain[i].size - 1);
    }
    const unsigned said = bytes[0] | (unsigned{bytes[1]} << 8U);
    bytes.erase(bytes.begin(), bytes.begin() + 2);
    if (bytes.size() > kTypes[0].max_payload_bytes) return std::nullopt;
    if (crc16(bytes, transfer_crc_seed(kSignature)) != said) return std::nullopt;
    start_of_ = s;
    return bytes;
  }

  std::vector<std::size_t> deliveries_;  ///< For each frame: the start of the transfer it completed.
  std::size_t start_of_{0};
};

/// The letter (start, end, toggle, one of two transfer ids) as a frame. The content is such that a transfer
/// of any length passes its CRC: seven bytes that leave the checksum as it is. So only structure can refuse.
std::array<CanFrame, 16> alphabet() {
  const std::array<std::uint8_t, 5> head{1, 2, 3, 4, 5};
  const std::uint16_t crc = crc16(head, transfer_crc_seed(kSignature));
  std::array<std::uint8_t, 7> block{9, 8, 7, 6, 5, 0, 0};
  bool found = false;
  for (unsigned tail = 0; tail <= 0xffff && !found; ++tail) {
    block[5] = static_cast<std::uint8_t>(tail >> 8U);
    block[6] = static_cast<std::uint8_t>(tail);
    found = crc16(block, crc) == crc;
  }
  EXPECT_TRUE(found);
  std::array<CanFrame, 16> letters;
  for (unsigned i = 0; i < letters.size(); ++i) {
    CanFrame& f = letters.at(i);
    f.id = kId;
    f.size = 8;
    const bool start = (i & 8U) != 0;
    f.data = {block[0], block[1], block[2], block[3], block[4], block[5], block[6], 0};
    if (start) {
      f.data = {static_cast<std::uint8_t>(crc), static_cast<std::uint8_t>(crc >> 8U), 1, 2, 3, 4, 5, 0};
    }
    f.data[7] = static_cast<std::uint8_t>(((i & 0xeU) << 4U) | (i & 1U));
  }
  return letters;
}

struct Walk {
  std::array<CanFrame, 16> letters = alphabet();
  std::array<Reassembler::Session, 1> session{};
  ReferenceModel model;
  std::uint64_t sequences{0};
  std::uint64_t deliveries{0};
  std::uint64_t differences{0};

  void go(int depth) {
    if (depth == 0) {
      ++sequences;
      return;
    }
    const Reassembler::Session saved = session[0];
    for (const CanFrame& letter : letters) {
      Reassembler sut(kTypes, session, 0);
      Transfer transfer;
      model.history.push_back(letter);
      const bool got = sut.receive(letter, transfer) == FrameVerdict::kDelivered;
      const auto wanted = model.last();
      bool equal = got == wanted.has_value();
      if (got && wanted)
        equal = std::equal(transfer.payload.begin(), transfer.payload.end(), wanted->begin(), wanted->end());
      deliveries += got ? 1U : 0U;
      differences += equal ? 0U : 1U;
      go(depth - 1);
      model.history.pop_back();
      session[0] = saved;
    }
  }
};

// All 16^6 = 16,777,216 sequences of six frames.
TEST(Reassembly, EqualsTheReferenceModelOnAllSequencesOfSixFrames) {
  Walk walk;
  walk.go(6);
  EXPECT_EQ(walk.sequences, 16'777'216U);
  EXPECT_GT(walk.deliveries, 1'000'000U);
  EXPECT_EQ(walk.differences, 0U);
}

std::vector<CanFrame> three_frames() {
  std::array<std::uint8_t, 17> payload{};
  for (std::size_t i = 0; i < payload.size(); ++i) payload.at(i) = static_cast<std::uint8_t>(i * 13 + 1);
  std::vector<CanFrame> frames(3);
  auto count = split({.data_type_id = 1000, .source_node_id = 1, .priority = 16, .transfer_id = 3},
                     kSignature, payload, {}, frames);
  EXPECT_EQ(count.value(), 3U);
  return frames;
}

struct Feed {
  std::vector<Reassembler::Session> sessions = std::vector<Reassembler::Session>(4);
  Reassembler sut{kTypes, sessions, 0};
  Transfer transfer;

  FrameVerdict operator()(CanFrame frame, milliseconds at = milliseconds{0}) {
    frame.stamp = MonotonicTime{at};
    return sut.receive(frame, transfer);
  }
};

TEST(Reassembly, RefusesEveryOneAndTwoBitErrorOfAThreeFrameTransfer) {
  const std::vector<CanFrame> good = three_frames();
  std::vector<std::pair<std::size_t, unsigned>> bits;  // frame, bit of its payload (tail bytes left alone)
  for (std::size_t f = 0; f < good.size(); ++f) {
    for (unsigned b = 0; b < 8U * (good[f].size - 1U); ++b) bits.emplace_back(f, b);
  }
  ASSERT_EQ(bits.size(), 152U);
  int tried = 0;
  int accepted = 0;
  for (std::size_t i = 0; i < bits.size(); ++i) {
    for (std::size_t j = i; j < bits.size(); ++j) {
      std::vector<CanFrame> bad = good;
      const auto flip = [&bad](std::pair<std::size_t, unsigned> at) {
        std::uint8_t& byte = bad[at.first].data.at(at.second / 8);
        byte = static_cast<std::uint8_t>(byte ^ (1U << (at.second % 8)));
      };
      flip(bits[i]);
      if (j != i) flip(bits[j]);
      Feed feed;
      for (const CanFrame& f : bad) accepted += feed(f) == FrameVerdict::kDelivered ? 1 : 0;
      ++tried;
    }
  }
  EXPECT_EQ(tried, 152 * 153 / 2);
  EXPECT_EQ(accepted, 0);
}

TEST(Reassembly, NamesWhatIsWrong) {
  const std::vector<CanFrame> f = three_frames();
  {
    Feed feed;
    EXPECT_EQ(feed(f[1]), FrameVerdict::kMissedStart);
    EXPECT_EQ(feed(f[2]), FrameVerdict::kMissedStart);
  }
  {
    Feed feed;
    EXPECT_EQ(feed(f[0]), FrameVerdict::kAccepted);
    EXPECT_EQ(feed(f[0]), FrameVerdict::kDuplicate);
    EXPECT_EQ(feed(f[1]), FrameVerdict::kAccepted);
    EXPECT_EQ(feed(f[1]), FrameVerdict::kDuplicate);
    EXPECT_EQ(feed(f[2]), FrameVerdict::kDelivered);
    EXPECT_EQ(feed(f[0]), FrameVerdict::kDuplicate);
    EXPECT_EQ(feed(f[1]), FrameVerdict::kMissedStart);
  }
  {
    Feed feed;  // the middle frame is lost
    EXPECT_EQ(feed(f[0]), FrameVerdict::kAccepted);
    EXPECT_EQ(feed(f[2]), FrameVerdict::kWrongToggle);
    EXPECT_EQ(feed(f[1]), FrameVerdict::kMissedStart);
  }
  {
    Feed feed;
    EXPECT_EQ(feed(f[0]), FrameVerdict::kAccepted);
    EXPECT_EQ(feed(f[1], milliseconds{2001}), FrameVerdict::kTimedOut);
  }
  {
    Feed feed;  // a short frame in the middle
    CanFrame shorter = f[1];
    shorter.size = 5;
    shorter.data[4] = f[1].data[7];
    EXPECT_EQ(feed(f[0]), FrameVerdict::kAccepted);
    EXPECT_EQ(feed(shorter), FrameVerdict::kMalformed);
    EXPECT_EQ(feed(f[2]), FrameVerdict::kMissedStart);
  }
  {
    Feed feed;
    CanFrame empty = f[0];
    empty.size = 0;
    EXPECT_EQ(feed(empty), FrameVerdict::kMalformed);
  }
  {
    Feed feed;  // 60 bytes at most
    EXPECT_EQ(feed(f[0]), FrameVerdict::kAccepted);
    FrameVerdict verdict = FrameVerdict::kAccepted;
    for (int i = 1; i < 9 && verdict == FrameVerdict::kAccepted; ++i) {
      CanFrame more = f[1];
      more.data[0] = static_cast<std::uint8_t>(i);
      more.data[7] = static_cast<std::uint8_t>((i % 2 == 1 ? 0x20 : 0) | 3);
      verdict = feed(more);
    }
    EXPECT_EQ(verdict, FrameVerdict::kTooLong);
  }
  {
    Feed feed;  // another type on the same wire
    CanFrame other = f[0];
    other.id = 0x1003e901;
    EXPECT_EQ(feed(other), FrameVerdict::kNotOurs);
  }
}

TEST(Reassembly, NamesEveryKindOfMalformedFrame) {
  const std::vector<CanFrame> f = three_frames();
  {
    Feed feed;  // nine bytes on a bus of eight
    CanFrame longer = f[0];
    longer.size = 9;
    EXPECT_EQ(feed(longer), FrameVerdict::kMalformed);
  }
  {
    Feed feed;  // a start with the toggle of a second frame: ends what it breaks into
    EXPECT_EQ(feed(f[0]), FrameVerdict::kAccepted);
    EXPECT_EQ(feed(test::with_tail(f[0], 0xa3)), FrameVerdict::kMalformed);
    EXPECT_EQ(feed(f[1]), FrameVerdict::kMissedStart);
  }
  {
    Feed feed;  // an end without a byte
    CanFrame empty = f[1];
    empty.size = 1;
    EXPECT_EQ(feed(f[0]), FrameVerdict::kAccepted);
    EXPECT_EQ(feed(test::with_tail(empty, 0x63)), FrameVerdict::kMalformed);
  }
  {
    Feed feed;  // another transfer's frame does not end this one
    EXPECT_EQ(feed(f[0]), FrameVerdict::kAccepted);
    EXPECT_EQ(feed(test::with_tail(f[1], 0x24)), FrameVerdict::kWrongTransferId);
    EXPECT_EQ(feed(f[1]), FrameVerdict::kAccepted);
    CanFrame damaged = f[2];
    damaged.data[0] = static_cast<std::uint8_t>(damaged.data[0] ^ 1U);
    EXPECT_EQ(feed(damaged), FrameVerdict::kBadCrc);
  }
}

TEST(Reassembly, ARepetitionIsTheSameFrame) {
  const std::vector<CanFrame> f = three_frames();
  Feed feed;
  EXPECT_EQ(feed(f[0]), FrameVerdict::kAccepted);
  CanFrame other = f[0];
  other.data[2] = 99;
  EXPECT_EQ(feed(other), FrameVerdict::kAccepted) << "another start";
  EXPECT_EQ(feed(f[0]), FrameVerdict::kAccepted);
  EXPECT_EQ(feed(test::single_frame(kId)), FrameVerdict::kDelivered);
  EXPECT_EQ(feed(f[0]), FrameVerdict::kAccepted) << "that transfer was given up in between";
  EXPECT_EQ(feed(test::single_frame(kId + (1U << 24U))), FrameVerdict::kDelivered) << "of another priority";
}

TEST(Reassembly, TimesCountFromTheFirstFrame) {
  const std::vector<CanFrame> f = three_frames();
  Feed feed;
  EXPECT_EQ(feed(f[0], milliseconds{5000}), FrameVerdict::kAccepted);
  EXPECT_EQ(feed(f[1], milliseconds{7000}), FrameVerdict::kAccepted);
  EXPECT_EQ(feed(f[2], milliseconds{7000}), FrameVerdict::kDelivered);
  EXPECT_EQ(feed.transfer.stamp, MonotonicTime{milliseconds{5000}});
  EXPECT_EQ(feed.transfer.header.transfer_id, 3);
  EXPECT_EQ(feed(f[0], milliseconds{9000}), FrameVerdict::kDuplicate) << "2 s after its end";
  EXPECT_EQ(feed(test::single_frame(kId), milliseconds{10'000}), FrameVerdict::kDelivered);
  EXPECT_EQ(feed.transfer.stamp, MonotonicTime{milliseconds{10'000}});
  EXPECT_EQ(feed(test::single_frame(kId), milliseconds{11'000}), FrameVerdict::kDuplicate);
  // A clock that goes back is as good as one that goes on.
  EXPECT_EQ(feed(f[0], milliseconds{20'000}), FrameVerdict::kAccepted);
  EXPECT_EQ(feed(f[1], milliseconds{18'000}), FrameVerdict::kAccepted);
  EXPECT_EQ(feed(f[2], milliseconds{17'999}), FrameVerdict::kTimedOut);
}

TEST(Reassembly, GivesUpTheSenderHeardLongestAgoNotTheOneThatCameFirst) {
  Feed feed;
  const std::vector<CanFrame> f = three_frames();
  const auto from = [](CanFrame frame, unsigned source) {
    frame.id = (kId & ~0x7fU) | source;
    return frame;
  };
  for (unsigned source = 1; source <= 4; ++source)
    EXPECT_EQ(feed(from(f[0], source), milliseconds{source}), FrameVerdict::kAccepted);
  EXPECT_EQ(feed(from(f[1], 1), milliseconds{10}), FrameVerdict::kAccepted);
  EXPECT_EQ(feed(from(f[0], 5), milliseconds{20}), FrameVerdict::kAccepted);
  EXPECT_EQ(feed(from(f[2], 1), milliseconds{21}), FrameVerdict::kDelivered);
  EXPECT_EQ(feed(from(f[1], 2), milliseconds{22}), FrameVerdict::kMissedStart);
}

TEST(Reassembly, HearsARestartedSenderAtOnceAndARepetitionOnlyAfterTheTimeOut) {
  CanFrame f;
  f.id = kId;
  f.size = 2;
  f.data = {7, 0xc5};
  Feed feed;
  EXPECT_EQ(feed(f), FrameVerdict::kDelivered);
  EXPECT_EQ(feed(f, milliseconds{2000}), FrameVerdict::kDuplicate);
  CanFrame other = f;
  other.data[0] = 8;
  EXPECT_EQ(feed(other, milliseconds{2000}), FrameVerdict::kDelivered);
  EXPECT_EQ(feed(other, milliseconds{4001}), FrameVerdict::kDelivered);
}

TEST(Reassembly, KeepsSendersApartAndGivesUpTheOneHeardLongestAgo) {
  Feed feed;
  std::vector<CanFrame> f = three_frames();
  const auto from = [](CanFrame frame, unsigned source) {
    frame.id = (kId & ~0x7fU) | source;
    return frame;
  };
  for (unsigned source = 1; source <= 4; ++source)
    EXPECT_EQ(feed(from(f[0], source), milliseconds{source}), FrameVerdict::kAccepted);
  for (unsigned source = 1; source <= 4; ++source)
    EXPECT_EQ(feed(from(f[1], source), milliseconds{10 + source}), FrameVerdict::kAccepted);
  EXPECT_EQ(feed(from(f[0], 5), milliseconds{20}), FrameVerdict::kAccepted);
  EXPECT_EQ(feed.sut.counters().evicted, 1U);
  EXPECT_EQ(feed(from(f[2], 2), milliseconds{21}), FrameVerdict::kDelivered);
  EXPECT_EQ(feed.transfer.header.source_node_id, 2);
  EXPECT_EQ(feed(from(f[2], 1), milliseconds{22}), FrameVerdict::kMissedStart);
}

// A million random and mutated frames: no crash (the sanitizer build runs this too), and nothing delivered
// that the reference model does not deliver.
TEST(Reassembly, DeliversNothingForbiddenFromAMillionMutatedFrames) {
  std::uint64_t state = 42;
  const auto random = [&state](std::uint64_t below) {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<std::size_t>((state >> 33U) % below);
  };
  Feed feed;
  ReferenceModel model;
  std::uint64_t deliveries = 0;
  std::uint64_t differences = 0;
  unsigned transfer_id = 0;
  int sent = 0;
  while (sent < 1'000'000) {
    std::vector<std::uint8_t> payload(random(30));
    for (std::uint8_t& byte : payload) byte = static_cast<std::uint8_t>(random(256));
    std::vector<CanFrame> frames(8);
    auto count = split({.data_type_id = 1000,
                        .source_node_id = 1,
                        .transfer_id = static_cast<std::uint8_t>(transfer_id++ % 32)},
                       kSignature, payload, {}, frames);
    frames.resize(count.value());
    for (std::size_t i = 0; i < frames.size(); ++i) {
      CanFrame f = frames[i];
      const std::uint64_t what = random(40);
      if (what == 0) continue;                                     // lost
      if (what == 1) std::swap(f, frames[random(frames.size())]);  // out of order
      if (what == 2) f.data.at(random(8)) = static_cast<std::uint8_t>(random(256));
      if (what == 3) f.size = static_cast<std::uint8_t>(1 + random(8));
      if (what == 4)
        for (std::uint8_t& byte : f.data) byte = static_cast<std::uint8_t>(random(256));
      for (int twice = what == 5 ? 2 : 1; twice > 0; --twice) {
        // The model looks back 64 frames; more than any transfer of this type has.
        if (model.history.size() >= 4096) {
          model = {};
          feed.sessions[0] = {};
        }
        model.history.push_back(f);
        const bool got = feed(f) == FrameVerdict::kDelivered;
        const auto wanted = model.last();
        differences += got != wanted.has_value() ? 1U : 0U;
        if (got && wanted)
          differences += std::equal(feed.transfer.payload.begin(), feed.transfer.payload.end(),
                                    wanted->begin(), wanted->end())
                             ? 0U
                             : 1U;
        deliveries += got ? 1U : 0U;
        ++sent;
      }
    }
  }
  EXPECT_GT(deliveries, 100'000U);
  EXPECT_EQ(differences, 0U);
}

TEST(Reassembly, SurvivesAMillionFramesOfNoise) {
  std::uint64_t state = 7;
  const auto random = [&state] {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return state >> 32U;
  };
  std::vector<Reassembler::Session> sessions(16);
  Reassembler sut(kAllTypes, sessions, 10);
  Transfer transfer;
  const test::NoAllocScope scope;
  for (int i = 0; i < 1'000'000; ++i) {
    CanFrame f;
    const DataType& type = kAllTypes.at(static_cast<std::size_t>(random() % kAllTypes.size()));
    f.id = static_cast<std::uint32_t>(random()) & 0x1fffffffU;
    if (i % 2 == 0) f.id = (f.id & 0x1f00007fU) | (std::uint32_t{type.id} << 8U);
    f.size = static_cast<std::uint8_t>(random() % 10);
    for (std::uint8_t& byte : f.data) byte = static_cast<std::uint8_t>(random());
    f.stamp = MonotonicTime{Nanos{static_cast<std::int64_t>(random() << 31U)}};
    if (sut.receive(f, transfer) == FrameVerdict::kDelivered) {
      EXPECT_LT(transfer.payload.size(), 8U);
    }
  }
  EXPECT_EQ(scope.count(), 0U);
  EXPECT_GT(sut.counters().verdicts[0], 0U);
  EXPECT_GT(sut.counters().evicted, 0U);
}

TEST(Reassembly, SaysHowManyTransfersAreUnfinished) {
  const std::vector<CanFrame> f = three_frames();
  Feed feed;
  EXPECT_EQ(feed.sut.unfinished(), 0U);
  EXPECT_EQ(feed(f[0]), FrameVerdict::kAccepted);
  CanFrame of_another = f[0];
  of_another.id = (kId & ~0x7fU) | 2U;
  EXPECT_EQ(feed(of_another), FrameVerdict::kAccepted);
  EXPECT_EQ(feed.sut.unfinished(), 2U);
  EXPECT_EQ(feed(f[1]), FrameVerdict::kAccepted);
  EXPECT_EQ(feed(f[2]), FrameVerdict::kDelivered);
  EXPECT_EQ(feed.sut.unfinished(), 1U);
}

TEST(Reassembly, VerdictsHaveTheNamesOfTheLog) {
  test::expect_names<FrameVerdict>(
      {"delivered", "accepted", "unknown type", "duplicate", "malformed", "missed start", "wrong transfer id",
       "wrong toggle", "timed out", "too long", "bad crc"},
      "unknown");
}

}  // namespace
}  // namespace roborun::firmware_if::dronecan
