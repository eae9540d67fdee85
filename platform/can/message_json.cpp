#include "platform/can/message_json.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <set>
#include <string_view>

#include "platform/input/byte_text.hpp"

namespace roborun::can {
namespace {

namespace dc = firmware_if::dronecan;
using Json = nlohmann::ordered_json;

/// Which kind of wire type it is.
template <typename Wire>
struct Shape {
  static constexpr bool kNumber = true;
};
template <typename Item, std::size_t kCount>
struct Shape<dc::Fixed<Item, kCount>> {
  static constexpr bool kNumber = false;
  static constexpr bool kFixed = true;
  using ItemType = Item;
};
template <typename Item, std::size_t kCapacity>
struct Shape<dc::Dynamic<Item, kCapacity>> {
  static constexpr bool kNumber = false;
  static constexpr bool kFixed = false;
  using ItemType = Item;
};
template <typename T>
struct Shape<dc::Nested<T>> {
  static constexpr bool kNumber = false;
  using Message = T;
};

template <typename Wire>
concept IsNumber = Shape<Wire>::kNumber;
template <typename Wire>
concept IsNested = requires {
  typename Shape<Wire>::Message;
};
template <typename Wire>
concept IsArray = requires {
  typename Shape<Wire>::ItemType;
};
template <typename Wire>
concept IsText = IsArray<Wire> &&(std::is_same_v<Wire, dc::Dynamic<dc::Uint<8>, 31>> ||
                                  std::is_same_v<Wire, dc::Dynamic<dc::Uint<8>, 80>>);

// ---- out

template <typename T>
void add_fields(Json& out, const T& message, const std::string& prefix = {});

template <IsNumber Wire>
Json value_of(const typename Wire::Value& value) {
  if constexpr (std::is_same_v<typename Wire::Value, float>) {
    if (std::isnan(value)) return "NaN";
    if (std::isinf(value)) return value > 0 ? "Infinity" : "-Infinity";
    return static_cast<double>(value);
  } else {
    return value;
  }
}
template <IsNested Wire>
Json value_of(const typename Wire::Value& value) {
  Json out = Json::object();
  add_fields(out, value);
  return out;
}
template <IsArray Wire>
Json value_of(const typename Wire::Value& value) {
  using Item = typename Shape<Wire>::ItemType;
  if constexpr (IsText<Wire>) {
    return input::text_of_bytes(value.view());
  } else {
    Json out = Json::array();
    if constexpr (Shape<Wire>::kFixed) {
      for (const auto& item : value) out.push_back(value_of<Item>(item));
    } else {
      for (const auto& item : value.view()) out.push_back(value_of<Item>(item));
    }
    return out;
  }
}

template <typename T>
void add_fields(Json& out, const T& message, const std::string& prefix) {
  dc::for_each_field<T>([&](const auto& field, bool) {
    using Row = std::remove_cvref_t<decltype(field)>;
    if constexpr (!dc::kIsPadding<Row>) {
      const auto& value = message.*Row::kMember;
      const std::string name = prefix + std::string(field.name);
      if constexpr (std::is_same_v<typename Row::Wire, dc::Nested<dc::Timestamp>>) {
        add_fields(out, value, name + "_");
      } else if constexpr (std::is_same_v<typename Row::Wire, dc::Nested<dc::CoarseOrientation>>) {
        add_fields(out, value);
      } else {
        out[name] = value_of<typename Row::Wire>(value);
      }
    }
  });
}

// ---- in

[[noreturn]] void refuse(const std::string& name, const Json& value, const std::string& wanted) {
  throw MessageError(fmt::format("field '{}': {} is not {}", name, value.dump(), wanted));
}

template <typename T>
void read_fields(const Json& in, T& message, std::set<std::string>& known, const std::string& prefix);

template <IsNumber Wire>
void read_value(const Json& in, typename Wire::Value& value, const std::string& name) {
  using Value = typename Wire::Value;
  if constexpr (std::is_same_v<Value, bool>) {
    if (!in.is_boolean()) refuse(name, in, "true or false");
    value = in.get<bool>();
  } else if constexpr (std::is_same_v<Value, float>) {
    if (in == "NaN") {
      value = std::numeric_limits<float>::quiet_NaN();
    } else if (in == "Infinity" || in == "-Infinity") {
      value = (in == "Infinity" ? 1.0F : -1.0F) * std::numeric_limits<float>::infinity();
    } else if (in.is_number()) {
      value = static_cast<float>(in.get<double>());
    } else {
      refuse(name, in, "a number");
    }
  } else {
    const std::int64_t low = std::is_signed_v<Value> ? -(std::int64_t{1} << (Wire::kMaxBits - 1U)) : 0;
    const std::uint64_t high = std::is_signed_v<Value>
                                   ? (std::uint64_t{1} << (Wire::kMaxBits - 1U)) - 1U
                                   : std::numeric_limits<std::uint64_t>::max() >> (64U - Wire::kMaxBits);
    const bool fits = in.is_number_unsigned() ? in.get<std::uint64_t>() <= high
                                              : in.is_number_integer() && in.get<std::int64_t>() >= low;
    if (!fits) refuse(name, in, fmt::format("a whole number from {} to {}", low, high));
    value = in.is_number_unsigned() ? static_cast<Value>(in.get<std::uint64_t>())
                                    : static_cast<Value>(in.get<std::int64_t>());
  }
}
template <IsNested Wire>
void read_value(const Json& in, typename Wire::Value& value, const std::string& name) {
  if (!in.is_object()) refuse(name, in, "an object");
  std::set<std::string> known;
  read_fields(in, value, known, {});
  for (const auto& [key, _] : in.items()) {
    if (!known.contains(key)) throw MessageError(fmt::format("field '{}.{}' is unknown", name, key));
  }
}
template <IsArray Wire>
void read_value(const Json& in, typename Wire::Value& value, const std::string& name) {
  using Item = typename Shape<Wire>::ItemType;
  if constexpr (IsText<Wire>) {
    if (!in.is_string()) refuse(name, in, "a text");
    const auto bytes = input::bytes_of_text(in.get<std::string>());
    if (!bytes) refuse(name, in, "a text of code points below U+0100");
    for (const std::uint8_t byte : *bytes) {
      if (!value.push_back(byte)) refuse(name, in, fmt::format("at most {} bytes", value.items.size()));
    }
  } else {
    if (!in.is_array()) refuse(name, in, "an array");
    if constexpr (Shape<Wire>::kFixed) {
      if (in.size() != value.size()) refuse(name, in, fmt::format("an array of {}", value.size()));
      for (std::size_t i = 0; i < value.size(); ++i) read_value<Item>(in[i], value[i], name);
    } else {
      for (const Json& element : in) {
        typename Item::Value item{};
        read_value<Item>(element, item, name);
        if (!value.push_back(item)) refuse(name, in, fmt::format("at most {} items", value.items.size()));
      }
    }
  }
}

template <typename T>
void read_fields(const Json& in, T& message, std::set<std::string>& known, const std::string& prefix) {
  dc::for_each_field<T>([&](const auto& field, bool) {
    using Row = std::remove_cvref_t<decltype(field)>;
    if constexpr (!dc::kIsPadding<Row>) {
      auto& value = message.*Row::kMember;
      const std::string name = prefix + std::string(field.name);
      if constexpr (std::is_same_v<typename Row::Wire, dc::Nested<dc::Timestamp>>) {
        read_fields(in, value, known, name + "_");
      } else if constexpr (std::is_same_v<typename Row::Wire, dc::Nested<dc::CoarseOrientation>>) {
        read_fields(in, value, known, {});
      } else {
        known.insert(name);
        if (in.contains(name)) read_value<typename Row::Wire>(in[name], value, name);
      }
    }
  });
}

// ---- by run-time type

template <typename Visit, typename... Entries>
bool visit_type(const dc::DataType& type, const Visit& visit, std::tuple<Entries...>* /*dictionary*/) {
  const auto is = [&](const dc::DataType& t) { return t.name == type.name && t.kind == type.kind; };
  return ((is(Entries::kType) ? (visit(typename Entries::Message{}), true) : false) || ...);
}

}  // namespace

Json to_json(const dc::DataType& type, std::span<const std::uint8_t> payload) {
  Json out = Json::object();
  visit_type(
      type,
      [&](auto message) {
        if (dc::decode(payload, message) != Status::kOk)
          throw MessageError(fmt::format("{} bytes are no {}", payload.size(), type.name));
        add_fields(out, message);
      },
      static_cast<dc::Dictionary*>(nullptr));
  return out;
}

std::vector<std::uint8_t> from_json(const dc::DataType& type, const Json& fields) {
  std::vector<std::uint8_t> payload(type.max_payload_bytes);
  visit_type(
      type,
      [&](auto message) {
        read_value<dc::Nested<decltype(message)>>(fields, message, "fields");
        payload.resize(dc::encode(message, payload).value());
      },
      static_cast<dc::Dictionary*>(nullptr));
  return payload;
}

const dc::DataType* find_type(const std::string& name, dc::TransferKind kind) {
  for (const dc::DataType& type : dc::kAllTypes) {
    if (type.name == name && type.kind == kind) return &type;
  }
  return nullptr;
}

}  // namespace roborun::can
