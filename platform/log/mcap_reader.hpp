/// Reads an MCAP file from its beginning to its end, chunk by chunk, and believes nothing of it: every length is checked
/// before it is used, every CRC that is there is compared, and memory follows what the file holds, not what it says.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "platform/input/input_file.hpp"
#include "platform/log/compression.hpp"
#include "platform/log/mcap_records.hpp"

namespace roborun::log {

/// `data` and `channel` stay valid until the next call of next().
struct Message {
  const Channel* channel{};
  std::uint32_t
      sequence{};  ///< Counts the messages of a channel in our logs: where it jumps, messages were dropped.
  std::uint64_t log_ns{}, publish_ns{};
  std::string_view data;
};

/// What ends the reading of a file that goes on, or should: a cut, a change, or what this reader does not know.
///  - Chunks: without compression or with zstd, at most kMostChunk_bytes; messages outside of chunks are read in files without chunks.
///  - A record of an opcode that the format does not know is left out, as its specification asks; what was hidden by it
///    shows in a jump of Message::sequence, and at the end in the statistics and the CRC of the whole.
///  - Attachments and indexes are left out. The summary is compared with what was read.
class McapReader {
 public:
  static constexpr std::size_t kMostChunk_bytes = std::size_t{1} << 28U;

  /// Reads the header. Throws InputError: "PATH: cannot be opened: ...", "PATH: no MCAP file: ...".
  explicit McapReader(const std::string& path);
  ~McapReader();
  McapReader(const McapReader&) = delete;
  McapReader& operator=(const McapReader&) = delete;

  /// The next message in the order of the file; false at the end, or where the file is damaged: damage() tells which.
  /// A chunk with a CRC gives all of its messages or none. Throws nothing but std::bad_alloc.
  [[nodiscard]] bool next(Message& message);

  /// Empty: the file is whole as far as it was read; at the end: whole. Otherwise one line: "PATH: byte N: WHY; whole until
  /// T s", and nothing can be read behind it.
  [[nodiscard]] const std::string& damage() const noexcept { return damage_; }
  /// The byte where the chunk of the last message begins.
  [[nodiscard]] std::uint64_t chunk_at() const noexcept { return record_at_; }
  /// On to the chunk that begins there. What is left out is not verified, nor are the CRC and the counts of the whole. Throws
  /// InputError for a file that is none, such as a pipe.
  void skip_to(std::uint64_t chunk_at);
  [[nodiscard]] const std::string& profile() const noexcept { return profile_; }
  [[nodiscard]] const std::string& library() const noexcept { return library_; }
  /// What was met so far: by id, and in the order of the file.
  [[nodiscard]] const std::map<std::uint16_t, Schema>& schemas() const noexcept { return schemas_; }
  [[nodiscard]] const std::map<std::uint16_t, Channel>& channels() const noexcept { return channels_; }
  [[nodiscard]] const std::vector<Metadata>& metadata() const noexcept { return metadata_; }
  /// Of the summary; none before the end, and in a file without.
  [[nodiscard]] const std::optional<Statistics>& statistics() const noexcept { return statistics_; }
  [[nodiscard]] std::uint64_t messages() const noexcept { return messages_; }
  [[nodiscard]] std::uint64_t chunks() const noexcept { return chunks_; }

 private:
  enum class Section : std::uint8_t { kData, kSummary, kEnd };

  void read_start();
  /// One record between chunks. Throws InputError.
  void read_record(Message& message);
  void read_summary_record(Op op);
  void read_footer(std::uint32_t crc_before);
  /// The content of the record at hand into record_.
  void read_content(std::uint64_t bytes);
  /// As many bytes as asked for, counted and summed up. Throws InputError at the end of the file.
  void read_bytes(std::string& to, std::uint64_t bytes);
  void open_chunk();
  /// The next record of the open chunk.
  void step_in_chunk(Message& message);
  void take_message(std::string_view content, Message& message);
  void take_schema(std::string_view content);
  void take_channel(std::string_view content);
  void check_index() const;
  void end_of_data();
  void break_off(const std::string& why);

  std::string path_;
  input::InputFile file_;
  Decompressor decompressor_;
  Section section_{Section::kData};
  std::uint64_t offset_{0};     ///< Read so far.
  std::uint64_t record_at_{0};  ///< Where the record at hand begins.
  std::uint32_t crc_{0};        ///< Of the section at hand.
  std::string record_;
  std::string chunk_;
  Get in_chunk_{{}};  ///< What is left of it.
  bool got_message_{false};
  bool skipped_{false};  ///< Not all was read.
  std::uint64_t summary_start_{0};
  std::string damage_, profile_, library_;
  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  std::vector<Metadata> metadata_;
  std::optional<Statistics> statistics_;
  std::uint64_t messages_{0}, chunks_{0};
  std::uint64_t last_ns_{0};
};

}  // namespace roborun::log
