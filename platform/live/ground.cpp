#include "platform/live/ground.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "firmware_if/mavlink/flight_messages.hpp"

namespace roborun::live {

namespace mav = firmware_if::mavlink;

Ground::Ground(const GroundConfig& config, const std::optional<mav::SecretKey>& key, FarEnd& far)
    : sysid_(config.sysid),
      far_(far),
      signed_(key ? std::make_unique<mavlink::SignedEnd>(*key, kLinkId) : nullptr),
      receiver_(signed_ ? signed_->verifier() : nullptr) {
  if (config.link) link_.emplace(*config.link);
}

template <typename T>
void Ground::send(const T& message) {
  if (!link_) return;
  std::array<std::uint8_t, mav::kMostFrame_bytes> frame{};
  const auto length = mav::write_frame(T::kType, {seq_++, far_.sysid(), kCompanion}, mav::pack(message),
                                       signed_ ? signed_->signer() : nullptr, frame);
  if (length.ok()) (void)link_->write(now_, std::span<const std::uint8_t>(frame).first(length.value()));
}

std::optional<mav::GoalRequest> Ground::hear() {
  constexpr int kMost = 64;  // datagrams
  std::optional<mav::GoalRequest> newest;
  mav::GoalRequest asked;
  while (far_.asked(asked)) {
    newest = asked;
    through_autopilot_ = true;
  }
  for (int i = 0; link_ && i < kMost; ++i) {
    std::span<const std::uint8_t> came(bytes_.data(), link_->read(now_, bytes_));
    if (came.empty()) break;
    while (!came.empty()) {
      came = came.subspan(receiver_.push(came));
      mav::Frame frame;
      for (mav::Event event = receiver_.next(frame); event != mav::Event::kNothing;
           event = receiver_.next(frame)) {
        if (event != mav::Event::kFrame || frame.header.sysid != sysid_) continue;
        const auto request = mav::goal_request(frame, far_.sysid(), kCompanion);
        if (!request) continue;
        newest = request;
        through_autopilot_ = false;
      }
    }
  }
  return newest;
}

const char* Ground::place(const mav::GoalRequest& request, Vector3& goal_W) const {
  using Kind = mav::GoalRequest::Kind;
  const auto& p = request.place;
  goal_W = {p[0], p[1], p[2]};
  if (request.kind == Kind::kWorld) return nullptr;
  if (!origin_) return "nobody knows where its world begins: --origin";
  const bool over_sea = request.kind == Kind::kOverSea;
  const double height_m = over_sea ? p[2] - origin_->height_m : stands_m_ + p[2];
  const auto local_m = sensor_port::LocalFrame(*origin_).to_local_m({p[0], p[1], origin_->height_m});
  goal_W = {local_m[0], local_m[1], height_m};
  return nullptr;
}

std::optional<Vector3> Ground::step(MonotonicTime now) {
  constexpr Nanos kBeat{1'000'000'000};
  constexpr double kSame_m = 0.01;
  now_ = now;
  if (signed_) signed_->tick(now);
  if (now - beat_at_ >= kBeat) {
    beat_at_ = now;
    send(mav::Heartbeat{18, 8, 0, 0, 4, 3});
  }
  const auto request = hear();
  if (!request) return std::nullopt;
  request_ = *request;
  const char* wrong =
      request->result == mav::CommandResult::kAccepted ? place(*request, goal_W_) : request->wrong;
  if (wrong != nullptr) {
    answer(wrong);
    return std::nullopt;
  }
  // A stream of the same set-point, or a command that is repeated because its answer was lost.
  if (flown_W_ && (goal_W_ - *flown_W_).norm() < kSame_m) {
    goal_W_ = *flown_W_;
    if (request_.is_command) answer(nullptr);
    return std::nullopt;
  }
  return goal_W_;
}

void Ground::answer(const char* refused) {
  const bool is_new = !flown_W_ || (goal_W_ - *flown_W_).norm() > 0.0;
  if (request_.is_command) {
    mav::CommandResult result = request_.result;
    if (refused != nullptr && result == mav::CommandResult::kAccepted) result = mav::CommandResult::kDenied;
    const mav::CommandAck ack{mav::kDoReposition, static_cast<std::uint8_t>(result), 0, 0, request_.sysid,
                              request_.compid};
    if (through_autopilot_)
      far_.tell(ack);
    else
      send(ack);
  }
  if (refused != nullptr) {
    constexpr Nanos kAgain{1'000'000'000};
    if (!request_.is_command && now_ - refused_at_ < kAgain) return;  // a stream of set-points
    refused_at_ = now_;
    ++refused_;
    return say(4, fmt::format("roborun: goal refused: {}", refused));
  }
  if (!is_new) return;
  flown_W_ = goal_W_;
  ++given_;
  say(6, fmt::format("roborun: goal {:.1f},{:.1f},{:.1f}", goal_W_.x(), goal_W_.y(), goal_W_.z()));
}

void Ground::say(std::uint8_t severity, std::string_view text) {
  mav::Statustext line;
  line.severity = severity;
  const bool in_pieces = text.size() > line.text.size();
  // Of a line in pieces the last one must end with a zero: a full one is followed by an empty one.
  if (in_pieces) line.id = ++text_id_ == 0 ? ++text_id_ : text_id_;
  for (;; ++line.chunk_seq) {
    const std::size_t count = std::min(text.size(), line.text.size());
    line.text = {};
    std::copy_n(text.begin(), count, line.text.begin());
    text.remove_prefix(count);
    far_.tell(line);
    send(line);
    if (text.empty() && (!in_pieces || count < line.text.size())) return;
  }
}

}  // namespace roborun::live
