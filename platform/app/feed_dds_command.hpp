/// `roborun feed dds`: ROS 2 topics at sensor ports, and a flight on ROS 2 topics.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace roborun::app {

void add_feed_dds_command(CLI::App& feed, std::function<int()>& run);

}  // namespace roborun::app
