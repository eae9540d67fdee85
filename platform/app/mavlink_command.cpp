#include "platform/app/mavlink_command.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <charconv>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "platform/app/exit_code.hpp"
#include "platform/app/input_lines.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/json_reader.hpp"
#include "platform/input/output_file.hpp"
#include "platform/input/text_file.hpp"
#include "platform/mavlink/frame_log.hpp"
#include "platform/mavlink/message_json.hpp"

namespace roborun::app {
namespace {

namespace mav = firmware_if::mavlink;
using Json = nlohmann::ordered_json;
using mav::Event;

/// 64 hexadecimal digits, in a file: a key on the command line is in the history of the shell. The complaint does
/// not repeat what was read.
std::optional<mav::SigningKey> read_key(const std::string& path) {
  if (path.empty()) return std::nullopt;
  constexpr const char* kWanted = "a file of 64 hexadecimal digits";
  std::string text = input::read_text(path, kWanted, 4096);
  text.erase(text.find_last_not_of(" \t\r\n") + 1);
  mav::SigningKey key{};
  bool good = text.size() == 2 * key.size();
  for (std::size_t i = 0; good && i < key.size(); ++i) {
    const char* at = text.data() + 2 * i;
    good = std::from_chars(at, at + 2, key.at(i), 16).ptr == at + 2;
  }
  if (!good) throw InputError(fmt::format("--key: {}: no key: must be {}", path, kWanted));
  return key;
}

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

void summarise(const mav::Receiver::Counters& counters, const std::map<std::uint32_t, std::size_t>& unknown) {
  const auto count = [&](Event event) { return counters.events.at(static_cast<std::size_t>(event)); };
  std::string ids;
  for (const auto& [id, times] : unknown)
    ids += fmt::format("{}{} x{}", ids.empty() ? ": " : ", ", id, times);
  fmt::print(stderr,
             "roborun mavlink decode: {} messages, {} of unknown ids{}, {} with a wrong checksum, {} with "
             "unknown flags, {} cut short, {} not signed, {} wrongly signed, {} signed but not new, {} "
             "signed by one "
             "sender too many, {} bytes outside of frames\n",
             count(Event::kFrame), count(Event::kUnknownId), ids, count(Event::kBadCrc),
             count(Event::kBadFlags), count(Event::kCut), count(Event::kUnsigned),
             count(Event::kBadSignature), count(Event::kReplayed), count(Event::kNoRoom),
             counters.garbage_bytes);
}

int decode(const DecodeOptions& options) {
  constexpr std::size_t kMostStreams = 1024;
  const auto key = read_key(options.key);
  std::vector<mav::Verifier::Stream> streams(kMostStreams);
  std::optional<mav::Verifier> verifier;
  // A recording may be of any age: its own time stamps are the clock.
  if (key) verifier.emplace(*key, streams, mav::SigningTime{0});
  std::map<std::uint32_t, std::size_t> unknown;
  const auto visit = [&](Event event, const mav::Frame& frame, std::optional<std::uint64_t> time_us) {
    if (event == Event::kUnknownId) ++unknown[frame.msgid];
    if (event == Event::kFrame) print_frame(frame, time_us, options.json);
  };
  input::InputFile file = open_input(options.file, "recorded MAVLink: a raw stream or a .tlog");
  mav::Verifier* const judge = verifier ? &*verifier : nullptr;
  const bool tlog = options.tlog || options.file.ends_with(".tlog");
  summarise(tlog ? mavlink::read_tlog(file, judge, visit) : mavlink::read_stream(file, judge, visit),
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
  const auto key = read_key(options.key);
  std::optional<input::OutputFile> out;
  if (!options.out.empty()) out.emplace(options.out);
  std::uint8_t index = 0;
  for_each_line(options.file, "a file of JSON objects, one a line",
                [&](const std::string& text, std::size_t number) {
                  if (text.find_first_not_of(" \t\r") == std::string::npos) return;
                  std::vector<std::uint8_t> frame;
                  try {
                    frame = mavlink::from_json(input::parse_json(text), index++, key ? &*key : nullptr);
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
  CLI::App* mavlink_app = app.add_subcommand("mavlink", "MAVLink tools: decode, encode");
  mavlink_app->require_subcommand(1);
  add_decode(*mavlink_app, run);
  add_encode(*mavlink_app, run);
}

}  // namespace roborun::app
