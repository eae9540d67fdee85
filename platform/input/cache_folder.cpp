#include "platform/input/cache_folder.hpp"

#include <cstdlib>

namespace roborun::input {

std::string cache_folder() {
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache != '\0')
    return std::string(cache) + "/roborun";
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0')
    return std::string(home) + "/.cache/roborun";
  return {};
}

}  // namespace roborun::input
