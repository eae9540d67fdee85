#include "platform/log/mcap_reader.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "platform/log/crc32.hpp"

namespace roborun::log {
namespace {

/// A record between chunks, and within; what is said to be longer is damage.
constexpr std::uint64_t kMostRecord_bytes = McapReader::kMostChunk_bytes + (1U << 20U);
/// Taken from the file at a time: a length that is a lie costs no more memory than this.
constexpr std::uint64_t kPiece_bytes = 1U << 20U;
constexpr std::size_t kMostMetadata = 10'000;
/// Schemas and channels stay in memory, and a chunk of zeros may hold thousands of them in a few bytes.
constexpr std::size_t kMostDefinitions = 1000;
constexpr std::size_t kMostDefinition_bytes = 1U << 18U;

void check_definition(std::size_t bytes, std::size_t count) {
  if (bytes > kMostDefinition_bytes || count > kMostDefinitions)
    throw InputError(fmt::format("too many schemas or channels, or one of {} bytes", bytes));
}

}  // namespace

McapReader::McapReader(const std::string& path) : path_(path), file_(path, "an MCAP file") {
  try {
    read_start();
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: no MCAP file: {}", path, error.what()));
  }
}

McapReader::~McapReader() = default;

void McapReader::read_start() {
  read_bytes(record_, kMagic.size());
  if (record_ != kMagic) throw InputError("it does not begin with the bytes 0x89 MCAP0");
  read_bytes(record_, kRecordHead_bytes);
  Get head(record_);
  if (head.number<std::uint8_t>() != static_cast<std::uint8_t>(Op::kHeader))
    throw InputError("its first record is no header");
  read_content(head.number<std::uint64_t>());
  Get get(record_);
  profile_ = get.text();
  library_ = get.text();
}

void McapReader::read_bytes(std::string& to, std::uint64_t bytes) {
  to.clear();
  while (to.size() < bytes) {
    const std::size_t before = to.size();
    const auto piece = static_cast<std::size_t>(std::min<std::uint64_t>(bytes - before, kPiece_bytes));
    to.resize(before + piece);
    const std::size_t n = file_.read({to.data() + before, piece});
    crc_ = crc32({to.data() + before, n}, crc_);
    offset_ += n;
    if (n < piece) throw InputError("cut off");
  }
}

void McapReader::read_content(std::uint64_t bytes) {
  if (bytes > kMostRecord_bytes) throw InputError(fmt::format("a record of {} bytes", bytes));
  read_bytes(record_, bytes);
}

void McapReader::break_off(const std::string& why) {
  damage_ = fmt::format("{}: byte {}: {}; whole until {:.3f} s", path_, record_at_, why,
                        1e-9 * static_cast<double>(last_ns_));
  section_ = Section::kEnd;
  in_chunk_ = Get({});
}

bool McapReader::next(Message& message) {
  got_message_ = false;
  try {
    while (!got_message_ && section_ != Section::kEnd) {
      if (!in_chunk_.rest().empty())
        step_in_chunk(message);
      else
        read_record(message);
    }
  } catch (const InputError& error) {
    got_message_ = false;
    break_off(error.what());
  }
  return got_message_;
}

void McapReader::skip_to(std::uint64_t chunk_at) {
  file_.seek(chunk_at);
  offset_ = chunk_at;
  in_chunk_ = Get({});
  skipped_ = true;
}

void McapReader::read_record(Message& message) {
  record_at_ = offset_;
  const std::uint32_t crc_before = crc_;
  read_bytes(record_, kRecordHead_bytes);
  Get head(record_);
  const auto op = static_cast<Op>(head.number<std::uint8_t>());
  const auto bytes = head.number<std::uint64_t>();
  if (section_ == Section::kSummary) {
    if (op != Op::kFooter) {
      read_content(bytes);
      return read_summary_record(op);
    }
    if (bytes != 8 + 8 + 4) throw InputError("a footer of another length");
    return read_footer(crc_before);
  }
  read_content(bytes);
  switch (op) {
    case Op::kSchema:
      return take_schema(record_);
    case Op::kChannel:
      return take_channel(record_);
    case Op::kMessage:
      // No writer does both, and nothing else tells it from an index whose opcode has changed.
      if (chunks_ > 0) throw InputError("a message outside of the chunks");
      return take_message(record_, message);
    case Op::kChunk:
      return open_chunk();
    case Op::kMessageIndex:
      return check_index();
    case Op::kMetadata:
      if (metadata_.size() >= kMostMetadata) throw InputError("too many metadata records");
      metadata_.push_back(metadata_from(record_));
      return;
    case Op::kDataEnd: {
      const auto crc = Get(record_).number<std::uint32_t>();
      if (!skipped_ && crc != 0 && crc != crc_before) throw InputError("the CRC of the data differs");
      return end_of_data();
    }
    case Op::kHeader:
    case Op::kFooter:
    case Op::kChunkIndex:
    case Op::kAttachmentIndex:
    case Op::kStatistics:
    case Op::kMetadataIndex:
    case Op::kSummaryOffset:
      throw InputError("a record that does not belong between chunks");
    default:
      if (op == Op{}) throw InputError("no record");
  }
}

void McapReader::end_of_data() {
  section_ = Section::kSummary;
  summary_start_ = offset_;
  crc_ = 0;
}

void McapReader::read_summary_record(Op op) {
  switch (op) {
    case Op::kSchema:
      return take_schema(record_);
    case Op::kChannel:
      return take_channel(record_);
    case Op::kStatistics: {
      statistics_ = statistics_from(record_);
      if (!skipped_ && (statistics_->messages != messages_ || statistics_->chunks != chunks_))
        throw InputError(fmt::format("{} messages in {} chunks were read, {} in {} were written", messages_,
                                     chunks_, statistics_->messages, statistics_->chunks));
      return;
    }
    case Op::kHeader:
    case Op::kMessage:
    case Op::kChunk:
    case Op::kMessageIndex:
    case Op::kAttachment:
    case Op::kMetadata:
    case Op::kDataEnd:
      throw InputError("a record that does not belong into the summary");
    default:
      if (op == Op{}) throw InputError("no record");
  }
}

void McapReader::read_footer(std::uint32_t crc_before) {
  // The CRC takes in the footer's own head and its first two fields.
  const std::string head = record_;
  std::string body;
  read_bytes(body, 8 + 8 + 4);
  Get get(body);
  const auto start = get.number<std::uint64_t>();
  (void)get.number<std::uint64_t>();
  const auto crc = get.number<std::uint32_t>();
  if (start != 0 && start != summary_start_) throw InputError("the footer points elsewhere");
  if (crc != 0 && crc != crc32(std::string_view(body).substr(0, 8 + 8), crc32(head, crc_before)))
    throw InputError("the CRC of the summary differs");
  read_bytes(body, kMagic.size());
  if (body != kMagic) throw InputError("the end is not the end of an MCAP file");
  char more = 0;
  if (file_.read({&more, 1}) != 0) throw InputError("something follows its end");
  section_ = Section::kEnd;
}

void McapReader::open_chunk() {
  Get get(record_);
  (void)get.number<std::uint64_t>();
  (void)get.number<std::uint64_t>();
  const auto uncompressed = get.number<std::uint64_t>();
  const auto crc = get.number<std::uint32_t>();
  const std::string_view compression = get.text();
  const std::string_view body = get.bytes(get.number<std::uint64_t>());
  if (uncompressed > kMostChunk_bytes) throw InputError(fmt::format("a chunk of {} bytes", uncompressed));
  if (compression == "zstd") {
    decompressor_.run(chunk_, body, static_cast<std::size_t>(uncompressed));
  } else if (compression.empty()) {
    if (body.size() != uncompressed) throw InputError("a chunk of another size than it says");
    chunk_ = body;
  } else {
    throw InputError("a chunk of another compression: must be zstd, or none");
  }
  if (crc != 0 && crc != crc32(chunk_)) throw InputError("the CRC of a chunk differs");
  ++chunks_;
  in_chunk_ = Get(chunk_);
}

void McapReader::step_in_chunk(Message& message) {
  const auto op = static_cast<Op>(in_chunk_.number<std::uint8_t>());
  const std::string_view content = in_chunk_.bytes(in_chunk_.number<std::uint64_t>());
  if (op == Op::kMessage) return take_message(content, message);
  if (op == Op::kSchema) return take_schema(content);
  if (op == Op::kChannel) return take_channel(content);
  if (op <= Op::kDataEnd) throw InputError("a record that does not belong into a chunk");
}

void McapReader::take_message(std::string_view content, Message& message) {
  Get get(content);
  const auto id = get.number<std::uint16_t>();
  const auto channel = channels_.find(id);
  if (channel == channels_.end())
    throw InputError(fmt::format("a message of channel {}, which is unknown", id));
  message.channel = &channel->second;
  message.sequence = get.number<std::uint32_t>();
  message.log_ns = get.number<std::uint64_t>();
  message.publish_ns = get.number<std::uint64_t>();
  message.data = get.rest();
  last_ns_ = std::max(last_ns_, message.log_ns);
  ++messages_;
  got_message_ = true;
}

void McapReader::take_schema(std::string_view content) {
  check_definition(content.size(), schemas_.size());
  Schema schema = schema_from(content);
  if (schema.id == 0) return;  // as the specification asks
  const auto [at, fresh] = schemas_.emplace(schema.id, schema);
  if (!fresh && at->second != schema)
    throw InputError(fmt::format("schema {} twice, and different", schema.id));
}

void McapReader::take_channel(std::string_view content) {
  check_definition(content.size(), channels_.size());
  Channel channel = channel_from(content);
  if (channel.schema_id != 0 && schemas_.find(channel.schema_id) == schemas_.end())
    throw InputError(fmt::format("channel {} of schema {}, which is unknown", channel.id, channel.schema_id));
  const auto [at, fresh] = channels_.emplace(channel.id, channel);
  if (!fresh && at->second != channel)
    throw InputError(fmt::format("channel {} twice, and different", channel.id));
}

void McapReader::check_index() const {
  constexpr std::size_t kEntry_bytes = 8 + 8;
  Get get(record_);
  const auto id = get.number<std::uint16_t>();
  if (channels_.find(id) == channels_.end() || get.text().size() % kEntry_bytes != 0)
    throw InputError("no index of messages");
}

}  // namespace roborun::log
