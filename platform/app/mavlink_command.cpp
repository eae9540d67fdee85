#include "platform/app/mavlink_command.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <charconv>
#include <chrono>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "firmware_if/mavlink/flight_messages.hpp"
#include "platform/app/exit_code.hpp"
#include "platform/app/input_lines.hpp"
#include "platform/app/options.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/json_reader.hpp"
#include "platform/input/output_file.hpp"
#include "platform/input/stop_signal.hpp"
#include "platform/input/text_file.hpp"
#include "platform/mavlink/frame_log.hpp"
#include "platform/mavlink/link.hpp"
#include "platform/mavlink/message_json.hpp"
#include "platform/mavlink/signed_end.hpp"
#include "platform/rt/monotonic_clock.hpp"

namespace roborun::app {
namespace {

namespace mav = firmware_if::mavlink;
using Json = nlohmann::ordered_json;
using mav::Event;

// ---- decode

struct DecodeOptions {
  std::string file, key;
  bool json{false}, tlog{false};
};

void print_frame(const mav::Frame& frame, std::optional<std::uint64_t> time_us, bool json) {
  Json out = mavlink::to_json(frame);
  if (json) {
    if (time_us) out["time_us"] = *time_us;
    fmt::print("{}\n", out.dump());
    return;
  }
  if (time_us) fmt::print("{:.6f} ", 1e-6 * static_cast<double>(*time_us));
  fmt::print("{:3}/{:<3} {:3} {}{} {}\n", frame.header.sysid, frame.header.compid, frame.header.seq,
             frame.type->name, frame.has_signature ? " (signed)" : "", out["fields"].dump());
}

void summarise(const char* command, const mav::Receiver::Counters& counters,
               const std::map<std::uint32_t, std::size_t>& unknown) {
  const auto count = [&](Event event) { return counters.events.at(static_cast<std::size_t>(event)); };
  std::string ids;
  for (const auto& [id, times] : unknown)
    ids += fmt::format("{}{} x{}", ids.empty() ? ": " : ", ", id, times);
  fmt::print(stderr,
             "roborun mavlink {}: {} messages, {} of unknown ids{}, {} with a wrong checksum, {} with "
             "unknown flags, {} cut short, {} not signed, {} wrongly signed, {} signed but not new, {} "
             "signed by one "
             "sender too many, {} bytes outside of frames\n",
             command, count(Event::kFrame), count(Event::kUnknownId), ids, count(Event::kBadCrc),
             count(Event::kBadFlags), count(Event::kCut), count(Event::kUnsigned),
             count(Event::kBadSignature), count(Event::kReplayed), count(Event::kNoRoom),
             counters.garbage_bytes);
}

int decode(const DecodeOptions& options) {
  constexpr std::size_t kMostStreams = 1024;
  const auto key = mavlink::read_key("--key", options.key);
  std::vector<mav::Verifier::Stream> streams(kMostStreams);
  std::optional<mav::Verifier> verifier;
  // A recording may be of any age: its own time stamps are the clock.
  if (key) verifier.emplace(key->bytes(), streams, mav::SigningTime{0});
  std::map<std::uint32_t, std::size_t> unknown;
  const auto visit = [&](Event event, const mav::Frame& frame, std::optional<std::uint64_t> time_us) {
    if (event == Event::kUnknownId) ++unknown[frame.msgid];
    if (event == Event::kFrame) print_frame(frame, time_us, options.json);
  };
  input::InputFile file = open_input(options.file, "recorded MAVLink: a raw stream or a .tlog");
  mav::Verifier* const judge = verifier ? &*verifier : nullptr;
  const bool tlog = options.tlog || options.file.ends_with(".tlog");
  summarise("decode",
            tlog ? mavlink::read_tlog(file, judge, visit) : mavlink::read_stream(file, judge, visit),
            unknown);
  return kDone;
}

// ---- encode

struct EncodeOptions {
  std::string file, out, key;
};

int encode(const EncodeOptions& options) {
  input::check_outputs({{"--out", options.out}}, {options.file, options.key});
  if (options.out.empty() && isatty(STDOUT_FILENO) != 0)
    throw InputError("frames are no text: must go to --out FILE or into a pipe");
  const auto key = mavlink::read_key("--key", options.key);
  std::optional<input::OutputFile> out;
  if (!options.out.empty()) out.emplace(options.out);
  std::uint8_t index = 0;
  for_each_line(
      options.file, "a file of one JSON object per line", [&](const std::string& text, std::size_t number) {
        if (text.find_first_not_of(" \t\r") == std::string::npos) return;
        std::vector<std::uint8_t> frame;
        try {
          frame = mavlink::from_json(input::parse_json(text), index++, key ? &key->bytes() : nullptr);
        } catch (const std::exception& error) {
          throw InputError(fmt::format("line {}: {}", number, input::json_complaint(error)));
        }
        const std::string bytes(frame.begin(), frame.end());
        if (out) {
          out->write(bytes);
        } else {
          (void)std::fwrite(bytes.data(), 1, bytes.size(), stdout);  // main() says it if this fails
        }
      });
  if (out) out->commit();
  return kDone;
}

// ---- monitor

struct MonitorOptions {
  std::string url, key;
  bool json{false}, greet{false};
  double seconds{1e9};
};

/// What a ground station says each second: some autopilots answer only to somebody.
void greet(mavlink::Link& link, std::uint8_t seq, mav::Signer* signer) {
  std::array<std::uint8_t, mav::kMostFrame_bytes> bytes{};
  constexpr std::uint8_t kGroundStation = 6;
  const auto length =
      mav::write_frame(mav::Heartbeat::kType, {seq, 255, 190},
                       mav::pack(mav::Heartbeat{kGroundStation, 8, 0, 0, 4, 3}), signer, bytes);
  (void)link.write(rt::monotonic_now(), std::span<const std::uint8_t>(bytes).first(length.value()));
}

int monitor(const MonitorOptions& options) {
  mavlink::Link link(mavlink::parse_link(options.url));
  const auto key = mavlink::read_key("--key", options.key);
  const auto unix_us = std::chrono::duration_cast<std::chrono::microseconds>(
                           std::chrono::system_clock::now().time_since_epoch())
                           .count();
  std::vector<mav::Verifier::Stream> streams(64);
  std::optional<mav::Verifier> verifier;
  std::optional<mav::Signer> signer;
  if (key) verifier.emplace(key->bytes(), streams, mav::signing_time(unix_us));
  if (key) signer.emplace(key->bytes(), 190, mav::signing_time(unix_us));
  mav::Receiver receiver(verifier ? &*verifier : nullptr);
  std::map<std::uint32_t, std::size_t> unknown;
  std::array<std::uint8_t, 4096> bytes{};
  const MonotonicTime start = rt::monotonic_now();
  MonotonicTime greeted = start - Nanos{1'000'000'000};
  std::uint8_t seq = 0;
  bool was_open = false;
  const input::StopOnSignal stop;
  for (MonotonicTime at = start;
       at < start + from_seconds(options.seconds) && !input::StopOnSignal::requested();
       at = rt::monotonic_now()) {
    std::span<const std::uint8_t> came(bytes.data(), link.read(at, bytes));
    if (link.is_open() != was_open) {
      was_open = link.is_open();
      fmt::print(stderr, "roborun mavlink monitor: {} {}\n", options.url, was_open ? "open" : "lost");
    }
    if (options.greet && at - greeted >= Nanos{1'000'000'000}) {
      greeted = at;
      if (verifier) signer->advance_clock(verifier->clock());
      greet(link, seq++, signer ? &*signer : nullptr);
    }
    if (came.empty()) {
      (void)std::fflush(stdout);
      std::this_thread::sleep_for(std::chrono::milliseconds{2});
      continue;
    }
    while (!came.empty()) {
      came = came.subspan(receiver.push(came));
      mav::Frame frame;
      for (Event event = receiver.next(frame); event != Event::kNothing; event = receiver.next(frame)) {
        if (event == Event::kUnknownId) ++unknown[frame.msgid];
        if (event == Event::kFrame) print_frame(frame, std::nullopt, options.json);
      }
    }
  }
  summarise("monitor", receiver.counters(), unknown);
  const mavlink::Link::Counters& c = link.counters();
  fmt::print(stderr, "{}: {} bytes in, {} out, opened {} times, lost {} times, {} datagrams of others\n",
             options.url, c.bytes_in, c.bytes_out, c.opened, c.lost, c.foreign_datagrams);
  return input::StopOnSignal::requested() ? kInterrupted : kDone;
}

void add_monitor(CLI::App& mavlink_app, std::function<int()>& run) {
  const auto options = std::make_shared<MonitorOptions>();
  CLI::App* command = mavlink_app.add_subcommand(
      "monitor", "As decode, live from a link that is opened again whenever it is lost; counts at the end");
  command->footer(
      "URL: udpin://[HOST]:PORT (waits there), udpout://HOST:PORT, tcp://HOST:PORT, "
      "serial:///dev/NAME:BAUD\n\n"
      "Examples:\n"
      "  roborun mavlink monitor udpin://:14550\n"
      "  roborun mavlink monitor serial:///dev/ttyACM0:921600 --greet --json >messages.jsonl");
  command->add_option("url", options->url, "The link: see below")->required();
  command->add_flag("--json", options->json, "One JSON object per message");
  command->add_flag(
      "--greet", options->greet,
      "Send the heartbeat of a ground station (255/190) each second: nothing else is ever sent");
  command->add_option("--key", options->key,
                      "File with the signing key, 64 hexadecimal digits: as of decode");
  add_number(*command, "--seconds", options->seconds, 0.0, 1e9,
             "End after this many seconds; default: at Ctrl-C");
  command->callback([options, &run] { run = [options] { return monitor(*options); }; });
}

void add_decode(CLI::App& mavlink_app, std::function<int()>& run) {
  const auto options = std::make_shared<DecodeOptions>();
  CLI::App* command = mavlink_app.add_subcommand("decode",
                                                 "Recorded MAVLink in, one line per message out. What is "
                                                 "damaged, unknown or refused is counted on standard "
                                                 "error at the end; it does not change the exit code");
  command->footer(
      "A line of --json: msgid, name, version, seq, sysid, compid, signed, signature (link_id, timestamp, "
      "hash: if "
      "signed),\n"
      "fields, time_us (us since 1970: of a .tlog). Units, signs and frames are MAVLink's. Numbers that JSON "
      "has not "
      "are\n"
      "\"NaN\", \"Infinity\", \"-Infinity\". Without --key `signed` says that there is a signature, not that "
      "it is "
      "right.\n\n"
      "Examples:\n"
      "  roborun mavlink decode flight.tlog --json | grep STATUSTEXT\n"
      "  roborun mavlink decode telemetry.raw --json >messages.jsonl\n"
      "  roborun mavlink decode messages.raw --key signing.key --json");
  command->add_option("file", options->file, "A raw stream of bytes, or a .tlog; default: standard input");
  command->add_flag("--json", options->json, "One JSON object per message");
  command->add_flag("--tlog", options->tlog, "FILE is a .tlog, whatever it is called");
  command->add_option(
      "--key", options->key,
      "File with the signing key, 64 hexadecimal digits: only messages rightly signed with it, "
      "with rising time stamps, are printed");
  command->callback([options, &run] { run = [options] { return decode(*options); }; });
}

void add_encode(CLI::App& mavlink_app, std::function<int()>& run) {
  const auto options = std::make_shared<EncodeOptions>();
  const auto given = std::make_shared<std::string>();
  CLI::App* command = mavlink_app.add_subcommand(
      "encode",
      "JSON in, one object per line as `roborun mavlink decode --json` writes them; MAVLink frames out");
  command->footer(
      "Needed: name or msgid. Without them: version 2, seq rises from 0, sysid 1, compid 191 (onboard "
      "computer), not "
      "signed,\n"
      "fields zero. A signed message takes link_id and timestamp from its signature, and the hash too unless "
      "--key "
      "makes it.\n\n"
      "Examples:\n"
      "  echo '{\"name\":\"HEARTBEAT\",\"fields\":{\"type\":18,\"autopilot\":8,\"system_status\":4,"
      "\"mavlink_version\":3}}' | roborun mavlink encode --json | xxd\n"
      "  roborun mavlink decode in.raw --json | roborun mavlink encode --json --out same.raw");
  command->add_option("--json", *given, "File to read; default: standard input")->expected(0, 1);
  command->add_option("file", options->file, "The same, without the option");
  command->add_option("--out", options->out, "File to write; default: standard output");
  command->add_option("--key", options->key, "File with the signing key, 64 hexadecimal digits");
  command->callback([options, given, &run] {
    run = [options, given] {
      if (!given->empty() && !options->file.empty())
        throw InputError(fmt::format("'{}' and '{}' are two files: must be one", *given, options->file));
      if (!given->empty()) options->file = *given;
      return encode(*options);
    };
  });
}

}  // namespace

void add_mavlink_command(CLI::App& app, std::function<int()>& run) {
  CLI::App* mavlink_app = app.add_subcommand("mavlink", "MAVLink tools: decode, encode, monitor");
  mavlink_app->require_subcommand(1);
  add_decode(*mavlink_app, run);
  add_encode(*mavlink_app, run);
  add_monitor(*mavlink_app, run);
}

}  // namespace roborun::app
