#include "platform/app/port_bridge_command.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <array>
#include <cstdio>
#include <ctime>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "platform/app/exit_code.hpp"
#include "platform/app/options.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/stop_signal.hpp"
#include "platform/mavlink/link.hpp"
#include "platform/rt/lane_thread.hpp"
#include "platform/rt/monotonic_clock.hpp"
#include "platform/sensor_port/port_bridge.hpp"

namespace roborun::app {
namespace {

namespace sp = sensor_port;

struct BridgeOptions {
  std::string name, link;
  double seconds{std::numeric_limits<double>::infinity()};
  bool json{false};
};

constexpr int kPriority = 30;  // a flight waits for what comes through here

class BridgeRun {
 public:
  BridgeRun(const BridgeOptions& options, sp::BridgeEnd end)
      : options_(options),
        end_(end),
        link_(mavlink::parse_link(options.link)),
        bridge_(options.name, end,
                static_cast<std::uint32_t>(rt::monotonic_now().time_since_epoch().count())) {}

  int run() {
    const input::StopOnSignal stop;
    rt::take_priority(kPriority);
    const MonotonicTime start = rt::monotonic_now();
    MonotonicTime said = start;
    while (!input::StopOnSignal::requested() && seconds(rt::monotonic_now() - start) < options_.seconds) {
      step();
      if (!options_.json && rt::monotonic_now() - said >= Nanos{1'000'000'000}) {
        said = rt::monotonic_now();
        fmt::print(stderr, "{}\n", line());
      }
    }
    print();
    if (input::StopOnSignal::requested()) return kInterrupted;
    return has_heard_ ? kDone : kNotGood;
  }

 private:
  void step() {
    const auto send = [this](std::span<const std::uint8_t> datagram) {
      (void)link_.write(rt::monotonic_now(), datagram);
    };
    std::array<std::uint8_t, 2048> bytes{};
    constexpr int kMost = 256;  // whoever floods does not keep it from sending
    for (int i = 0; i < kMost; ++i) {
      const MonotonicTime now = rt::monotonic_now();
      const std::size_t count = link_.read(now, bytes);
      if (count == 0) break;
      bridge_.take(now, std::span(bytes).first(count), send);
    }
    if (!link_.is_open() && link_.why() != 0)
      throw InputError(
          fmt::format("--link: {}: {}", options_.link, std::generic_category().message(link_.why())));
    const MonotonicTime now = rt::monotonic_now();
    bridge_.step(now, send);
    has_heard_ = has_heard_ || bridge_.is_heard(now);
    pollfd waits{link_.fd(), POLLIN, 0};
    constexpr timespec kWait{0, 250'000};
    (void)ppoll(&waits, 1, &kWait, nullptr);
  }

  [[nodiscard]] std::string line() const {
    const auto& out = bridge_.sender();
    const auto& in = bridge_.receiver();
    if (!bridge_.is_heard(rt::monotonic_now()))
      return fmt::format("{}: {}", options_.name,
                         end_ == sp::BridgeEnd::kShares ? "waits for roborun port fetch"
                                                        : "no answer: is roborun port share there?");
    if (!bridge_.is_matched())
      return fmt::format("{}: the clocks are not matched yet: {} answers took more than 10 ms", options_.name,
                         bridge_.slow_answers());
    const std::string clock =
        end_ == sp::BridgeEnd::kFetches
            ? fmt::format(", clocks within {:.2f} ms", 1e3 * seconds(bridge_.clock_error()))
            : "";
    return fmt::format(
        "{}: sent {} samples and {} pictures of {} ports, {} pieces again; got {} and {} of {}, lost {}{}",
        options_.name, out.counters().samples, out.counters().pictures, out.ports(), out.counters().repeated,
        in.counters().samples, in.counters().pictures, in.ports(), in.counters().lost, clock);
  }

  void print() const {
    if (!options_.json) return;
    const auto& out = bridge_.sender().counters();
    const auto& in = bridge_.receiver().counters();
    nlohmann::ordered_json json{{"port", options_.name}, {"heard", has_heard_}};
    json["sent"] = {{"ports", bridge_.sender().ports()},
                    {"samples", out.samples},
                    {"pictures", out.pictures},
                    {"pieces", out.pieces},
                    {"pieces_again", out.repeated}};
    json["got"] = {{"ports", bridge_.receiver().ports()},
                   {"samples", in.samples},
                   {"pictures", in.pictures},
                   {"lost", in.lost},
                   {"late", in.late}};
    json["refused"] = bridge_.refused();
    json["foreign"] = link_.counters().foreign_datagrams;
    json["clock_error_s"] = end_ == sp::BridgeEnd::kFetches && bridge_.is_matched()
                                ? nlohmann::ordered_json(seconds(bridge_.clock_error()))
                                : nlohmann::ordered_json(nullptr);
    fmt::print("{}\n", json.dump());
  }

  BridgeOptions options_;
  sp::BridgeEnd end_;
  mavlink::Link link_;
  sp::PortBridge bridge_;
  bool has_heard_{false};
};

void add_end(CLI::App& port_app, std::function<int()>& run, sp::BridgeEnd end) {
  const bool shares = end == sp::BridgeEnd::kShares;
  const auto options = std::make_shared<BridgeOptions>();
  CLI::App* app = port_app.add_subcommand(
      shares ? "share" : "fetch",
      shares ? "Let another machine read the ports of this vehicle (all but its truth), and write its bus-out"
             : "Read the ports of a vehicle on another machine, as if they were written here");
  app->add_option("name", options->name, "NAME of the ports NAME-imu, NAME-camera1, ...")->required();
  app->add_option("--link", options->link,
                  shares ? "Where to wait: udpin://:PORT, or udpin://ADDRESS:PORT"
                         : "Where port share waits: udpout://ADDRESS:PORT")
      ->required();
  add_number(*app, "--seconds", options->seconds, 0.1, 1e9,
             "Stop after this many seconds; default: at Ctrl-C (exit code 130)")
      ->default_str("");
  app->add_flag("--json", options->json, "One object at the end: what was sent, got, lost and refused");
  app->footer(
      "A plant here, a runtime there:\n"
      "  roborun plant --vehicle paper --env 14 --port demo\n"
      "  roborun port share demo --link udpin://:14600\n"
      "  roborun port fetch demo --link udpout://192.168.1.2:14600      on the other machine\n"
      "  roborun run --vehicle paper --link port:demo --wait 60 ...      there, too\n"
      "Nothing is signed or encrypted: whoever reaches this port of yours flies the plant. Exit code 1: the "
      "other end\nwas never heard.");
  app->callback([options, &run, end, shares] {
    run = [options, end, shares] {
      const auto kind = mavlink::parse_link(options->link).kind;
      using Kind = mavlink::LinkAddress::Kind;
      if (kind != (shares ? Kind::kUdpIn : Kind::kUdpOut))
        throw InputError(fmt::format("--link: {}: must be {}", options->link,
                                     shares ? "udpin://:PORT" : "udpout://ADDRESS:PORT"));
      return BridgeRun(*options, end).run();
    };
  });
}

}  // namespace

void add_port_bridge_commands(CLI::App& port_app, std::function<int()>& run) {
  add_end(port_app, run, sp::BridgeEnd::kShares);
  add_end(port_app, run, sp::BridgeEnd::kFetches);
}

}  // namespace roborun::app
