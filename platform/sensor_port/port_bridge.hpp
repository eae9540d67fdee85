/// The ports of a vehicle on two machines: of the one where they are written, and of the one where they are read.
#pragma once

#include <cstdint>
#include <string>

#include "firmware_if/mavlink/clock_match.hpp"
#include "platform/sensor_port/port_receiver.hpp"
#include "platform/sensor_port/port_sender.hpp"

namespace roborun::sensor_port {

/// Which end: the vehicle's shares its ports, the runtime's fetches them and gives back what the runtime says on the bus.
enum class BridgeEnd : std::uint8_t { kShares, kFetches };

/// One end; who carries the datagrams to the other one is the caller's affair: they may be lost, doubled, late, and in any order. The end that fetches keeps
/// the time of both: stamps are on the clock of the machine on which they are read, wrong by half of the shortest round trip of late (10 ms at
/// most: nothing is written before one was that short). Who is silent for kSilent is not there. One thread.
class PortBridge {
 public:
  static constexpr Nanos kHelloPeriod{100'000'000};
  static constexpr Nanos kSilent{1'000'000'000};

  /// `name` as of port_path(); `session`: another number with each start.
  PortBridge(const std::string& name, BridgeEnd end, std::uint32_t session);
  /// A datagram came. Throws InputError as PortReceiver::announced().
  void take(MonotonicTime now, std::span<const std::uint8_t> datagram, const SendDatagram& send);
  /// Every 0.25 ms or so.
  void step(MonotonicTime now, const SendDatagram& send);

  /// The other end is there.
  [[nodiscard]] bool is_heard(MonotonicTime now) const noexcept {
    return heard_ != MonotonicTime::min() && now - heard_ < kSilent;
  }
  /// And the time over there is known; always true where the ports are shared.
  [[nodiscard]] bool is_matched() const noexcept { return end_ == BridgeEnd::kShares || clock_.matched(); }
  /// Precondition: is_matched(), and this end fetches.
  [[nodiscard]] Nanos clock_error() const noexcept { return clock_.uncertainty(); }
  /// Answers to questions about the time that took too long.
  [[nodiscard]] std::uint64_t slow_answers() const noexcept { return clock_.counters().slow; }
  [[nodiscard]] const PortSender& sender() const noexcept { return sender_; }
  [[nodiscard]] const PortReceiver& receiver() const noexcept { return receiver_; }
  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_ + receiver_.counters().refused; }

 private:
  void hear(MonotonicTime now, const BridgeHeader& header, std::span<const std::uint8_t> message,
            const SendDatagram& send);
  void hear_time(MonotonicTime now, std::span<const std::uint8_t> message);
  void follow_clock() noexcept;

  BridgeEnd end_;
  std::uint32_t session_, other_{0};
  PortSender sender_;
  PortReceiver receiver_;
  firmware_if::mavlink::ClockMatch clock_;
  Nanos shift_{0};  ///< From the other machine's clock to this one's.
  std::uint64_t moved_{0};
  bool is_set_{false};
  MonotonicTime heard_{MonotonicTime::min()}, told_{MonotonicTime::min()};
  std::uint64_t refused_{0};
};

}  // namespace roborun::sensor_port
