#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "platform/log/crc32.hpp"
#include "platform/log/mcap_reader.hpp"
#include "platform/log/mcap_writer.hpp"
#include "tests/platform/log/cuts.hpp"
#include "tests/platform/log/mutations.hpp"
#include "tests/platform/log/sample_log.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::log {
namespace {

using roborun::test::scratch;
using roborun::test::scratch_file;
using test::MemorySink;
using test::Read;
using test::read_all;

TEST(Crc32, IsThatOfTheStandard) {
  EXPECT_EQ(crc32(""), 0U);
  EXPECT_EQ(crc32("123456789"), 0xCBF43926U);
  EXPECT_EQ(crc32("The quick brown fox jumps over the lazy dog"), 0x414FA339U);
  for (std::size_t cut = 0; cut <= 9; ++cut)
    EXPECT_EQ(crc32(std::string("123456789").substr(cut), crc32(std::string("123456789").substr(0, cut))),
              0xCBF43926U);
}

/// The bytes of the specification, put down by hand.
class Bytes {
 public:
  Bytes& op(int value, std::uint64_t length) { return u8(value).u64(length); }
  Bytes& u8(int value) { return little(static_cast<std::uint64_t>(value), 1); }
  Bytes& u16(std::uint64_t value) { return little(value, 2); }
  Bytes& u32(std::uint64_t value) { return little(value, 4); }
  Bytes& u64(std::uint64_t value) { return little(value, 8); }
  Bytes& text(const std::string& value) {
    u32(value.size());
    bytes += value;
    return *this;
  }
  std::string bytes;

 private:
  Bytes& little(std::uint64_t value, int count) {
    for (int i = 0; i < count; ++i) bytes += static_cast<char>(value >> (8 * i));
    return *this;
  }
};

TEST(McapWriter, WritesTheBytesOfTheSpecification) {
  MemorySink sink;
  McapWriter writer(sink, "", "lib", {.compressed = false});
  const std::uint16_t schema = writer.add_schema("S", "jsonschema", "{}");
  const std::uint16_t channel = writer.add_channel(schema, "/t", "json", {{"k", "v"}});
  writer.message(channel, 7, "ab");
  writer.finish();

  const std::string magic{"\x89MCAP0\r\n", 8};
  const std::string schema_record =
      Bytes().op(3, 31 - 4).u16(1).text("S").text("jsonschema").text("{}").bytes;
  const std::string channel_record = Bytes()
                                         .op(4, 2 + 2 + 6 + 8 + 14)
                                         .u16(1)
                                         .u16(1)
                                         .text("/t")
                                         .text("json")
                                         .u32(10)
                                         .text("k")
                                         .text("v")
                                         .bytes;
  const std::string message = Bytes().op(5, 24).u16(1).u32(0).u64(7).u64(7).bytes + "ab";
  Bytes data;
  data.bytes = magic;
  data.op(1, 4 + 7).text("").text("lib");
  const std::size_t chunk_at = data.bytes.size();
  const std::string definitions = schema_record + channel_record;
  const std::string records = definitions + message;
  const std::uint64_t size = records.size();
  data.op(6, 8 + 8 + 8 + 4 + 4 + 8 + size).u64(7).u64(7).u64(size).u32(crc32(records)).text("").u64(size);
  data.bytes += records;
  const std::size_t index_at = data.bytes.size();
  data.op(7, 2 + 4 + 16).u16(1).u32(16).u64(7).u64(definitions.size());
  const std::size_t data_end = data.bytes.size();
  Bytes file = data;
  file.op(15, 4).u32(crc32(data.bytes));
  const std::size_t summary_at = file.bytes.size();
  Bytes summary;
  summary.bytes = schema_record + channel_record;
  const std::size_t statistics_at = summary_at + summary.bytes.size();
  summary.op(11, 8 + 2 + 4 * 4 + 8 + 8 + 4 + 10).u64(1).u16(1).u32(1).u32(0).u32(0).u32(1).u64(7).u64(7);
  summary.u32(10).u16(1).u64(1);
  const std::size_t chunk_index_at = summary_at + summary.bytes.size();
  summary.op(8, 8 * 4 + 14 + 8 + 4 + 8 + 8).u64(7).u64(7).u64(chunk_at).u64(index_at - chunk_at);
  summary.u32(10).u16(1).u64(index_at).u64(data_end - index_at).text("").u64(size).u64(size);
  const std::size_t offsets_at = summary_at + summary.bytes.size();
  summary.op(14, 17).u8(3).u64(summary_at).u64(schema_record.size());
  summary.op(14, 17).u8(4).u64(summary_at + schema_record.size()).u64(channel_record.size());
  summary.op(14, 17).u8(11).u64(statistics_at).u64(chunk_index_at - statistics_at);
  summary.op(14, 17).u8(8).u64(chunk_index_at).u64(offsets_at - chunk_index_at);
  summary.op(2, 20).u64(summary_at).u64(offsets_at);
  summary.u32(crc32(summary.bytes));
  EXPECT_EQ(sink.bytes, file.bytes + summary.bytes + magic);
}

TEST(McapReader, GivesBackWhatWasWritten) {
  const MemorySink sink = test::sample_log(12, 300);
  McapReader reader(scratch_file("sample.mcap", sink.bytes));
  EXPECT_EQ(reader.library(), "sample");
  std::map<std::string, int> by_topic;
  std::uint64_t before_ns = 0;
  for (Message message; reader.next(message);) {
    EXPECT_EQ(message.sequence, static_cast<std::uint32_t>(by_topic[message.channel->topic]++));
    EXPECT_GE(message.log_ns, before_ns);
    before_ns = message.log_ns;
    if (message.channel->topic != "/third") continue;
    EXPECT_EQ(message.data, test::noise(message.log_ns / test::kStep_ns, 1200));
  }
  EXPECT_EQ(reader.damage(), "");
  EXPECT_EQ(by_topic, (std::map<std::string, int>{{"/first", 60}, {"/second", 30}, {"/third", 30}}));
  EXPECT_EQ(reader.chunks(), 12U);
  EXPECT_EQ(before_ns, 119 * test::kStep_ns);
  ASSERT_TRUE(reader.statistics().has_value());
  const Statistics statistics = reader.statistics().value_or(Statistics{});
  EXPECT_EQ(statistics.messages, 120U);
  EXPECT_EQ(statistics.last_ns, before_ns);
  EXPECT_EQ(statistics.by_channel.at(1), 60U);
  ASSERT_EQ(reader.metadata().size(), 1U);
  EXPECT_EQ(reader.metadata()[0].values.at("vehicle"), "paper");
  EXPECT_EQ(reader.channels().at(2).metadata.at("unit"), "m");
  EXPECT_LT(sink.bytes.size(), 60'000U) << "nothing was compressed";
}

TEST(McapReader, ReadsAFileWithoutMessages) {
  MemorySink sink;
  McapWriter(sink, "", "empty").finish();
  EXPECT_EQ(read_all(scratch_file("empty.mcap", sink.bytes)).damage, "");
}

/// Every whole chunk is read, and one line says where the file ends.
TEST(McapReader, ReadsEveryWholeChunkOfAFileCutAnywhere) {
  test::expect_cuts_read(test::sample_log(25, 400), 28'000);
}

TEST(McapReader, ReadsAMutatedFileToItsDamage) { test::expect_mutations_read(10'000); }

TEST(McapReader, TakesNoMessageOutOfAnIndex) {
  const MemorySink sink = test::sample_log(2, 100);
  const Read whole = read_all(scratch_file("whole.mcap", sink.bytes));
  int outside = 0;
  for (std::size_t at = sink.bytes.find('\x07'); at != std::string::npos;
       at = sink.bytes.find('\x07', at + 1)) {
    std::string bytes = sink.bytes;
    bytes[at] = '\x05';  // the opcode of a message, one bit away from that of an index
    const Read read = read_all(scratch_file("mutated.mcap", bytes));
    outside += read.damage.find("a message outside of the chunks") != std::string::npos ? 1 : 0;
    ASSERT_LE(read.messages.size(), whole.messages.size()) << at;
    EXPECT_TRUE(std::equal(read.messages.begin(), read.messages.end(), whole.messages.begin())) << at;
  }
  EXPECT_GE(outside, 2) << "the indexes of each chunk";
}

std::string damage_of(const std::string& bytes) { return read_all(scratch_file("bad.mcap", bytes)).damage; }

TEST(McapReader, SaysWhatIsWrongInOneLine) {
  const std::string good = test::sample_log(2, 100).bytes;
  EXPECT_NE(damage_of("[world]\n").find("no MCAP file"), std::string::npos);
  EXPECT_NE(damage_of("").find("no MCAP file: cut off"), std::string::npos);
  EXPECT_NE(damage_of(good + "x").find("something follows its end"), std::string::npos);
  std::string bad = good;
  bad[good.find("zstd")] = 'Z';
  EXPECT_NE(damage_of(bad).find("must be zstd, or none"), std::string::npos);
  // A record of a length that nobody has memory for.
  Bytes huge;
  huge.bytes = good.substr(0, 8);
  huge.op(1, 4 + 4).text("").text("").op(6, std::uint64_t{1} << 62U);
  EXPECT_NE(damage_of(huge.bytes).find("a record of"), std::string::npos);
  Bytes liar;
  liar.bytes = good.substr(0, 8);
  liar.op(1, 4 + 4).text("").text("").op(6, 1U << 28U);
  EXPECT_NE(damage_of(liar.bytes).find("cut off"), std::string::npos);
  Bytes bomb;
  bomb.bytes = good.substr(0, 8);
  bomb.op(1, 4 + 4)
      .text("")
      .text("")
      .op(6, 8 + 8 + 8 + 4 + 8 + 8 + 1)
      .u64(0)
      .u64(0)
      .u64(1U << 30U)
      .u32(0)
      .text("zstd");
  bomb.u64(1).u8(0);
  EXPECT_NE(damage_of(bomb.bytes).find("a chunk of 1073741824 bytes"), std::string::npos);
  Bytes orphan;
  orphan.bytes = good.substr(0, 8);
  orphan.op(1, 4 + 4).text("").text("").op(5, 22).u16(3).u32(0).u64(0).u64(0);
  EXPECT_NE(damage_of(orphan.bytes).find("channel 3, which is unknown"), std::string::npos);
}

TEST(McapWriter, DropsAChunkThatCannotBeWrittenAndGoesOn) {
  MemorySink sink;
  McapWriter writer(sink, "", "full disk");
  sink.refusals = 1;  // the first chunk, with header, schema and channel
  const std::uint16_t channel = writer.add_channel(0, "/t", "x");
  for (std::uint64_t i = 0; i < 40; ++i) {
    if (i == 25) sink.refusals = 1;
    writer.message(channel, i * test::kStep_ns, std::to_string(i));
  }
  EXPECT_EQ(writer.dropped(), 20U);
  writer.finish();
  const Read read = read_all(scratch_file("dropped.mcap", sink.bytes));
  EXPECT_EQ(read.damage, "");
  ASSERT_EQ(read.messages.size(), 20U);
  EXPECT_EQ(read.sequence[0], 10U);
  EXPECT_EQ(read.sequence[10], 30U) << "the gap is not to be seen";
}

TEST(LogFile, TakesBackWhatAFullDiskTookAPartOf) {
  EXPECT_THROW(LogFile("/nonexistent/x.mcap", false), InputError);
  LogFile full("/dev/full", false);
  EXPECT_EQ(full.error(), "");
  EXPECT_FALSE(full.append("x"));
  EXPECT_EQ(full.error(), "/dev/full: cannot be written: No space left on device");
  const std::string path = scratch_file("log.mcap", "what was there before");
  LogFile file(path, true);
  EXPECT_TRUE(file.append("abc"));
  EXPECT_EQ(std::filesystem::file_size(path), 3U) << "not there before the end of the flight";
}

TEST(LogFile, EndsAndNotTheProcessWhereTheReaderOfAFifoHasGone) {
  const std::string path = scratch("log.fifo");
  std::filesystem::remove(path);
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  const int reader = open(path.c_str(), O_RDONLY | O_NONBLOCK);
  LogFile file(path, false);
  EXPECT_TRUE(file.append("x"));
  close(reader);
  EXPECT_FALSE(file.append("x"));
  EXPECT_EQ(file.error(), path + ": cannot be written: Broken pipe");
}

}  // namespace
}  // namespace roborun::log
