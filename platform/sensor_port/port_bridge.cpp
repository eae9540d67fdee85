#include "platform/sensor_port/port_bridge.hpp"

#include <algorithm>

namespace roborun::sensor_port {
namespace {

constexpr Nanos kMostSlew{1'000'000};  // with each answer: stamps of an IMU do not go back by that

/// What the runtime says.
bool is_of_runtime(std::string_view suffix) noexcept { return suffix == "bus-out"; }
/// All that it reads; where the vehicle really is is no affair of it.
bool is_of_vehicle(std::string_view suffix) noexcept { return suffix != "bus-out" && suffix != "truth"; }

}  // namespace

PortBridge::PortBridge(const std::string& name, BridgeEnd end, std::uint32_t session)
    : end_(end),
      session_(session),
      sender_(name, end == BridgeEnd::kShares ? is_of_vehicle : is_of_runtime, session),
      receiver_(name, end == BridgeEnd::kShares ? is_of_runtime : is_of_vehicle) {}

void PortBridge::follow_clock() noexcept {
  if (!clock_.matched()) return;
  const Nanos now_shift{-clock_.theirs_ns(MonotonicTime{})};
  // A clock that was set is followed at once, a better guess slowly.
  if (!is_set_ || clock_.counters().moved != moved_)
    shift_ = now_shift;
  else
    shift_ += std::clamp(now_shift - shift_, -kMostSlew, kMostSlew);
  is_set_ = true;
  moved_ = clock_.counters().moved;
}

void PortBridge::hear_time(MonotonicTime now, std::span<const std::uint8_t> message) {
  BridgeTime time;
  if (end_ == BridgeEnd::kFetches && sensor_port::take(message, time)) {
    (void)clock_.answer(now, time.mine_ns, time.asked_ns);
    follow_clock();
  } else {
    ++refused_;
  }
}

void PortBridge::hear(MonotonicTime now, const BridgeHeader& header, std::span<const std::uint8_t> message,
                      const SendDatagram& send) {
  BridgeHello hello;
  if (!sensor_port::take(message, hello)) {
    ++refused_;
    return;
  }
  heard_ = now;
  if (header.session != other_) {
    other_ = header.session;
    receiver_.forget();
    clock_.forget();
    is_set_ = false;
  }
  if (is_matched()) receiver_.announced(message, header.count);
  if (hello.asked_ns == 0) return;
  Datagram time(BridgeMessage::kTime, session_);
  time.put(BridgeTime{hello.asked_ns, now.time_since_epoch().count()});
  time.send(0, send);
}

void PortBridge::take(MonotonicTime now, std::span<const std::uint8_t> datagram, const SendDatagram& send) {
  BridgeHeader header;
  if (!sensor_port::take(datagram, header) || header.magic != kBridgeMagic ||
      header.version != kBridgeVersion) {
    ++refused_;
    return;
  }
  if (header.message == BridgeMessage::kHello) return hear(now, header, datagram, send);
  // What comes from one that did not say who it is waits for its hello.
  if (header.session != other_) return;
  BridgeAgain again;
  switch (header.message) {
    case BridgeMessage::kTime:
      return hear_time(now, datagram);
    case BridgeMessage::kSamples:
      if (is_matched()) receiver_.samples(datagram, header.count, shift_);
      return;
    case BridgeMessage::kPiece:
      if (is_matched()) receiver_.piece(now, datagram, shift_);
      return;
    case BridgeMessage::kAgain:
      if (sensor_port::take(datagram, again)) return sender_.again(again, datagram, send);
      [[fallthrough]];
    default:
      ++refused_;
  }
}

void PortBridge::step(MonotonicTime now, const SendDatagram& send) {
  const bool may_send = is_heard(now) && is_matched();
  if (told_ == MonotonicTime::min() || now - told_ >= kHelloPeriod) {
    told_ = now;
    sender_.look();
    // Who fetches speaks first.
    if (end_ == BridgeEnd::kFetches)
      sender_.announce(clock_.question(now), send);
    else if (may_send)
      sender_.announce(0, send);
  }
  if (!may_send) return;
  sender_.step(-shift_, send);
  receiver_.ask(now, session_, send);
}

}  // namespace roborun::sensor_port
