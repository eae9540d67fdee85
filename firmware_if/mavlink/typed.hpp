/// A struct as a typed view of a message: its table names which member is which field. Fields that the struct
/// leaves out travel as zero and are not looked at. A name or a type that the message does not have does not
/// compile.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>

#include "firmware_if/mavlink/message_type.hpp"

namespace roborun::firmware_if::mavlink {

/// One row of a struct's table.
template <auto kMemberPointer>
struct Member {
  static constexpr auto kMember = kMemberPointer;
  std::string_view field;
};

namespace detail {

template <typename T>
struct Shape {
  using Item = T;
  static constexpr std::size_t kCount = 0;
};
template <typename T, std::size_t kItems>
struct Shape<std::array<T, kItems>> {
  using Item = T;
  static constexpr std::size_t kCount = kItems;
};

template <typename T>
consteval FieldType field_type() noexcept {
  if constexpr (std::is_same_v<T, float>) return FieldType::kFloat;
  if constexpr (std::is_same_v<T, char>) return FieldType::kChar;
  if constexpr (std::is_same_v<T, std::uint8_t>) return FieldType::kUint8;
  if constexpr (std::is_same_v<T, std::int8_t>) return FieldType::kInt8;
  if constexpr (std::is_same_v<T, std::uint16_t>) return FieldType::kUint16;
  if constexpr (std::is_same_v<T, std::int16_t>) return FieldType::kInt16;
  if constexpr (std::is_same_v<T, std::uint32_t>) return FieldType::kUint32;
  if constexpr (std::is_same_v<T, std::int32_t>) return FieldType::kInt32;
  if constexpr (std::is_same_v<T, std::uint64_t>) return FieldType::kUint64;
  if constexpr (std::is_same_v<T, std::int64_t>) return FieldType::kInt64;
}

// Never defined, as in message_type.hpp.
void the_message_has_no_such_field_of_this_type();

template <typename T, typename Value>
consteval Field place_of(std::string_view name) noexcept {
  for (const Field& field : T::kType.fields) {
    if (field.name == name && field.array_count == Shape<Value>::kCount &&
        field.type == field_type<typename Shape<Value>::Item>())
      return field;
  }
  the_message_has_no_such_field_of_this_type();
  return {};
}

template <typename Item>
constexpr std::uint64_t to_bits(Item item) noexcept {
  if constexpr (std::is_same_v<Item, float>) {
    return std::bit_cast<std::uint32_t>(item);
  } else {
    return static_cast<std::uint64_t>(static_cast<std::make_unsigned_t<Item>>(item));
  }
}
template <typename Item>
constexpr Item from_bits(std::uint64_t bits) noexcept {
  if constexpr (std::is_same_v<Item, float>) {
    return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
  } else {
    return static_cast<Item>(bits);
  }
}

/// Calls visit.operator()<field>(value) for each member that the table names.
template <typename Struct, typename T, typename Visit>
constexpr void for_each_member(T& message, Visit&& visit) noexcept {
  constexpr std::size_t kCount = std::tuple_size_v<std::remove_cvref_t<decltype(Struct::kMembers)>>;
  [&]<std::size_t... kIndex>(std::index_sequence<kIndex...>) {
    const auto one = [&]<std::size_t kRow>(std::integral_constant<std::size_t, kRow>) {
      constexpr auto kEntry = std::get<kRow>(Struct::kMembers);
      auto& value = message.*kEntry.kMember;
      constexpr Field kField = place_of<Struct, std::remove_cvref_t<decltype(value)>>(kEntry.field);
      visit(kField, value);
    };
    (one(std::integral_constant<std::size_t, kIndex>{}), ...);
  }
  (std::make_index_sequence<kCount>{});
}

}  // namespace detail

/// The payload of `message`. RT-safe: O(payload), no allocation.
template <typename T>
[[nodiscard]] constexpr Payload pack(const T& message) noexcept {
  Payload payload{};
  detail::for_each_member<T>(message, [&payload](const Field& field, const auto& value) {
    using Value = std::remove_cvref_t<decltype(value)>;
    if constexpr (detail::Shape<Value>::kCount == 0) {
      write_bits(payload, field, 0, detail::to_bits(value));
    } else {
      for (std::size_t i = 0; i < value.size(); ++i) write_bits(payload, field, i, detail::to_bits(value[i]));
    }
  });
  return payload;
}

/// What a payload says, cut, whole or longer than known. RT-safe: O(payload), no allocation.
template <typename T>
[[nodiscard]] constexpr T unpack(std::span<const std::uint8_t> payload) noexcept {
  T message;
  detail::for_each_member<T>(message, [payload](const Field& field, auto& value) {
    using Value = std::remove_cvref_t<decltype(value)>;
    using Item = typename detail::Shape<Value>::Item;
    if constexpr (detail::Shape<Value>::kCount == 0) {
      value = detail::from_bits<Item>(read_bits(payload, field));
    } else {
      for (std::size_t i = 0; i < value.size(); ++i)
        value[i] = detail::from_bits<Item>(read_bits(payload, field, i));
    }
  });
  return message;
}

}  // namespace roborun::firmware_if::mavlink
