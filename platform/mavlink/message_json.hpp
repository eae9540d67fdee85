/// MAVLink frames as JSON, from the same tables as the codec. For tools; allocates and throws.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <vector>

#include "firmware_if/mavlink/frame.hpp"

namespace roborun::mavlink {

/// One object: msgid, name, version, seq, sysid, compid, signed, signature {link_id, timestamp, hash} if it is
/// signed, fields. Fields stand under their public names, in the units of MAVLink; those that the sender cut
/// off are zero, extensions are left out of MAVLink 1. A char array is a text without its zeros at the end, a
/// byte >= 0x80 the code point of that number. Numbers that JSON has not are "NaN", "NaN(0x7fc00001)" for other
/// bits than the usual ones, "Infinity", "-Infinity". What stands behind the fields that we know is left out.
/// Precondition: frame.type != nullptr.
[[nodiscard]] nlohmann::ordered_json to_json(const firmware_if::mavlink::Frame& frame);

/// The frame of such an object. msgid or name is needed; sysid is 1, compid 191, version 2 and seq `seq` if
/// they are not given; missing fields are zero. A signed one takes link_id and timestamp from its signature,
/// and the hash from there if `key` is nullptr. Throws InputError, in one line, for what is unknown, of the
/// wrong type or out of range.
[[nodiscard]] std::vector<std::uint8_t> from_json(const nlohmann::ordered_json& object, std::uint8_t seq,
                                                  const firmware_if::mavlink::SigningKey* key);

}  // namespace roborun::mavlink
