/// Writes an MCAP file: chunks compressed with zstd, all CRCs, message indexes, statistics, summary with offsets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "platform/log/compression.hpp"
#include "platform/log/log_file.hpp"
#include "platform/log/mcap_records.hpp"

namespace roborun::log {

struct McapOptions {
  std::uint64_t chunk_ns{1'000'000'000};  ///< A chunk is closed before it spans more of log time ...
  std::size_t chunk_bytes{4U << 20U};     ///< ... or once it holds so much.
  bool compressed{true};
};

/// One thread; may allocate. Records between chunks are written with the chunk that follows them, in one append(): a file that is
/// cut ends with a whole chunk, but for its last bytes. A chunk that cannot be written is dropped and counted, and the next
/// one is tried. Schemas and channels are in chunks, where a CRC covers them.
class McapWriter {
 public:
  McapWriter(ByteSink& sink, std::string_view profile, std::string_view library,
             const McapOptions& options = {});
  ~McapWriter();
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  /// Returns its id. They stand at the beginning of the next chunk, under its CRC.
  std::uint16_t add_schema(std::string_view name, std::string_view encoding, std::string_view data);
  /// `schema_id` 0: without one.
  std::uint16_t add_channel(std::uint16_t schema_id, std::string_view topic,
                            std::string_view message_encoding, const StringMap& metadata = {});
  void add_metadata(const Metadata& metadata);
  /// Its sequence number counts the messages of the channel from 0, those that are dropped included. Log and publish time are the
  /// same. Precondition: `channel` is of add_channel().
  void message(std::uint16_t channel, std::uint64_t time_ns, std::string_view data);
  /// To the sink, if there is anything in it.
  void close_chunk();
  /// The summary. Nothing may follow.
  void finish();

  /// What was added so far; the ids count from 1.
  [[nodiscard]] const std::vector<Schema>& schemas() const noexcept { return schemas_; }
  [[nodiscard]] const std::vector<Channel>& channels() const noexcept { return channels_; }
  /// Messages of chunks that could not be written; never decreases.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }
  /// Taken by the sink so far.
  [[nodiscard]] std::uint64_t bytes() const noexcept { return offset_; }

 private:
  struct Chunk {
    std::uint64_t first_ns{}, last_ns{}, offset{}, length{}, index_length{}, compressed{}, uncompressed{};
    std::string compression;
    std::map<std::uint16_t, std::uint64_t> index_offset;
  };
  using Index = std::map<std::uint16_t, std::vector<std::pair<std::uint64_t, std::uint64_t>>>;

  /// With what is pending before it.
  [[nodiscard]] bool flush(std::string_view bytes);
  void count(const Chunk& chunk);
  [[nodiscard]] std::string summary(std::uint64_t start) const;

  ByteSink& sink_;
  McapOptions options_;
  Compressor compressor_;
  std::string pending_;      ///< Before the next chunk.
  std::string definitions_;  ///< Schemas and channels that no chunk in the file holds yet.
  std::string records_;      ///< Of the open chunk.
  Index index_;              ///< The same.
  std::uint64_t first_ns_{}, last_ns_{};
  std::uint64_t offset_{0};
  std::uint32_t crc_{0};  ///< Of all that the sink took.
  std::uint64_t dropped_{0};
  std::vector<Schema> schemas_;
  std::vector<Channel> channels_;
  std::vector<std::uint32_t> sequence_;                       ///< By channel, from 1.
  std::vector<std::pair<Metadata, std::uint64_t>> metadata_;  ///< With its offset.
  std::vector<Chunk> chunks_;
  Statistics statistics_;
};

}  // namespace roborun::log
