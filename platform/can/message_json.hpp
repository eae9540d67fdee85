/// DroneCAN messages as JSON, driven by the same tables as the codec. For tools; allocates and throws.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "firmware_if/dronecan/messages.hpp"

namespace roborun::can {

/// A message that cannot be: what is wrong with it, in one line.
class MessageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The fields of a payload under their DSDL names. A uavcan.Timestamp `x` is the number `x_usec`, the parts
/// of a uavcan.CoarseOrientation stand beside the other fields, any other nested type is an object. Text
/// (uint8 arrays called ..._name or name) is a string, a byte >= 0x80 the code point of that number. Numbers
/// that JSON has not are the strings "NaN", "Infinity", "-Infinity" (as in the JSON mapping of Protocol
/// Buffers). Throws MessageError if the payload is none of this type.
[[nodiscard]] nlohmann::ordered_json to_json(const firmware_if::dronecan::DataType& type,
                                             std::span<const std::uint8_t> payload);

/// The payload for such fields. Missing fields are zero or empty. Throws MessageError for an unknown field, a
/// value of the wrong type, an integer out of range or an array that is too long.
[[nodiscard]] std::vector<std::uint8_t> from_json(const firmware_if::dronecan::DataType& type,
                                                  const nlohmann::ordered_json& fields);

/// nullptr: no such type in the dictionary.
[[nodiscard]] const firmware_if::dronecan::DataType* find_type(const std::string& name,
                                                               firmware_if::dronecan::TransferKind kind);

}  // namespace roborun::can
