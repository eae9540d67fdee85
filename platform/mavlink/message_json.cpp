#include "platform/mavlink/message_json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>

#include "firmware_if/mavlink/dictionary.hpp"
#include "platform/input/byte_text.hpp"
#include "platform/input/input_error.hpp"

namespace roborun::mavlink {
namespace {

namespace mav = firmware_if::mavlink;
using OrderedJson = nlohmann::ordered_json;
using mav::FieldType;

constexpr std::uint32_t kUsualNan = 0x7fc00000;
constexpr std::size_t kHash_bytes = 6;  // the last of a signature block

constexpr bool is_signed(FieldType type) {
  return type == FieldType::kInt8 || type == FieldType::kInt16 || type == FieldType::kInt32 ||
         type == FieldType::kInt64;
}

// ---- out

/// A double whose shortest decimal digits are those of the float: 0.1, not 0.10000000149011612.
double with_few_digits(float value) {
  const std::string digits = fmt::format("{}", value);
  double near = 0.0;
  std::from_chars(digits.data(), digits.data() + digits.size(), near);
  return static_cast<float>(near) == value ? near : static_cast<double>(value);
}

OrderedJson float_value(std::uint32_t bits) {
  const auto value = std::bit_cast<float>(bits);
  if (std::isinf(value)) return value > 0 ? "Infinity" : "-Infinity";
  if (!std::isnan(value)) return with_few_digits(value);
  return bits == kUsualNan ? "NaN" : fmt::format("NaN(0x{:08x})", bits);
}

OrderedJson item_value(std::uint64_t bits, FieldType type) {
  if (type == FieldType::kFloat) return float_value(static_cast<std::uint32_t>(bits));
  if (!is_signed(type)) return bits;
  const auto unused = static_cast<unsigned>(64 - 8 * mav::size_bytes(type));
  return static_cast<std::int64_t>(bits << unused) >> unused;
}

OrderedJson field_value(const mav::Field& field, std::span<const std::uint8_t> payload) {
  if (field.type == FieldType::kChar) {
    std::vector<std::uint8_t> bytes(field.count());
    for (std::size_t i = 0; i < bytes.size(); ++i)
      bytes[i] = static_cast<std::uint8_t>(mav::read_bits(payload, field, i));
    while (!bytes.empty() && bytes.back() == 0) bytes.pop_back();
    return input::text_of_bytes(bytes);
  }
  if (field.array_count == 0) return item_value(mav::read_bits(payload, field), field.type);
  OrderedJson items = OrderedJson::array();
  for (std::size_t i = 0; i < field.count(); ++i)
    items.push_back(item_value(mav::read_bits(payload, field, i), field.type));
  return items;
}

OrderedJson signature_of(std::span<const std::uint8_t, mav::kSignatureBlock_bytes> block) {
  mav::SigningTime timestamp = 0;
  for (std::size_t i = 0; i < 6; ++i) timestamp |= static_cast<mav::SigningTime>(block[1 + i]) << (8U * i);
  OrderedJson out;
  out["link_id"] = block[0];
  out["timestamp"] = timestamp;
  out["hash"] = fmt::format("{:02x}", fmt::join(block.last<kHash_bytes>(), ""));
  return out;
}

// ---- in

[[noreturn]] void refuse(std::string_view name, const OrderedJson& value, std::string_view wanted) {
  std::string given = value.dump(-1, ' ', false, OrderedJson::error_handler_t::replace);
  if (given.size() > 60) given = given.substr(0, 60) + " ...";
  throw InputError(fmt::format("{}: {} is not {}", name, given, wanted));
}

std::uint64_t whole(const OrderedJson& value, std::string_view name, std::int64_t low, std::uint64_t high) {
  const bool fits = value.is_number_unsigned()
                        ? value.get<std::uint64_t>() <= high
                        : value.is_number_integer() && value.get<std::int64_t>() >= low;
  if (!fits) refuse(name, value, fmt::format("a whole number from {} to {}", low, high));
  return value.is_number_unsigned() ? value.get<std::uint64_t>()
                                    : static_cast<std::uint64_t>(value.get<std::int64_t>());
}

std::uint64_t whole_or(const OrderedJson& object, const char* name, std::uint64_t high,
                       std::uint64_t otherwise) {
  return object.contains(name) ? whole(object[name], name, 0, high) : otherwise;
}

std::uint32_t float_bits(const OrderedJson& value, const std::string& name) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  if (value == "NaN") return kUsualNan;
  if (value == "Infinity") return std::bit_cast<std::uint32_t>(kInfinity);
  if (value == "-Infinity") return std::bit_cast<std::uint32_t>(-kInfinity);
  if (value.is_string()) {
    const auto text = value.get<std::string>();
    std::uint32_t bits = 0;
    if (text.size() == 15 && text.starts_with("NaN(0x") && text.ends_with(')')) {
      const auto [end, error] = std::from_chars(text.data() + 6, text.data() + 14, bits, 16);
      if (error == std::errc{} && end == text.data() + 14 && std::isnan(std::bit_cast<float>(bits)))
        return bits;
    }
  }
  if (!value.is_number()) refuse(name, value, "a number, NaN, NaN(0x7fc00001), Infinity or -Infinity");
  const auto number = static_cast<float>(value.get<double>());
  if (!std::isfinite(number)) refuse(name, value, "a number that 32 bits hold");
  return std::bit_cast<std::uint32_t>(number);
}

std::uint64_t item_bits(const OrderedJson& value, FieldType type, const std::string& name) {
  if (type == FieldType::kFloat) return float_bits(value, name);
  const auto size_bits = static_cast<unsigned>(8 * mav::size_bytes(type));
  const std::uint64_t all = std::numeric_limits<std::uint64_t>::max() >> (64U - size_bits);
  if (!is_signed(type)) return whole(value, name, 0, all);
  return whole(value, name, -static_cast<std::int64_t>(all / 2) - 1, all / 2);
}

void write_field(mav::Payload& payload, const mav::Field& field, const OrderedJson& value) {
  const auto name = fmt::format("field '{}'", field.name);
  if (field.type == FieldType::kChar) {
    if (!value.is_string()) refuse(name, value, "a text");
    const auto bytes = input::bytes_of_text(value.get<std::string>());
    if (!bytes) refuse(name, value, "a text of code points below U+0100");
    if (bytes->size() > field.count()) refuse(name, value, fmt::format("at most {} bytes", field.count()));
    for (std::size_t i = 0; i < bytes->size(); ++i) mav::write_bits(payload, field, i, (*bytes)[i]);
  } else if (field.array_count == 0) {
    mav::write_bits(payload, field, 0, item_bits(value, field.type, name));
  } else {
    if (!value.is_array() || value.size() != field.count())
      refuse(name, value, fmt::format("an array of {}", field.count()));
    for (std::size_t i = 0; i < field.count(); ++i)
      mav::write_bits(payload, field, i, item_bits(value[i], field.type, name));
  }
}

mav::Payload payload_of(const mav::MessageType& type, const OrderedJson& fields, bool v1) {
  if (!fields.is_object()) refuse("fields", fields, "an object");
  mav::Payload payload{};
  for (const auto& [name, value] : fields.items()) {
    const auto field = std::find_if(type.fields.begin(), type.fields.end(),
                                    [&name = name](const mav::Field& f) { return f.name == name; });
    if (field == type.fields.end())
      throw InputError(fmt::format("fields: {} has no field '{}'", type.name, name.substr(0, 60)));
    if (v1 && field->extension)
      throw InputError(fmt::format("field '{}': is an extension: MAVLink 1 has none", name));
    write_field(payload, *field, value);
  }
  return payload;
}

const mav::MessageType& type_of(const OrderedJson& object) {
  const mav::MessageType* type = nullptr;
  if (object.contains("msgid")) {
    type = mav::find_message(static_cast<std::uint32_t>(whole(object["msgid"], "msgid", 0, 0xffffff)));
    if (type == nullptr) refuse("msgid", object["msgid"], "a message that roborun knows");
    if (object.contains("name") && object["name"] != std::string(type->name))
      throw InputError(fmt::format("name: msgid {} is {}", type->id, type->name));
    return *type;
  }
  if (!object.contains("name") || !object["name"].is_string())
    throw InputError("must have a name or a msgid: {\"name\":\"HEARTBEAT\",\"fields\":{..}}");
  type = mav::find_message(object["name"].get<std::string>());
  if (type == nullptr) refuse("name", object["name"], "a message that roborun knows");
  return *type;
}

void refuse_unknown_keys(const OrderedJson& object) {
  constexpr std::array<std::string_view, 10> kKnown{"time_us", "msgid",  "name",   "version",   "seq",
                                                    "sysid",   "compid", "signed", "signature", "fields"};
  if (!object.is_object()) throw InputError("must be an object with name or msgid, and fields");
  for (const auto& [name, _] : object.items()) {
    if (std::find(kKnown.begin(), kKnown.end(), name) == kKnown.end())
      throw InputError(
          fmt::format("'{}' is unknown: must be one of {}", name.substr(0, 60), fmt::join(kKnown, ", ")));
  }
}

/// The hash as it stands in the object.
std::array<std::uint8_t, kHash_bytes> hash_of(const OrderedJson& signature) {
  const OrderedJson given = signature.contains("hash") ? signature["hash"] : OrderedJson();
  const auto text = given.is_string() ? given.get<std::string>() : std::string();
  std::array<std::uint8_t, kHash_bytes> hash{};
  bool good = text.size() == 2 * hash.size();
  for (std::size_t i = 0; good && i < hash.size(); ++i) {
    const char* at = text.data() + 2 * i;
    good = std::from_chars(at, at + 2, hash.at(i), 16).ptr == at + 2;
  }
  if (!good) refuse("signature.hash", given, "12 hexadecimal digits (or give --key)");
  return hash;
}

std::vector<std::uint8_t> frame_of(const mav::MessageType& type, const mav::FrameHeader& header,
                                   const mav::Payload& payload, mav::Signer* signer) {
  std::vector<std::uint8_t> bytes(mav::kMostFrame_bytes);
  bytes.resize(mav::write_frame(type, header, payload, signer, bytes).value());
  return bytes;
}

std::vector<std::uint8_t> signed_frame(const mav::MessageType& type, const mav::FrameHeader& header,
                                       const mav::Payload& payload, const OrderedJson& signature,
                                       const mav::SigningKey* key) {
  if (!signature.is_object() || !signature.contains("link_id") || !signature.contains("timestamp"))
    refuse("signature", signature, "an object with link_id, timestamp and (without --key) hash");
  const auto link_id = static_cast<std::uint8_t>(whole(signature["link_id"], "signature.link_id", 0, 255));
  mav::Signer signer(key != nullptr ? *key : mav::SigningKey{}, link_id,
                     whole(signature["timestamp"], "signature.timestamp", 0, mav::kMostSigningTime));
  std::vector<std::uint8_t> bytes = frame_of(type, header, payload, &signer);
  if (key == nullptr) {
    const auto hash = hash_of(signature);
    std::copy(hash.begin(), hash.end(), bytes.end() - kHash_bytes);
  }
  return bytes;
}

}  // namespace

OrderedJson to_json(const mav::Frame& frame) {
  OrderedJson out;
  out["msgid"] = frame.msgid;
  out["name"] = frame.type->name;
  out["version"] = frame.version;
  out["seq"] = frame.header.seq;
  out["sysid"] = frame.header.sysid;
  out["compid"] = frame.header.compid;
  out["signed"] = frame.has_signature;
  if (frame.has_signature) out["signature"] = signature_of(frame.bytes.last<mav::kSignatureBlock_bytes>());
  OrderedJson fields = OrderedJson::object();
  for (const mav::Field& field : frame.type->fields) {
    if (frame.version == 2 || !field.extension)
      fields[std::string(field.name)] = field_value(field, frame.payload);
  }
  out["fields"] = std::move(fields);
  return out;
}

std::vector<std::uint8_t> from_json(const OrderedJson& object, std::uint8_t seq, const mav::SigningKey* key) {
  refuse_unknown_keys(object);
  const mav::MessageType& type = type_of(object);
  const std::uint64_t version = whole_or(object, "version", 2, 2);
  if (version == 0) refuse("version", object["version"], "1 or 2");
  const mav::FrameHeader header{.seq = static_cast<std::uint8_t>(whole_or(object, "seq", 255, seq)),
                                .sysid = static_cast<std::uint8_t>(whole_or(object, "sysid", 255, 1)),
                                .compid = static_cast<std::uint8_t>(whole_or(object, "compid", 255, 191))};
  const mav::Payload payload =
      payload_of(type, object.contains("fields") ? object["fields"] : OrderedJson::object(), version == 1);
  const OrderedJson is_signed_value = object.contains("signed") ? object["signed"] : OrderedJson(false);
  if (!is_signed_value.is_boolean()) refuse("signed", is_signed_value, "true or false");

  if (version == 1) {
    if (is_signed_value.get<bool>()) throw InputError("signed: MAVLink 1 has no signatures");
    std::vector<std::uint8_t> bytes(mav::kMostFrame_bytes);
    auto length = mav::write_frame_v1(type, header, payload, bytes);
    if (!length.ok()) throw InputError(fmt::format("version: {} has no MAVLink 1 frame", type.name));
    bytes.resize(length.value());
    return bytes;
  }
  if (!is_signed_value.get<bool>()) return frame_of(type, header, payload, nullptr);
  return signed_frame(type, header, payload,
                      object.contains("signature") ? object["signature"] : OrderedJson(), key);
}

}  // namespace roborun::mavlink
