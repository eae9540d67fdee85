#include "platform/log/mcap_writer.hpp"

#include <algorithm>

#include "platform/log/crc32.hpp"

namespace roborun::log {
namespace {

/// Of a message in a chunk, without its data: channel, sequence, two times.
constexpr std::uint64_t kMessageHead_bytes = 2 + 4 + 8 + 8;

}  // namespace

McapWriter::McapWriter(ByteSink& sink, std::string_view profile, std::string_view library,
                       const McapOptions& options)
    : sink_(sink), options_(options) {
  pending_ = kMagic;
  std::string header;
  Put(header).text(profile).text(library);
  put_record(pending_, Op::kHeader, header);
}

McapWriter::~McapWriter() = default;

std::uint16_t McapWriter::add_schema(std::string_view name, std::string_view encoding,
                                     std::string_view data) {
  close_chunk();
  schemas_.push_back({static_cast<std::uint16_t>(schemas_.size() + 1), std::string(name),
                      std::string(encoding), std::string(data)});
  put_record(definitions_, Op::kSchema, bytes_of(schemas_.back()));
  return schemas_.back().id;
}

std::uint16_t McapWriter::add_channel(std::uint16_t schema_id, std::string_view topic,
                                      std::string_view message_encoding, const StringMap& metadata) {
  close_chunk();
  channels_.push_back({static_cast<std::uint16_t>(channels_.size() + 1), schema_id, std::string(topic),
                       std::string(message_encoding), metadata});
  sequence_.push_back(0);
  put_record(definitions_, Op::kChannel, bytes_of(channels_.back()));
  return channels_.back().id;
}

void McapWriter::add_metadata(const Metadata& metadata) {
  close_chunk();
  metadata_.emplace_back(metadata, offset_ + pending_.size());
  put_record(pending_, Op::kMetadata, bytes_of(metadata));
}

void McapWriter::message(std::uint16_t channel, std::uint64_t time_ns, std::string_view data) {
  const bool spans = !records_.empty() && (time_ns < first_ns_ || time_ns - first_ns_ >= options_.chunk_ns);
  if (spans) close_chunk();
  if (records_.empty()) {
    first_ns_ = last_ns_ = time_ns;
    records_ = definitions_;
  }
  last_ns_ = std::max(last_ns_, time_ns);
  index_[channel].emplace_back(time_ns, records_.size());
  Put put(records_);
  put.number(static_cast<std::uint8_t>(Op::kMessage)).number(kMessageHead_bytes + data.size());
  put.number(channel).number(sequence_.at(channel - 1U)++).number(time_ns).number(time_ns);
  records_.append(data);
  if (records_.size() >= options_.chunk_bytes) close_chunk();
}

bool McapWriter::flush(std::string_view bytes) {
  pending_.append(bytes);
  if (!sink_.append(pending_)) {
    pending_.resize(pending_.size() - bytes.size());
    return false;
  }
  crc_ = crc32(pending_, crc_);
  offset_ += pending_.size();
  pending_.clear();
  return true;
}

void McapWriter::count(const Chunk& chunk) {
  const bool first = statistics_.messages == 0;
  statistics_.first_ns = first ? chunk.first_ns : std::min(statistics_.first_ns, chunk.first_ns);
  statistics_.last_ns = std::max(statistics_.last_ns, chunk.last_ns);
  for (const auto& [channel, entries] : index_) {
    statistics_.messages += entries.size();
    statistics_.by_channel[channel] += entries.size();
  }
  chunks_.push_back(chunk);
}

void McapWriter::close_chunk() {
  if (records_.empty()) return;
  Chunk chunk;
  chunk.first_ns = first_ns_;
  chunk.last_ns = last_ns_;
  chunk.uncompressed = records_.size();
  std::string_view body = options_.compressed ? compressor_.run(records_, kLevel) : std::string_view();
  chunk.compression = body.empty() ? "" : "zstd";
  if (body.empty()) body = records_;
  chunk.compressed = body.size();
  std::string content;
  content.reserve(body.size() + 64);
  Put(content).number(first_ns_).number(last_ns_).number(chunk.uncompressed).number(crc32(records_));
  Put(content).text(chunk.compression).number(chunk.compressed);
  content.append(body);
  std::string bytes;
  put_record(bytes, Op::kChunk, content);
  chunk.offset = offset_ + pending_.size();
  chunk.length = bytes.size();
  for (const auto& [channel, entries] : index_) {
    std::string array;
    for (const auto& [time_ns, at] : entries) Put(array).number(time_ns).number(at);
    std::string record;
    Put(record).number(channel).text(array);
    chunk.index_offset[channel] = chunk.offset + bytes.size();
    put_record(bytes, Op::kMessageIndex, record);
  }
  chunk.index_length = bytes.size() - chunk.length;
  if (flush(bytes)) {
    count(chunk);
    definitions_.clear();
  } else {
    for (const auto& [channel, entries] : index_) dropped_ += entries.size();
  }
  records_.clear();
  index_.clear();
}

std::string McapWriter::summary(std::uint64_t start) const {
  std::string text;
  std::string offsets;
  const auto group = [&](Op op, const auto& items, const auto& content) {
    const std::size_t begin = text.size();
    for (const auto& item : items) put_record(text, op, content(item));
    if (text.size() == begin) return;
    std::string record;
    Put(record)
        .number(static_cast<std::uint8_t>(op))
        .number(start + begin)
        .number(std::uint64_t{text.size() - begin});
    put_record(offsets, Op::kSummaryOffset, record);
  };
  const auto plain = [](const auto& item) { return bytes_of(item); };
  group(Op::kSchema, schemas_, plain);
  group(Op::kChannel, channels_, plain);
  group(Op::kStatistics, std::vector<Statistics>{statistics_}, plain);
  group(Op::kMetadataIndex, metadata_, [](const auto& item) {
    std::string record;
    Put(record).number(item.second).number(std::uint64_t{kRecordHead_bytes + bytes_of(item.first).size()});
    Put(record).text(item.first.name);
    return record;
  });
  group(Op::kChunkIndex, chunks_, [](const Chunk& c) {
    std::string at;
    for (const auto& [channel, offset] : c.index_offset) Put(at).number(channel).number(offset);
    std::string record;
    Put(record).number(c.first_ns).number(c.last_ns).number(c.offset).number(c.length).text(at);
    Put(record).number(c.index_length).text(c.compression).number(c.compressed).number(c.uncompressed);
    return record;
  });
  const std::uint64_t offsets_at = start + text.size();
  text += offsets;
  Put(text).number(static_cast<std::uint8_t>(Op::kFooter)).number(std::uint64_t{8 + 8 + 4});
  Put(text).number(start).number(offsets_at);
  Put(text).number(crc32(text));
  return text.append(kMagic);
}

void McapWriter::finish() {
  close_chunk();
  statistics_.schemas = static_cast<std::uint16_t>(schemas_.size());
  statistics_.channels = static_cast<std::uint32_t>(channels_.size());
  statistics_.metadata = static_cast<std::uint32_t>(metadata_.size());
  statistics_.chunks = static_cast<std::uint32_t>(chunks_.size());
  std::string end;
  std::string crc;
  Put(crc).number(crc32(pending_, crc_));
  put_record(end, Op::kDataEnd, crc);
  end += summary(offset_ + pending_.size() + end.size());
  (void)flush(end);
}

}  // namespace roborun::log
