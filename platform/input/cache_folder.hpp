/// Where this program keeps what it can make anew.
#pragma once

#include <string>

namespace roborun::input {

/// $XDG_CACHE_HOME/roborun, or $HOME/.cache/roborun; empty where neither is set. It may not exist.
[[nodiscard]] std::string cache_folder();

}  // namespace roborun::input
