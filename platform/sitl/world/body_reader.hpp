/// Moving bodies from the [[body]] tables of a TOML file.
#pragma once

#include <span>
#include <vector>

#include "platform/input/toml_reader.hpp"
#include "platform/sitl/world/world.hpp"
#include "platform/sitl/world/world_key.hpp"

namespace roborun::sitl {

/// The keys of a [[body]].
[[nodiscard]] std::span<const WorldKey> body_keys() noexcept;
/// Any number of [[body]] with these keys, at most 1,000. Throws InputError with file, line, key and what would
/// be right.
[[nodiscard]] std::vector<Body> read_bodies(const input::TomlReader& reader, const toml::table& root);

}  // namespace roborun::sitl
