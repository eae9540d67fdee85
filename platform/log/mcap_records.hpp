/// The records of an MCAP file (https://mcap.dev/spec, version 0), and their bytes. All integers are little-endian, as on
/// every machine that this program is built for.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <string_view>
#include <type_traits>

#include "platform/input/input_error.hpp"

namespace roborun::log {

static_assert(std::endian::native == std::endian::little);

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};
/// One byte of opcode, eight of length.
inline constexpr std::size_t kRecordHead_bytes = 9;

enum class Op : std::uint8_t {
  kHeader = 0x01,
  kFooter,
  kSchema,
  kChannel,
  kMessage,
  kChunk,
  kMessageIndex,
  kChunkIndex,
  kAttachment,
  kAttachmentIndex,
  kStatistics,
  kMetadata,
  kMetadataIndex,
  kSummaryOffset,
  kDataEnd
};

using StringMap = std::map<std::string, std::string>;

struct Schema {
  std::uint16_t id{};  ///< Not 0.
  std::string name, encoding, data;
  bool operator==(const Schema&) const = default;
};
struct Channel {
  std::uint16_t id{};
  std::uint16_t schema_id{};  ///< 0: none.
  std::string topic, message_encoding;
  StringMap metadata;
  bool operator==(const Channel&) const = default;
};
struct Metadata {
  std::string name;
  StringMap values;
  bool operator==(const Metadata&) const = default;
};
/// Times in nanoseconds.
struct Statistics {
  std::uint64_t messages{};
  std::uint16_t schemas{};
  std::uint32_t channels{}, attachments{}, metadata{}, chunks{};
  std::uint64_t first_ns{}, last_ns{};
  std::map<std::uint16_t, std::uint64_t> by_channel;
  bool operator==(const Statistics&) const = default;
};

/// Appends to a string of bytes.
class Put {
 public:
  explicit Put(std::string& to) : to_(to) {}
  template <typename T>
  Put& number(T value) {
    static_assert(std::is_arithmetic_v<T>);
    to_.append(reinterpret_cast<const char*>(&value), sizeof value);
    return *this;
  }
  Put& text(std::string_view value) {
    number(static_cast<std::uint32_t>(value.size()));
    to_.append(value);
    return *this;
  }
  Put& map(const StringMap& values) {
    std::string inner;
    for (const auto& [key, value] : values) Put(inner).text(key).text(value);
    return text(inner);
  }

 private:
  std::string& to_;
};

/// Reads bytes that nobody vouches for: what is not there throws InputError.
class Get {
 public:
  explicit Get(std::string_view from) : from_(from) {}
  [[nodiscard]] std::string_view bytes(std::uint64_t count) {
    if (count > from_.size()) throw InputError("a field is longer than its record");
    const std::string_view taken = from_.substr(0, static_cast<std::size_t>(count));
    from_.remove_prefix(taken.size());
    return taken;
  }
  template <typename T>
  [[nodiscard]] T number() {
    static_assert(std::is_arithmetic_v<T>);
    T value{};
    std::memcpy(&value, bytes(sizeof value).data(), sizeof value);
    return value;
  }
  [[nodiscard]] std::string_view text() { return bytes(number<std::uint32_t>()); }
  [[nodiscard]] StringMap map() {
    StringMap values;
    for (Get inner(text()); !inner.rest().empty();) {
      std::string key(inner.text());
      values[std::move(key)] = inner.text();
    }
    return values;
  }
  [[nodiscard]] std::string_view rest() const noexcept { return from_; }

 private:
  std::string_view from_;
};

/// The content of records, without opcode and length. What reads throws InputError; unknown fields at the end are left out.
[[nodiscard]] std::string bytes_of(const Schema& schema);
[[nodiscard]] std::string bytes_of(const Channel& channel);
[[nodiscard]] std::string bytes_of(const Metadata& metadata);
[[nodiscard]] std::string bytes_of(const Statistics& statistics);
[[nodiscard]] Schema schema_from(std::string_view content);
[[nodiscard]] Channel channel_from(std::string_view content);
[[nodiscard]] Metadata metadata_from(std::string_view content);
[[nodiscard]] Statistics statistics_from(std::string_view content);

/// Appends a whole record.
inline void put_record(std::string& to, Op op, std::string_view content) {
  Put(to).number(static_cast<std::uint8_t>(op)).number(std::uint64_t{content.size()});
  to.append(content);
}

}  // namespace roborun::log
