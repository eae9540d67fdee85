#include "platform/app/gpio_command.hpp"

#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "firmware_if/kill_switch.hpp"
#include "platform/app/exit_code.hpp"
#include "platform/app/options.hpp"
#include "platform/gpio/gpiod_line.hpp"
#include "platform/input/input_error.hpp"

namespace roborun::app {
namespace {

struct GpioOptions {
  bool json{false};
  std::string open;
  std::string closed;
  bool active_low{false};
  bool pull_up{false};
  double seconds{10.0};
};

int list(bool json) {
  const std::vector<gpio::LineInfo> lines = gpio::list_lines();
  for (const gpio::LineInfo& line : lines) {
    if (json) {
      const nlohmann::ordered_json out{{"chip", line.chip},
                                       {"offset", line.offset},
                                       {"name", line.name},
                                       {"direction", line.output ? "output" : "input"},
                                       {"consumer", line.consumer}};
      fmt::print("{}\n", out.dump());
    } else {
      fmt::print("{}:{:<3} {:<24} {:<6} {}\n", line.chip, line.offset, line.name,
                 line.output ? "output" : "input",
                 line.consumer.empty() ? "free" : "used by " + line.consumer);
    }
  }
  if (lines.empty()) throw InputError("gpio list: no lines: no GPIO chip here, or no right to open one");
  return kDone;
}

int check(const GpioOptions& options) {
  gpio::GpiodInput open;
  gpio::GpiodInput closed;
  const auto bias = options.pull_up ? firmware_if::GpioBias::kPullUp : firmware_if::GpioBias::kNone;
  for (const auto& [line, name] : {std::pair{&open, options.open}, std::pair{&closed, options.closed}}) {
    const std::string why = line->open({.name = name, .active_low = options.active_low, .bias = bias});
    if (!why.empty()) throw InputError(why);
  }
  firmware_if::KillSwitch sut(open, closed);
  fmt::print(stderr, "press and release the kill switch within {:.0f} s\n", options.seconds);
  constexpr std::chrono::microseconds kPeriod{2500};
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(options.seconds);
  while (std::chrono::steady_clock::now() < end && !(sut.proven() && sut.killed() && sut.released())) {
    (void)sut.sample();
    std::this_thread::sleep_for(kPeriod);
  }
  const auto& counters = sut.counters();
  const bool good = sut.proven() && sut.killed() && sut.released();
  fmt::print(
      "{}: {} samples, {} pressed, {} with both lines the same, {} glitches, {} edges\n",
      good ? "good: pressed and released, and the kill stayed" : "NOT GOOD: both positions were not seen",
      counters.samples, counters.pressed, counters.faults, counters.glitches, counters.edges);
  return good ? kDone : kNotGood;
}

}  // namespace

void add_gpio_command(CLI::App& app, std::function<int()>& run) {
  auto options = std::make_shared<GpioOptions>();
  CLI::App* gpio_app = app.add_subcommand("gpio", "Digital lines: list them, check a kill switch");
  gpio_app->require_subcommand(1);

  CLI::App* list_app =
      gpio_app->add_subcommand("list", "All lines: chip, offset, name, direction, who uses it");
  list_app->add_flag("--json", options->json, "One JSON object per line");
  list_app->callback([options, &run] { run = [options] { return list(options->json); }; });

  CLI::App* check_app = gpio_app->add_subcommand(
      "check",
      "A kill switch with a normally open and a normally closed contact: wait for a press and a release");
  check_app->add_option("--open", options->open, "Line of the normally open contact: a name or CHIP:OFFSET")
      ->required();
  check_app->add_option("--closed", options->closed, "Line of the normally closed contact")->required();
  check_app->add_flag("--active-low", options->active_low, "A closed contact pulls its line low");
  check_app->add_flag("--pull-up", options->pull_up, "Switch on the pull-up of the lines");
  add_number(*check_app, "--seconds", options->seconds, 0.1, 3600.0, "How long to wait, 0.1 .. 3600");
  check_app->callback([options, &run] { run = [options] { return check(*options); }; });
}

}  // namespace roborun::app
