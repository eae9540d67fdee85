#include "platform/app/can_command.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "firmware_if/dronecan/node.hpp"
#include "platform/app/exit_code.hpp"
#include "platform/app/input_lines.hpp"
#include "platform/app/options.hpp"
#include "platform/can/candump.hpp"
#include "platform/can/message_json.hpp"
#include "platform/can/socket_can.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/json_reader.hpp"
#include "platform/input/stop_signal.hpp"
#include "platform/rt/monotonic_clock.hpp"

namespace roborun::app {
namespace {

namespace dc = firmware_if::dronecan;
using Json = nlohmann::ordered_json;

const char* kind_name(dc::TransferKind kind) {
  if (kind == dc::TransferKind::kMessage) return "message";
  return kind == dc::TransferKind::kRequest ? "request" : "response";
}

/// One bus of a log: what its nodes are saying. 1.1 MB.
struct ListeningPost {
  // Every type of every node at once.
  std::vector<dc::Reassembler::Session> sessions{dc::kAllTypes.size() * dc::kMostNodeId};
  dc::Reassembler reassembler{dc::kAllTypes, sessions, 0};
};

class Decoder {
 public:
  Decoder(std::string source, bool json) : source_(std::move(source)), json_(json) {}

  void take(const can::LogLine& line, const std::string& where) {
    if (posts_.size() == kMostInterfaces && !posts_.contains(line.interface))
      throw InputError(fmt::format("{}: interface '{}' is one too many: must be at most {} in a log", where,
                                   line.interface.substr(0, kLongestInterface), kMostInterfaces));
    auto& post = posts_[line.interface];
    if (!post) post = std::make_unique<ListeningPost>();
    dc::Transfer transfer;
    const dc::FrameVerdict verdict = post->reassembler.receive(line.frame, transfer);
    switch (verdict) {
      case dc::FrameVerdict::kAccepted:
        return;
      case dc::FrameVerdict::kNotOurs:
        ++unknown_;
        return;
      case dc::FrameVerdict::kDuplicate:
        ++duplicates_;
        return;
      case dc::FrameVerdict::kDelivered:
        print(line, transfer, where);
        return;
      default:
        complain(line, where, dc::to_string(verdict));
    }
  }
  void not_understood(const std::string& where) {
    ++lines_not_understood_;
    fmt::print(stderr, "{}{}: not a line of a candump log\n", source_, where);
  }
  void foreign() { ++foreign_; }
  void summarise() const {
    std::size_t unfinished = 0;
    for (const auto& [_, post] : posts_) unfinished += post->reassembler.unfinished();
    fmt::print(
        stderr,
        "{}{} transfers, {} malformed, {} unfinished, {} duplicate frames, {} frames of unknown types, {} "
        "frames that are not DroneCAN, {} lines not understood\n",
        source_, transfers_, malformed_, unfinished, duplicates_, unknown_, foreign_, lines_not_understood_);
  }

 private:
  void complain(const can::LogLine& line, const std::string& where, const std::string& what) {
    ++malformed_;
    fmt::print(stderr, "{}{}: {:08X}: {}\n", source_, where, line.frame.id, what);
  }

  void print(const can::LogLine& line, const dc::Transfer& transfer, const std::string& where) {
    const dc::TransferHeader& h = transfer.header;
    const dc::DataType* type = nullptr;
    for (const dc::DataType& t : dc::kAllTypes) {
      if (t.kind == h.kind && t.id == h.data_type_id) type = &t;
    }
    Json fields;
    try {
      fields = can::to_json(*type, transfer.payload);
    } catch (const can::MessageError& error) {
      complain(line, where, error.what());
      return;
    }
    ++transfers_;
    const double time_s = seconds(transfer.stamp.time_since_epoch());
    if (!json_) {
      const std::string to = h.kind == dc::TransferKind::kMessage
                                 ? "all"
                                 : fmt::format("{} ({})", h.destination_node_id, kind_name(h.kind));
      fmt::print("{:.6f} {} {:3} -> {} {} {}\n", time_s, line.interface, h.source_node_id, to, type->name,
                 fields.dump());
      return;
    }
    Json out;
    out["type"] = type->name;
    out["data_type_id"] = h.data_type_id;
    out["kind"] = kind_name(h.kind);
    out["source_node_id"] = h.source_node_id;
    if (h.kind != dc::TransferKind::kMessage) out["destination_node_id"] = h.destination_node_id;
    out["transfer_id"] = h.transfer_id;
    out["priority"] = h.priority;
    out["time_s"] = time_s;
    out["interface"] = line.interface;
    out["fields"] = std::move(fields);
    fmt::print("{}\n", out.dump(-1, ' ', false, Json::error_handler_t::replace));
  }

  static constexpr std::size_t kMostInterfaces = 32;
  static constexpr std::size_t kLongestInterface = 15;  // of the kernel

  std::string source_;
  bool json_;
  std::map<std::string, std::unique_ptr<ListeningPost>> posts_;
  std::size_t transfers_{0};
  std::size_t malformed_{0};
  std::size_t duplicates_{0};
  std::size_t unknown_{0};
  std::size_t foreign_{0};
  std::size_t lines_not_understood_{0};
};

int decode(const std::string& path, bool json) {
  Decoder decoder("roborun can decode: ", json);
  for_each_line(path, "a log of candump", [&](const std::string& text, std::size_t number) {
    if (text.find_first_not_of(" \t\r") == std::string::npos) return;
    const auto line = can::parse_log_line(text);
    if (!line) {
      decoder.not_understood(fmt::format("line {}", number));
    } else if (!line->data_frame) {
      decoder.foreign();
    } else {
      decoder.take(*line, fmt::format("line {}", number));
    }
  });
  decoder.summarise();
  return kDone;
}

int whole_number(const Json& object, const char* key, int low, int high, std::optional<int> otherwise) {
  if (!object.contains(key) && otherwise) return *otherwise;
  const bool good =
      object.contains(key) && object[key].is_number_integer() && object[key] >= low && object[key] <= high;
  if (!good) throw can::MessageError(fmt::format("{} must be a whole number from {} to {}", key, low, high));
  return object[key].get<int>();
}

/// The lines of a candump log for one object.
std::string encode_one(const Json& object, std::size_t index) {
  if (!object.is_object() || !object.contains("type") || !object["type"].is_string())
    throw can::MessageError("must be an object with type, source_node_id and fields");
  dc::TransferHeader header;
  const std::string kind = object.value("kind", "message");
  if (kind == "request") header.kind = dc::TransferKind::kRequest;
  if (kind == "response") header.kind = dc::TransferKind::kResponse;
  if (kind != kind_name(header.kind)) throw can::MessageError("kind must be message, request or response");
  const auto name = object["type"].get<std::string>();
  const dc::DataType* type = can::find_type(name, header.kind);
  if (type == nullptr) throw can::MessageError(fmt::format("type '{}' ({}) is unknown", name, kind));
  header.data_type_id = type->id;
  if (object.contains("data_type_id") && object["data_type_id"] != type->id)
    throw can::MessageError(fmt::format("data_type_id of {} is {}", name, type->id));
  const bool service = header.kind != dc::TransferKind::kMessage;
  header.source_node_id = static_cast<std::uint8_t>(whole_number(object, "source_node_id", 0, 127, {}));
  if (service)
    header.destination_node_id =
        static_cast<std::uint8_t>(whole_number(object, "destination_node_id", 1, 127, {}));
  header.priority = static_cast<std::uint8_t>(whole_number(object, "priority", 0, 31, 16));
  header.transfer_id = static_cast<std::uint8_t>(whole_number(object, "transfer_id", 0, 31, 0));

  const std::vector<std::uint8_t> payload =
      can::from_json(*type, object.contains("fields") ? object["fields"] : Json::object());
  can::LogLine line;
  line.interface = object.value("interface", "can0");
  // Without a time of their own, lines are a millisecond apart.
  const double time_s = object.value("time_s", 1e-3 * static_cast<double>(index));
  if (!(time_s >= 0.0 && time_s < 4e9)) throw can::MessageError("time_s must be from 0 to 4e9");
  const MonotonicTime stamp{Nanos{std::llround(time_s * 1e6) * 1000}};
  std::array<firmware_if::CanFrame, firmware_if::CanBus::kMostFrames> frames;
  auto count = dc::split(header, type->signature, payload, stamp, frames);
  if (!count.ok())
    throw can::MessageError(
        fmt::format("{} from node {}: an anonymous transfer is a message of type 0 .. 3 of at "
                    "most 7 bytes",
                    name, header.source_node_id));
  std::string lines;
  for (std::size_t i = 0; i < count.value(); ++i) {
    line.frame = frames.at(i);
    lines += can::format_log_line(line) + '\n';
  }
  return lines;
}

int encode(const std::string& path) {
  std::size_t index = 0;
  for_each_line(path, "a file of one JSON object per line", [&](const std::string& text, std::size_t number) {
    if (text.find_first_not_of(" \t\r") == std::string::npos) return;
    std::string frames;
    try {
      frames = encode_one(input::parse_json(text), index++);
    } catch (const std::exception& error) {
      throw InputError(fmt::format("line {}: {}", number, input::json_complaint(error)));
    }
    fmt::print("{}", frames);
  });
  return kDone;
}

void open_or_refuse(can::SocketCan& bus, const std::string& interface) {
  if (const std::string why = bus.open(interface); !why.empty()) throw InputError(why);
}

int monitor(const std::string& interface, bool json, double duration_s) {
  can::SocketCan bus;
  open_or_refuse(bus, interface);
  Decoder decoder("roborun can monitor: ", json);
  can::LogLine line{.interface = interface, .frame = {}, .data_frame = true};
  const MonotonicTime end = rt::monotonic_now() + from_seconds(duration_s);
  const input::StopOnSignal stop;
  while (rt::monotonic_now() < end && !input::StopOnSignal::requested()) {
    const Status status = bus.receive(line.frame);
    if (status == Status::kOk) {
      decoder.take(line, fmt::format("{:.6f}", seconds(line.frame.stamp.time_since_epoch())));
      continue;
    }
    (void)std::fflush(stdout);
    std::this_thread::sleep_for(std::chrono::milliseconds{1});
    if (status == Status::kIo) (void)bus.reopen();
  }
  decoder.summarise();
  const firmware_if::CanCounters& c = bus.counters();
  fmt::print(
      stderr,
      "{}: {} frames, {} lost in the queue, {} times bus-off, {} error-passive, {} without acknowledge\n",
      interface, c.received, c.lost_on_receive, c.bus_off, c.error_passive, c.no_acknowledge);
  return input::StopOnSignal::requested() ? kInterrupted : kDone;
}

/// Bench only: one throttle on one ESC, or on all of them, for a while, through the same node and gate that
/// fly; zeros before and after, and on the others. `motor`: nothing for all.
int send_esc(const std::string& interface, bool props_off, int count, std::optional<int> motor,
             double throttle_ratio, double duration_s) {
  if (!props_off)
    throw InputError("send-esc turns motors: take the propellers off and say so with --props-off");
  if (motor && *motor >= count)
    throw InputError(
        fmt::format("--motor: {} is none of {} ESCs: must be 0 .. {}", *motor, count, count - 1));
  can::SocketCan bus;
  open_or_refuse(bus, interface);
  const auto esc_count = static_cast<std::uint8_t>(count);
  firmware_if::TransmitGate gate({.esc_count = esc_count}, bus);
  std::vector<dc::Reassembler::Session> sessions(32);
  dc::Node node({.node_id = 10, .esc_count = esc_count}, gate, bus, sessions);
  std::vector<double> thrust(static_cast<std::size_t>(count), motor ? 0.0 : throttle_ratio);
  if (motor) thrust.at(static_cast<std::size_t>(*motor)) = throttle_ratio;
  const auto run_for = [&](double s) {
    for (const MonotonicTime end = rt::monotonic_now() + from_seconds(s); rt::monotonic_now() < end;) {
      const MonotonicTime t = rt::monotonic_now();
      gate.beat(t);
      (void)node.step(t, {.cycle_ok = true, .armed = true, .thrust_ratio = thrust});
      std::this_thread::sleep_for(std::chrono::microseconds{2500});
    }
  };
  run_for(0.5);  // disarmed: zeros, so that the ESCs are ready
  (void)gate.arm_unproven();
  run_for(duration_s);
  gate.disarm();
  run_for(0.5);
  fmt::print("{} commands sent, {} refused\n", node.counters().commands, node.counters().commands_refused);
  for (int i = 0; i < count; ++i) {
    const auto& esc = node.inbox().esc.at(static_cast<std::size_t>(i));
    if (esc.count == 0) {
      fmt::print("ESC {}: silent\n", i);
    } else {
      fmt::print("ESC {}: node {}, {} rpm, {:.1f} V, {:.1f} A, {} errors\n", i, esc.source_node_id,
                 esc.message.rpm, esc.message.voltage, esc.message.current, esc.message.error_count);
    }
  }
  return node.counters().commands_refused == 0 ? kDone : kNotGood;
}

struct CanOptions {
  std::string candump;
  bool json{false};
  std::string encode_file;
  std::string interface;
  double seconds{1e9};
  bool props_off{false};
  int esc_count{4};
  int motor{-1};
  bool all_motors{false};
  double throttle_ratio{0.05};
};

void add_bus_commands(CLI::App& can_app, const std::shared_ptr<CanOptions>& options,
                      std::function<int()>& run) {
  CLI::App* monitor_app = can_app.add_subcommand(
      "monitor", "As decode, live from a SocketCAN interface; counts of errors at the end");
  monitor_app->add_option("interface", options->interface, "can0")->required();
  monitor_app->add_flag("--json", options->json, "As in decode");
  add_number(*monitor_app, "--seconds", options->seconds, 0.0, 1e9,
             "Stop after this many seconds; default: at Ctrl-C (exit code 130)")
      ->default_str("");
  monitor_app->callback([options, &run] {
    run = [options] { return monitor(options->interface, options->json, options->seconds); };
  });

  CLI::App* esc_app = can_app.add_subcommand(
      "send-esc",
      "Bench only, without propellers: one throttle on one ESC for a while, zeros before and after");
  esc_app->add_option("interface", options->interface, "can0")->required();
  esc_app->add_flag("--props-off", options->props_off, "The propellers are off");
  CLI::Option* motor =
      esc_app->add_option("--motor", options->motor, "Which ESC: 0 is the first; no other turns")
          ->check(CLI::Range(0, 19));
  esc_app->add_flag("--all", options->all_motors, "All of them at once")->excludes(motor);
  add_whole(*esc_app, "--count", options->esc_count, 1, 20, "How many ESCs, 1 .. 20");
  add_number(*esc_app, "--throttle", options->throttle_ratio, 0.0, 0.3, "0 .. 0.3 of full throttle");
  add_number(*esc_app, "--seconds", options->seconds, 0.1, 60.0, "How long, 0.1 .. 60")
      ->default_str("")
      ->required();
  esc_app->callback([options, &run] {
    run = [options] {
      if (options->motor < 0 && !options->all_motors)
        throw InputError("send-esc: which motor is to turn: must have --motor N, or --all");
      return send_esc(options->interface, options->props_off, options->esc_count,
                      options->all_motors ? std::nullopt : std::optional(options->motor),
                      options->throttle_ratio, options->seconds);
    };
  });
}

}  // namespace

void add_can_command(CLI::App& app, std::function<int()>& run) {
  auto options = std::make_shared<CanOptions>();
  CLI::App* can_app = app.add_subcommand("can", "DroneCAN tools: decode, encode, monitor, try ESCs");
  can_app->require_subcommand(1);

  CLI::App* decode_app = can_app->add_subcommand(
      "decode",
      "candump log lines in, one line per transfer out. What is malformed is named on "
      "standard error, with a count "
      "of everything at the end; it does not change the exit code");
  decode_app->add_option("--candump", options->candump,
                         "Log of `candump -L` or `candump -l`; default: standard input");
  decode_app->add_flag(
      "--json", options->json,
      "One JSON object per transfer: type, data_type_id, kind, source_node_id, transfer_id, priority, "
      "time_s, interface, fields (a Timestamp `x` is `x_usec` in microseconds)");
  decode_app->callback(
      [options, &run] { run = [options] { return decode(options->candump, options->json); }; });

  CLI::App* encode_app = can_app->add_subcommand(
      "encode",
      "JSON in, one object per line as `roborun can decode --json` writes them (type, source_node_id and "
      "fields are "
      "needed; priority 16, transfer_id 0); candump log lines out, for canplayer or `roborun can decode`");
  encode_app->add_option("--json", options->encode_file, "File to read; default: standard input")
      ->expected(0, 1);
  encode_app->callback([options, &run] { run = [options] { return encode(options->encode_file); }; });
  add_bus_commands(*can_app, options, run);
}

}  // namespace roborun::app
