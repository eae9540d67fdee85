/// Moving bodies from the [[body]] tables of a TOML file.
#pragma once

#include <vector>

#include "platform/input/toml_reader.hpp"
#include "platform/sitl/world/world.hpp"

namespace roborun::sitl {

/// Any number of [[body]] with radius (0, 100], path = [[x, y, z], ...] (of its centre), optional height (an
/// upright cylinder of this height; a sphere if left out), speed (0 .. 50, m/s; 0 if left out) and at_s (it
/// waits at the first point until then, 0); metres, at most 1,000 bodies and 1,000 points each. Throws
/// InputError with file, line, key and what would be right.
[[nodiscard]] std::vector<Body> read_bodies(const input::TomlReader& reader, const toml::table& root);

}  // namespace roborun::sitl
