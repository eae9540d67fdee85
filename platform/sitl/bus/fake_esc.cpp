#include "platform/sitl/bus/fake_esc.hpp"

namespace roborun::sitl {

namespace dc = firmware_if::dronecan;

template <typename T>
void FakeEsc::say(const T& message, std::uint8_t priority, std::uint8_t& transfer_id,
                  MonotonicTime now) noexcept {
  std::array<std::uint8_t, dc::kMaxPayload_bytes<T>> payload{};
  std::array<firmware_if::CanFrame, 8> frames;
  auto size = dc::encode(message, payload);
  auto count = dc::split({.data_type_id = dc::kType<T>.id,
                          .source_node_id = config_.node_id,
                          .priority = priority,
                          .transfer_id = transfer_id},
                         dc::kType<T>.signature, std::span<const std::uint8_t>(payload).first(size.value()),
                         now, frames);
  transfer_id = static_cast<std::uint8_t>((transfer_id + 1U) % 32U);
  (void)bus_.send(std::span<const firmware_if::CanFrame>(frames).first(count.value()));
}

double FakeEsc::step(MonotonicTime now) noexcept {
  constexpr double kFull = 8191.0;
  firmware_if::CanFrame frame;
  dc::Transfer transfer;
  while (bus_.receive(frame) == Status::kOk) {
    if (reassembler_.receive(frame, transfer) != dc::FrameVerdict::kDelivered ||
        transfer.header.kind != dc::TransferKind::kMessage ||
        transfer.header.data_type_id != dc::kType<dc::EscRawCommand>.id)
      continue;
    dc::EscRawCommand command;
    if (dc::decode(transfer.payload, command) != Status::kOk || config_.index >= command.cmd.count) continue;
    const std::int16_t value = command.cmd.items[config_.index];
    ready_ = ready_ || value == 0;
    throttle_ = value > 0 && ready_ ? value : std::int16_t{0};
    heard_ = frame.stamp;
    if (throttle_ != 0) last_thrust_ = frame.stamp;
    ++commands_;
  }
  if (now - heard_ > config_.command_timeout) {
    throttle_ = 0;
    ready_ = false;
  }
  const double ratio = throttle_ / kFull;
  if (now >= next_status_ && !silent_) {
    dc::EscStatus status;
    status.esc_index = config_.index;
    status.voltage = 44.4F;
    status.temperature = 310.0F;
    status.power_rating_pct = static_cast<std::uint8_t>(100.0 * ratio);
    say(status, 20, status_transfer_id_, now);
    next_status_ = now + Nanos{100'000'000};
  }
  if (now >= next_node_status_ && !silent_) {
    say(dc::NodeStatus{.uptime_sec =
                           static_cast<std::uint32_t>(now.time_since_epoch() / Nanos{1'000'000'000})},
        24, node_status_transfer_id_, now);
    next_node_status_ = now + Nanos{1'000'000'000};
  }
  return ratio;
}

}  // namespace roborun::sitl
