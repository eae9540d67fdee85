/// A MAVLink message as one constexpr table of its fields, in the order of its public definition. Wire order,
/// offsets, lengths and CRC_EXTRA follow from the table; encoder, decoder and the JSON of the tools read it.
/// Source: MAVLink developer guide, "Packet serialization" (field reordering, CRC_EXTRA) and "MAVLink 2".
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "firmware_if/mavlink/crc.hpp"

namespace roborun::firmware_if::mavlink {

inline constexpr std::size_t kMostPayload_bytes = 255;

enum class FieldType : std::uint8_t {
  kUint8,
  kInt8,
  kChar,
  kUint16,
  kInt16,
  kUint32,
  kInt32,
  kFloat,
  kUint64,
  kInt64,
};

[[nodiscard]] constexpr std::size_t size_bytes(FieldType type) noexcept {
  constexpr std::array<std::uint8_t, 10> kSize_bytes{1, 1, 1, 2, 2, 4, 4, 4, 8, 8};
  return kSize_bytes[static_cast<std::size_t>(type)];
}
/// The name that goes into CRC_EXTRA.
[[nodiscard]] constexpr std::string_view to_string(FieldType type) noexcept {
  constexpr std::array<std::string_view, 10> kName{"uint8_t",  "int8_t",  "char",  "uint16_t", "int16_t",
                                                   "uint32_t", "int32_t", "float", "uint64_t", "int64_t"};
  return kName[static_cast<std::size_t>(type)];
}

/// One row as the public definition has it. `array_count` 0: a scalar.
struct Row {
  FieldType type{};
  std::string_view name;
  std::uint8_t array_count{0};
};

/// A row with its place on the wire.
struct Field {
  FieldType type{};
  std::string_view name;
  std::uint8_t array_count{0};
  std::uint8_t offset_bytes{0};
  bool extension{false};

  [[nodiscard]] constexpr std::size_t count() const noexcept { return array_count == 0 ? 1U : array_count; }
  [[nodiscard]] constexpr std::size_t length_bytes() const noexcept { return count() * size_bytes(type); }
};

/// What codec and tools know of a message. A view: the rows are in static memory.
struct MessageType {
  std::uint32_t id{};
  std::string_view name;
  std::uint8_t crc_extra{};
  std::uint8_t min_bytes{};       ///< Payload without extension fields.
  std::uint8_t max_bytes{};       ///< Payload with them.
  std::span<const Field> fields;  ///< In the order of the definition.
};

/// The owner of the rows.
template <std::size_t kCount>
struct MessageTable {
  std::uint32_t id{};
  std::string_view name;
  std::uint8_t crc_extra{};
  std::uint8_t min_bytes{};
  std::uint8_t max_bytes{};
  std::array<Field, kCount> fields{};

  // Implicit, so that a table is a message type wherever one is wanted.
  constexpr operator MessageType() const noexcept {  // NOLINT(google-explicit-constructor)
    return {id, name, crc_extra, min_bytes, max_bytes, fields};
  }
};

namespace detail {

// Never defined: a call is an error of compilation that names what is wrong.
void the_table_differs_from_the_published_crc_extra();
void the_payload_is_too_long();

/// Fields travel by falling size of their elements, equal ones in the order of the definition; only the fields
/// that are no extension, and those alone enter CRC_EXTRA.
template <std::size_t kCount>
constexpr std::size_t lay_out_base(MessageTable<kCount>& table, Crc& crc) noexcept {
  std::size_t offset = 0;
  for (const std::size_t size : {8U, 4U, 2U, 1U}) {
    for (Field& field : table.fields) {
      if (field.extension || size_bytes(field.type) != size) continue;
      field.offset_bytes = static_cast<std::uint8_t>(offset);
      offset += field.length_bytes();
      crc.add(to_string(field.type));
      crc.add(" ");
      crc.add(field.name);
      crc.add(" ");
      if (field.array_count != 0) crc.add(field.array_count);
    }
  }
  return offset;
}

template <std::size_t kCount>
consteval MessageTable<kCount> lay_out(MessageTable<kCount> table) noexcept {
  Crc crc;
  crc.add(table.name);
  crc.add(" ");
  std::size_t offset = lay_out_base(table, crc);
  table.min_bytes = static_cast<std::uint8_t>(offset);
  for (Field& field : table.fields) {
    if (!field.extension) continue;
    field.offset_bytes = static_cast<std::uint8_t>(offset);
    offset += field.length_bytes();
  }
  table.max_bytes = static_cast<std::uint8_t>(offset);
  if (offset > kMostPayload_bytes) the_payload_is_too_long();
  if (((crc.value() ^ (crc.value() >> 8U)) & 0xffU) != table.crc_extra)
    the_table_differs_from_the_published_crc_extra();
  return table;
}

}  // namespace detail

/// The table of a message. Does not compile if the rows do not give the published CRC_EXTRA.
template <std::size_t kBase>
consteval MessageTable<kBase> define(std::uint32_t id, std::string_view name, std::uint8_t crc_extra,
                                     const Row (&base)[kBase]) noexcept {  // NOLINT(*-avoid-c-arrays)
  MessageTable<kBase> table{.id = id, .name = name, .crc_extra = crc_extra};
  for (std::size_t i = 0; i < kBase; ++i)
    table.fields[i] = {.type = base[i].type, .name = base[i].name, .array_count = base[i].array_count};
  return detail::lay_out(table);
}

/// The same with the extension fields of MAVLink 2. They stand behind all others, in their own order.
template <std::size_t kBase, std::size_t kExtra>
consteval MessageTable<kBase + kExtra> define(
    std::uint32_t id, std::string_view name, std::uint8_t crc_extra,
    const Row (&base)[kBase],                    // NOLINT(*-avoid-c-arrays)
    const Row (&extensions)[kExtra]) noexcept {  // NOLINT(*-avoid-c-arrays)
  MessageTable<kBase + kExtra> table{.id = id, .name = name, .crc_extra = crc_extra};
  for (std::size_t i = 0; i < kBase + kExtra; ++i) {
    const Row& row = i < kBase ? base[i] : extensions[i - kBase];
    table.fields[i] = {
        .type = row.type, .name = row.name, .array_count = row.array_count, .extension = i >= kBase};
  }
  return detail::lay_out(table);
}

/// The bits of item `index` of a field, in a payload as it came: what was cut off is zero.
/// Precondition: index < field.count(). RT-safe: O(1).
[[nodiscard]] constexpr std::uint64_t read_bits(std::span<const std::uint8_t> payload, const Field& field,
                                                std::size_t index = 0) noexcept {
  const std::size_t size = size_bytes(field.type);
  const std::size_t at = field.offset_bytes + index * size;
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < size && at + i < payload.size(); ++i)
    bits |= static_cast<std::uint64_t>(payload[at + i]) << (8U * i);
  return bits;
}

/// A payload before its trailing zeros are cut.
using Payload = std::array<std::uint8_t, kMostPayload_bytes>;

/// Precondition: index < field.count(). RT-safe: O(1).
constexpr void write_bits(Payload& payload, const Field& field, std::size_t index,
                          std::uint64_t bits) noexcept {
  const std::size_t size = size_bytes(field.type);
  const std::size_t at = field.offset_bytes + index * size;
  for (std::size_t i = 0; i < size; ++i) payload[at + i] = static_cast<std::uint8_t>(bits >> (8U * i));
}

}  // namespace roborun::firmware_if::mavlink
