/// `roborun feed v4l2`: a camera of the kernel at a sensor port.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace roborun::app {

void add_feed_v4l2_command(CLI::App& feed, std::function<int()>& run);

}  // namespace roborun::app
