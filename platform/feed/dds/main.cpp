/// The process behind `roborun feed dds`: alone in linking Cyclone DDS.
#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <memory>
#include <optional>

#include "platform/feed/dds/flight_publisher.hpp"
#include "platform/feed/dds/sensor_feed.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/json_reader.hpp"
#include "platform/input/stop_signal.hpp"

namespace {

using roborun::feed::DdsConfig;

constexpr int kRefused = 2;
constexpr int kInterrupted = 130;
constexpr std::int64_t kLook_ns = 20'000'000;

void say(const std::string& line) { fmt::print(stderr, "roborun: {}\n", line); }

int run(const DdsConfig& config) {
  const roborun::input::StopOnSignal stop;
  roborun::feed::DdsNode node(config.domain);
  roborun::feed::SensorFeed feed(node, config, &say);
  std::optional<roborun::feed::FlightPublisher> publisher;
  if (config.live > 0) publisher.emplace(node, config.prefix, static_cast<std::uint16_t>(config.live));
  while (!roborun::input::StopOnSignal::requested()) {
    node.wait(kLook_ns);
    feed.step();
    if (publisher) publisher->step(roborun::feed::clocks_now().monotonic.count());
  }
  for (const std::string& line : feed.totals()) fmt::print("{}\n", line);
  if (publisher)
    fmt::print("{} messages published, {} of the live view not understood\n", publisher->published(),
               publisher->not_understood());
  return kInterrupted;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc != 2) throw roborun::InputError("roborun-feed-dds is started by 'roborun feed dds'");
    return run(roborun::input::parse_json<nlohmann::json>(argv[1]).get<DdsConfig>());
  } catch (const std::exception& error) {
    say(error.what());
    return kRefused;
  }
}
