#include "platform/app/goto_command.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "firmware_if/mavlink/flight_messages.hpp"
#include "firmware_if/mavlink/goal_request.hpp"
#include "firmware_if/mavlink/receiver.hpp"
#include "platform/app/exit_code.hpp"
#include "platform/app/options.hpp"
#include "platform/app/world_arguments.hpp"
#include "platform/input/input_error.hpp"
#include "platform/live/ground.hpp"
#include "platform/mavlink/link.hpp"
#include "platform/mavlink/signed_end.hpp"

namespace roborun::app {
namespace {

namespace mav = firmware_if::mavlink;

struct GotoOptions {
  std::string goal, link, key;
  bool earth{false};
  int ground_id{live::kGroundStation}, vehicle_id{1};
  double wait_s{5.0};
};

std::int32_t scaled(double value, double scale) {
  return static_cast<std::int32_t>(std::llround(value * scale));
}

mav::CommandInt command_of(const GotoOptions& options) {
  const std::optional<Vector3> point = point_of("GOAL", options.goal);
  if (!point) throw InputError("GOAL: '' is not a point: must be X,Y,Z in metres");
  constexpr double kMost_m = 100e3;
  const Vector3& p = *point;
  mav::CommandInt m;
  m.target_system = static_cast<std::uint8_t>(options.vehicle_id);
  m.target_component = live::kCompanion;
  m.command = mav::kDoReposition;
  m.param1 = -1.0F;
  if (options.earth) {
    constexpr std::uint8_t kOverHomeInt = 6;
    if (std::fabs(p.x()) > 90.0 || std::fabs(p.y()) > 180.0 || std::fabs(p.z()) > kMost_m)
      throw InputError(fmt::format("GOAL: {}: must be LATITUDE,LONGITUDE,HEIGHT on the earth", options.goal));
    m.frame = kOverHomeInt;
    m.x = scaled(p.x(), 1e7);
    m.y = scaled(p.y(), 1e7);
    m.z = static_cast<float>(p.z());
    return m;
  }
  if (!(p.norm() < kMost_m)) throw InputError(fmt::format("GOAL: {}: must be within 100 km", options.goal));
  m.frame = 1;  // north, east, down
  m.x = scaled(p.y(), 1e4);
  m.y = scaled(p.x(), 1e4);
  m.z = static_cast<float>(-p.z());
  return m;
}

/// Asks until it is answered.
class Asker {
 public:
  explicit Asker(const GotoOptions& options)
      : options_(options), command_(command_of(options)), link_(mavlink::parse_link(options.link)) {
    if (const auto key = mavlink::read_key("--signing-key", options.key)) signed_.emplace(*key, kLinkId);
    receiver_.emplace(signed_ ? signed_->verifier() : nullptr);
  }
  int run() {
    const auto start = std::chrono::steady_clock::now();
    for (;;) {
      const auto passed = std::chrono::duration_cast<Nanos>(std::chrono::steady_clock::now() - start);
      if (seconds(passed) > options_.wait_s)
        throw InputError(fmt::format(
            "--link: {}: nobody answered within {:g} s: must be where roborun run --ground waits{}",
            options_.link, options_.wait_s, options_.key.empty() ? "" : ", with the same key"));
      step(MonotonicTime{passed});
      // An answer's line of text comes right behind it.
      if (result_ && MonotonicTime{passed} - answered_ > Nanos{100'000'000}) return end();
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }

 private:
  static constexpr std::uint8_t kLinkId = 3;

  template <typename T>
  void send(MonotonicTime now, const T& message) {
    constexpr std::uint8_t kMissionPlanner = 190;
    std::array<std::uint8_t, mav::kMostFrame_bytes> frame{};
    const auto length =
        mav::write_frame(T::kType, {seq_++, static_cast<std::uint8_t>(options_.ground_id), kMissionPlanner},
                         mav::pack(message), signed_ ? signed_->signer() : nullptr, frame);
    (void)link_.write(now, std::span<const std::uint8_t>(frame).first(length.value()));
  }
  void step(MonotonicTime now) {
    constexpr Nanos kAgain{500'000'000};
    if (signed_) signed_->tick(now);
    std::array<std::uint8_t, 4096> bytes{};
    std::span<const std::uint8_t> came(bytes.data(), link_.read(now, bytes));
    while (!came.empty()) {
      came = came.subspan(receiver_->push(came));
      mav::Frame frame;
      for (mav::Event event = receiver_->next(frame); event != mav::Event::kNothing;
           event = receiver_->next(frame))
        if (event == mav::Event::kFrame) hear(now, frame);
    }
    if (result_ || (asked_ && now - *asked_ < kAgain)) return;
    asked_ = now;
    send(now, mav::Heartbeat{6, 8, 0, 0, 4, 3});
    send(now, command_);
  }
  void hear(MonotonicTime now, const mav::Frame& frame) {
    if (frame.header.sysid != command_.target_system || frame.header.compid != live::kCompanion) return;
    if (frame.msgid == mav::kCommandAck.id && asked_ && !result_) {
      const auto ack = mav::unpack<mav::CommandAck>(frame.payload);
      if (ack.command != mav::kDoReposition) return;
      result_ = ack.result;
      answered_ = now;
    }
    if (frame.msgid == mav::kStatustext.id && result_) {
      const auto line = mav::unpack<mav::Statustext>(frame.payload);
      for (const char c : line.text)
        if (c != '\0') text_ += c;
    }
  }
  int end() {
    const bool good = *result_ == 0;
    if (text_.empty()) text_ = fmt::format("answer {}", *result_);
    fmt::print("{}: {}\n", good ? "accepted" : "refused", text_);
    return good ? kDone : kNotGood;
  }

  const GotoOptions& options_;
  mav::CommandInt command_;
  mavlink::Link link_;
  std::optional<mavlink::SignedEnd> signed_;
  std::optional<mav::Receiver> receiver_;
  std::uint8_t seq_{0};
  std::optional<MonotonicTime> asked_;
  std::optional<int> result_;
  MonotonicTime answered_{};
  std::string text_;
};

}  // namespace

void add_goto_command(CLI::App& app, std::function<int()>& run) {
  const auto options = std::make_shared<GotoOptions>();
  CLI::App* command =
      app.add_subcommand("goto", "Another goal for a flight of roborun run that is under way");
  command->footer(
      "It takes the place of the goal, or of what is left of a mission, without a stop on the way; there it "
      "lands.\n\n"
      "Example, with roborun run ... --ground udpin://127.0.0.1:14555 in another terminal:\n"
      "  roborun goto 400,20,5 --link udpout://127.0.0.1:14555\n"
      "  roborun goto --earth 47.39775,8.54608,4 --link udpout://127.0.0.1:14555\n\n"
      "Exit code: 0 it flies there, 1 it was refused, 2 bad input, or nobody answered.");
  command
      ->add_option("goal", options->goal,
                   "X,Y,Z in metres: east, north, up from where the flight's world begins")
      ->required();
  command->add_flag("--earth", options->earth,
                    "GOAL is LATITUDE,LONGITUDE,HEIGHT: degrees, and metres over the take-off");
  command
      ->add_option("--link", options->link, "Where roborun run waits (its --ground): udpout://HOST:PORT, ...")
      ->required();
  command->add_option("--signing-key", options->key, "File with 64 hexadecimal digits, as in roborun run");
  add_whole(*command, "--ground-id", options->ground_id, 1, 255,
            "Our MAVLink system: must be that of run --ground-id");
  add_whole(*command, "--vehicle-id", options->vehicle_id, 1, 255, "MAVLink system of the vehicle");
  add_number(*command, "--wait", options->wait_s, 0.1, 3600.0, "So long for an answer, seconds");
  command->callback([options, &run] { run = [options] { return Asker(*options).run(); }; });
}

}  // namespace roborun::app
