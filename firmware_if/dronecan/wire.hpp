/// The types of DSDL as C++ types, and a message as a constexpr table of its fields. From that one table come
/// encoder, decoder, the data type signature, and the JSON of the tools.
/// Source: UAVCAN v0 specification, "DSDL".
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>

#include "firmware_if/dronecan/bits.hpp"
#include "firmware_if/dronecan/crc.hpp"
#include "firmware_if/status.hpp"

namespace roborun::firmware_if::dronecan {

/// A dynamic array of DSDL: `count` items, at most kCapacity.
template <typename T, std::size_t kCapacity>
struct Bounded {
  static_assert(kCapacity <= 255);
  std::array<T, kCapacity> items{};
  std::uint8_t count{};

  /// False: full, nothing was changed.
  [[nodiscard]] constexpr bool push_back(const T& item) noexcept {
    if (count >= kCapacity) return false;
    items[count++] = item;
    return true;
  }
  [[nodiscard]] constexpr std::span<const T> view() const noexcept { return {items.data(), count}; }
};

/// The normalised definition of a type, fed into its signature as it is written.
class DsdlText {
 public:
  constexpr void add(std::string_view text) noexcept {
    for (const char c : text) crc_.add(static_cast<std::uint8_t>(c));
  }
  /// Below 1000.
  constexpr void add(std::size_t number) noexcept {
    for (const std::size_t digit : {number / 100, number / 10, number}) {
      if (digit != 0) crc_.add(static_cast<std::uint8_t>('0' + digit % 10));
    }
  }
  constexpr void extend(std::uint64_t nested_signature) noexcept {
    const std::uint64_t own = crc_.value();
    crc_.add_little_endian(nested_signature);
    crc_.add_little_endian(own);
  }
  [[nodiscard]] constexpr std::uint64_t signature() const noexcept { return crc_.value(); }

 private:
  Crc64 crc_;
};

enum class Cast : std::uint8_t { kSaturated, kTruncated };

/// Each wire type says: its C++ value, its size in bits, write, read, its normalised name, and the signature
/// of the compound type inside it (0: none). `tail`: it is the last thing of a transfer.
template <unsigned kBits, Cast kCast = Cast::kSaturated>
struct Uint {
  static_assert(kBits >= 1 && kBits <= 64);
  using Value =
      std::conditional_t<(kBits <= 8), std::uint8_t,
                         std::conditional_t<(kBits <= 16), std::uint16_t,
                                            std::conditional_t<(kBits <= 32), std::uint32_t, std::uint64_t>>>;
  static constexpr std::size_t kMinBits = kBits;
  static constexpr std::size_t kMaxBits = kBits;
  static constexpr std::uint64_t kNested = 0;

  static constexpr void write(BitWriter& out, Value value, bool /*tail*/) noexcept {
    if constexpr (kBits > 56) {
      out.put<32>(value & 0xffffffffU);
      out.put<kBits - 32>(value >> 32U);
    } else {
      const bool too_big = kCast == Cast::kSaturated && value > detail::kMask<kBits>;
      out.put<kBits>(too_big ? detail::kMask<kBits> : value);
    }
  }
  static constexpr void read(BitReader& in, Value& value, bool /*tail*/) noexcept {
    if constexpr (kBits > 56) {
      const std::uint64_t low = in.get<32>();
      value = low | (in.get<kBits - 32>() << 32U);
    } else {
      value = static_cast<Value>(in.get<kBits>());
    }
  }
  static constexpr void describe(DsdlText& text) noexcept {
    text.add(kCast == Cast::kSaturated ? "saturated uint" : "truncated uint");
    text.add(std::size_t{kBits});
  }
};

template <unsigned kBits>
struct Int {
  static_assert(kBits >= 2 && kBits <= 56);
  using Value =
      std::conditional_t<(kBits <= 8), std::int8_t,
                         std::conditional_t<(kBits <= 16), std::int16_t,
                                            std::conditional_t<(kBits <= 32), std::int32_t, std::int64_t>>>;
  static constexpr std::size_t kMinBits = kBits;
  static constexpr std::size_t kMaxBits = kBits;
  static constexpr std::uint64_t kNested = 0;
  static constexpr std::int64_t kMost = (std::int64_t{1} << (kBits - 1)) - 1;

  static constexpr void write(BitWriter& out, Value value, bool /*tail*/) noexcept {
    std::int64_t wide = value;  // NOLINT(bugprone-signed-char-misuse): a number
    wide = wide > kMost ? kMost : (wide < -kMost - 1 ? -kMost - 1 : wide);
    out.put<kBits>(static_cast<std::uint64_t>(wide));
  }
  static constexpr void read(BitReader& in, Value& value, bool /*tail*/) noexcept {
    const std::uint64_t raw = in.get<kBits>() << (64U - kBits);
    value = static_cast<Value>(static_cast<std::int64_t>(raw) >> (64U - kBits));
  }
  static constexpr void describe(DsdlText& text) noexcept {
    text.add("saturated int");
    text.add(std::size_t{kBits});
  }
};

struct Bool {
  using Value = bool;
  static constexpr std::size_t kMinBits = 1;
  static constexpr std::size_t kMaxBits = 1;
  static constexpr std::uint64_t kNested = 0;
  static constexpr void write(BitWriter& out, bool value, bool /*tail*/) noexcept {
    out.put<1>(value ? 1U : 0U);
  }
  static constexpr void read(BitReader& in, bool& value, bool /*tail*/) noexcept { value = in.get<1>() != 0; }
  static constexpr void describe(DsdlText& text) noexcept { text.add("saturated bool"); }
};

template <unsigned kBits>
struct Float {
  static_assert(kBits == 16 || kBits == 32);
  using Value = float;
  static constexpr std::size_t kMinBits = kBits;
  static constexpr std::size_t kMaxBits = kBits;
  static constexpr std::uint64_t kNested = 0;
  static constexpr void write(BitWriter& out, float value, bool /*tail*/) noexcept {
    if constexpr (kBits == 16) {
      out.put<16>(to_half(value));
    } else {
      out.put<32>(std::bit_cast<std::uint32_t>(value));
    }
  }
  static constexpr void read(BitReader& in, float& value, bool /*tail*/) noexcept {
    if constexpr (kBits == 16) {
      value = from_half(static_cast<std::uint16_t>(in.get<16>()));
    } else {
      value = std::bit_cast<float>(static_cast<std::uint32_t>(in.get<32>()));
    }
  }
  static constexpr void describe(DsdlText& text) noexcept {
    text.add("saturated float");
    text.add(std::size_t{kBits});
  }
};

template <typename Item, std::size_t kCount>
struct Fixed {
  using Value = std::array<typename Item::Value, kCount>;
  static constexpr std::size_t kMinBits = kCount * Item::kMinBits;
  static constexpr std::size_t kMaxBits = kCount * Item::kMaxBits;
  static constexpr std::uint64_t kNested = Item::kNested;
  static constexpr void write(BitWriter& out, const Value& value, bool /*tail*/) noexcept {
    for (const auto& item : value) Item::write(out, item, false);
  }
  static constexpr void read(BitReader& in, Value& value, bool /*tail*/) noexcept {
    for (auto& item : value) Item::read(in, item, false);
  }
  static constexpr void describe(DsdlText& text) noexcept {
    Item::describe(text);
    text.add("[");
    text.add(kCount);
    text.add("]");
  }
};

/// Carries its length, except as the last field of a transfer with items of at least 8 bits (tail array
/// optimisation): then the length follows from that of the transfer.
template <typename Item, std::size_t kCapacity>
struct Dynamic {
  using Value = Bounded<typename Item::Value, kCapacity>;
  static constexpr unsigned kLengthBits = std::bit_width(kCapacity);
  static constexpr bool kTailOptimised = Item::kMinBits >= 8;
  static constexpr std::size_t kMinBits = kLengthBits;
  static constexpr std::size_t kMaxBits = kLengthBits + kCapacity * Item::kMaxBits;
  static constexpr std::uint64_t kNested = Item::kNested;
  static constexpr void write(BitWriter& out, const Value& value, bool tail) noexcept {
    if (!(tail && kTailOptimised)) out.put<kLengthBits>(value.count);
    for (std::size_t i = 0; i < value.count; ++i) Item::write(out, value.items[i], false);
  }
  static constexpr void read(BitReader& in, Value& value, bool tail) noexcept {
    value.count = 0;
    const bool open = tail && kTailOptimised;
    const std::size_t count =
        open ? in.remaining_bits() / Item::kMinBits : static_cast<std::size_t>(in.get<kLengthBits>());
    for (std::size_t i = 0; i < count; ++i) {
      // Items of varying size: what is left may be fewer than the shortest item would allow.
      if (open && in.remaining_bits() < Item::kMinBits) return;
      typename Item::Value item{};
      Item::read(in, item, false);
      if (!in.ok() || !value.push_back(item)) {
        in.fail();
        return;
      }
    }
  }
  static constexpr void describe(DsdlText& text) noexcept {
    Item::describe(text);
    text.add("[<=");
    text.add(kCapacity);
    text.add("]");
  }
};

/// Padding: zeros out, anything in.
template <unsigned kBits>
struct Void {
  static constexpr std::size_t kMinBits = kBits;
  static constexpr std::size_t kMaxBits = kBits;
};

/// One row of a message's table: how it travels, which member it is, its DSDL name.
template <typename WireType, auto kMemberPointer>
struct Field {
  using Wire = WireType;
  static constexpr auto kMember = kMemberPointer;
  std::string_view name;
};

/// A row that is padding.
template <unsigned kBits>
struct Padding {
  using Wire = Void<kBits>;
};

template <typename T>
inline constexpr bool kIsPadding = false;
template <unsigned kBits>
inline constexpr bool kIsPadding<Padding<kBits>> = true;

/// Calls visit(field, is_last) for each row of T's table, in order.
template <typename T, typename Visit>
constexpr void for_each_field(Visit&& visit) {
  constexpr std::size_t kCount = std::tuple_size_v<std::remove_cvref_t<decltype(T::kFields)>>;
  [&]<std::size_t... kIndex>(std::index_sequence<kIndex...>) {
    (visit(std::get<kIndex>(T::kFields), kIndex + 1 == kCount), ...);
  }
  (std::make_index_sequence<kCount>{});
}

namespace detail {

template <typename T>
constexpr std::size_t sum_bits(bool longest) noexcept {
  std::size_t bits = 0;
  for_each_field<T>([&](const auto& field, bool) {
    using Wire = typename std::remove_cvref_t<decltype(field)>::Wire;
    bits += longest ? Wire::kMaxBits : Wire::kMinBits;
  });
  return bits;
}

template <typename T>
constexpr void describe_fields(DsdlText& text) noexcept {
  for_each_field<T>([&](const auto& field, bool) {
    using Row = std::remove_cvref_t<decltype(field)>;
    text.add("\n");
    if constexpr (kIsPadding<Row>) {
      text.add("void");
      text.add(Row::Wire::kMaxBits);
    } else {
      Row::Wire::describe(text);
      text.add(" ");
      text.add(field.name);
    }
  });
}

template <typename T>
constexpr void extend_fields(DsdlText& text) noexcept {
  for_each_field<T>([&](const auto& field, bool) {
    using Row = std::remove_cvref_t<decltype(field)>;
    if constexpr (!kIsPadding<Row>) {
      if (Row::Wire::kNested != 0) text.extend(Row::Wire::kNested);
    }
  });
}

template <typename T>
constexpr void write_fields(BitWriter& out, const T& message, bool tail) noexcept {
  for_each_field<T>([&](const auto& field, bool is_last) {
    using Row = std::remove_cvref_t<decltype(field)>;
    if constexpr (kIsPadding<Row>) {
      out.put<Row::Wire::kMaxBits>(0);
    } else {
      Row::Wire::write(out, message.*Row::kMember, tail && is_last);
    }
  });
}

template <typename T>
constexpr void read_fields(BitReader& in, T& message, bool tail) noexcept {
  for_each_field<T>([&](const auto& field, bool is_last) {
    using Row = std::remove_cvref_t<decltype(field)>;
    if constexpr (kIsPadding<Row>) {
      (void)in.get<Row::Wire::kMaxBits>();
    } else {
      Row::Wire::read(in, message.*Row::kMember, tail && is_last);
    }
  });
}

}  // namespace detail

/// The data type signature, from the table alone: seeds the CRC of multi-frame transfers.
template <typename T>
[[nodiscard]] consteval std::uint64_t message_signature() noexcept {
  DsdlText text;
  text.add(T::kName);
  detail::describe_fields<T>(text);
  detail::extend_fields<T>(text);
  return text.signature();
}
template <typename Request, typename Response>
[[nodiscard]] consteval std::uint64_t service_signature() noexcept {
  DsdlText text;
  text.add(Request::kName);
  detail::describe_fields<Request>(text);
  text.add("\n---");
  detail::describe_fields<Response>(text);
  detail::extend_fields<Request>(text);
  detail::extend_fields<Response>(text);
  return text.signature();
}

/// A compound type inside another one.
template <typename T>
struct Nested {
  using Value = T;
  static constexpr std::size_t kMinBits = detail::sum_bits<T>(false);
  static constexpr std::size_t kMaxBits = detail::sum_bits<T>(true);
  static constexpr std::uint64_t kNested = message_signature<T>();
  static constexpr void write(BitWriter& out, const T& value, bool tail) noexcept {
    detail::write_fields(out, value, tail);
  }
  static constexpr void read(BitReader& in, T& value, bool tail) noexcept {
    detail::read_fields(in, value, tail);
  }
  static constexpr void describe(DsdlText& text) noexcept { text.add(T::kName); }
};

template <typename T>
inline constexpr std::size_t kMaxPayload_bytes = (detail::sum_bits<T>(true) + 7) / 8;

/// Writes the payload of `message` (without transfer CRC and tail byte). Integers and finite halves beyond
/// their range are clamped. The result is the number of bytes; kCapacity: `out` is too small (its content is
/// then of no use); kMaxPayload_bytes<T> always suffices.
template <typename T>
[[nodiscard]] Result<std::size_t> encode(const T& message, std::span<std::uint8_t> out) noexcept {
  BitWriter writer(out);
  detail::write_fields(writer, message, true);
  writer.finish();
  if (!writer.ok()) return Status::kCapacity;
  return writer.size_bytes();
}

/// Reads a payload. kInvalidArgument: too short, too long by a byte or more, or an array beyond its capacity;
/// `message` is then partly written and of no use.
template <typename T>
[[nodiscard]] Status decode(std::span<const std::uint8_t> payload, T& message) noexcept {
  BitReader reader(payload);
  detail::read_fields(reader, message, true);
  return reader.ok() && reader.remaining_bits() < 8 ? Status::kOk : Status::kInvalidArgument;
}

}  // namespace roborun::firmware_if::dronecan
