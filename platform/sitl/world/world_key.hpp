/// What a reference says of a key of a world file; its reader allows these keys and no others.
#pragma once

#include <optional>
#include <set>
#include <span>
#include <string_view>

namespace roborun::sitl {

struct WorldKey {
  std::string_view table, key;
  std::string_view form;           ///< Unit and range, or how it is written.
  std::optional<double> fallback;  ///< If it is left out; nothing: it must be there.
  std::string_view text;
};

/// Of one table.
[[nodiscard]] inline std::set<std::string_view> keys_of(std::span<const WorldKey> keys,
                                                        std::string_view table) {
  std::set<std::string_view> names;
  for (const WorldKey& k : keys) {
    if (k.table == table) names.insert(k.key);
  }
  return names;
}

}  // namespace roborun::sitl
