/// What the simulated nodes of a bus are made of: one message that is said, one that is listened to.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "firmware_if/can.hpp"
#include "firmware_if/dronecan/transfer.hpp"

namespace roborun::sitl {

/// Says one type, with its own sequence of transfer ids. What the bus refuses is lost. Neither allocates.
template <typename T>
class FakeVoice {
 public:
  /// `bus` must outlive this.
  FakeVoice(firmware_if::CanBus& bus, std::uint8_t node_id, std::uint8_t priority, Nanos period) noexcept
      : bus_(bus), node_id_(node_id), priority_(priority), period_(period) {}

  /// True once a period, at first at once: it is time to say something.
  [[nodiscard]] bool due(MonotonicTime now) noexcept {
    if (now < next_) return false;
    next_ = now + period_;
    return true;
  }
  void say(const T& message, MonotonicTime now) noexcept {
    namespace dc = firmware_if::dronecan;
    std::array<std::uint8_t, dc::kMaxPayload_bytes<T>> payload{};
    std::array<firmware_if::CanFrame, 16> frames;
    auto size = dc::encode(message, payload);
    auto count = dc::split({.data_type_id = dc::kType<T>.id,
                            .source_node_id = node_id_,
                            .priority = priority_,
                            .transfer_id = transfer_id_},
                           dc::kType<T>.signature, std::span<const std::uint8_t>(payload).first(size.value()),
                           now, frames);
    transfer_id_ = static_cast<std::uint8_t>((transfer_id_ + 1U) % 32U);
    (void)bus_.send(std::span<const firmware_if::CanFrame>(frames).first(count.value()));
  }

 private:
  firmware_if::CanBus& bus_;
  std::uint8_t node_id_;
  std::uint8_t priority_;
  Nanos period_;
  MonotonicTime next_{};
  std::uint8_t transfer_id_{0};
};

/// The heart-beat of every node: 1 Hz.
class FakeHeartbeat {
 public:
  FakeHeartbeat(firmware_if::CanBus& bus, std::uint8_t node_id) noexcept
      : voice_(bus, node_id, 24, Nanos{1'000'000'000}) {}
  void step(MonotonicTime now) noexcept {
    const auto uptime_s = static_cast<std::uint32_t>(now.time_since_epoch() / Nanos{1'000'000'000});
    if (voice_.due(now)) voice_.say({.uptime_sec = uptime_s}, now);
  }

 private:
  FakeVoice<firmware_if::dronecan::NodeStatus> voice_;
};

/// Listens to one type, from up to four senders. Does not allocate.
template <typename T>
class FakeEar {
 public:
  /// `bus` must outlive this.
  explicit FakeEar(firmware_if::CanBus& bus) noexcept : bus_(bus), reassembler_(kTypes, sessions_, 0) {}
  FakeEar(const FakeEar&) = delete;  // the reassembler looks into our own sessions
  FakeEar& operator=(const FakeEar&) = delete;

  /// Reads on to the next message: true, with the stamp of its frame. False: nothing more has come.
  [[nodiscard]] bool hear(T& message, MonotonicTime& stamp) noexcept {
    namespace dc = firmware_if::dronecan;
    firmware_if::CanFrame frame;
    dc::Transfer transfer;
    while (bus_.receive(frame) == Status::kOk) {
      if (reassembler_.receive(frame, transfer) != dc::FrameVerdict::kDelivered ||
          dc::decode(transfer.payload, message) != Status::kOk)
        continue;
      stamp = frame.stamp;
      return true;
    }
    return false;
  }

 private:
  static constexpr std::array kTypes{firmware_if::dronecan::kType<T>};
  firmware_if::CanBus& bus_;
  std::array<firmware_if::dronecan::Reassembler::Session, 4> sessions_{};
  firmware_if::dronecan::Reassembler reassembler_;
};

}  // namespace roborun::sitl
