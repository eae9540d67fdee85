#include "firmware_if/transmit_gate.hpp"

#include <algorithm>

namespace roborun::firmware_if {
namespace {

constexpr std::uint16_t kRelease = 0;
/// A pause does not earn a jump: the rise is counted over at most this long.
constexpr Nanos kLongestRise{10'000'000};

}  // namespace

Status TransmitGate::arm() noexcept {
  if (killed_) return Status::kInvalidArgument;
  armed_ = true;
  return Status::kOk;
}

void TransmitGate::kill() noexcept {
  killed_ = true;
  armed_ = false;
}

void TransmitGate::beat(MonotonicTime now) noexcept {
  beaten_ = true;
  beat_ = now;
}

bool TransmitGate::live(MonotonicTime now) const noexcept {
  return armed_ && !killed_ && beaten_ && now >= beat_ && now - beat_ <= config_.beat_timeout;
}

std::uint8_t TransmitGate::priority_of(const dronecan::DataType& type) noexcept {
  for (const TransmitRule& rule : kTransmitRules) {
    if (rule.type.kind == type.kind && rule.type.id == type.id) return rule.priority;
  }
  return dronecan::kLowestPriority;
}

Status TransmitGate::send(const dronecan::TransferHeader& header, std::span<const std::uint8_t> payload,
                          MonotonicTime now) noexcept {
  using dronecan::TransferKind;
  const auto rule = std::ranges::find_if(kTransmitRules, [&](const TransmitRule& r) {
    return r.type.kind == header.kind && r.type.id == header.data_type_id && r.priority == header.priority;
  });
  const bool response = header.kind == TransferKind::kResponse;
  const bool anonymous = header.data_type_id == dronecan::kType<dronecan::Allocation>.id && !response;
  // An allocation request leaves only without a node id, everything else only with one.
  if (rule == kTransmitRules.end() || anonymous != (node_id_ == 0) ||
      response != (header.destination_node_id != 0) || payload.size() > rule->type.max_payload_bytes) {
    ++counters_.refused;
    return Status::kInvalidArgument;
  }
  RuleState& state = states_[static_cast<std::size_t>(rule - kTransmitRules.begin())];
  if (state.used && now - state.last < rule->shortest_interval) {
    ++counters_.too_soon;
    return Status::kNotReady;
  }

  dronecan::EscRawCommand safe;
  std::array<std::uint8_t, dronecan::kMaxPayload_bytes<dronecan::EscRawCommand>> safe_payload{};
  Status form = Status::kOk;
  if (rule->type.id == dronecan::kType<dronecan::EscRawCommand>.id) {
    form = make_throttles_safe(payload, now, safe);
    auto size = dronecan::encode(safe, safe_payload);
    payload = std::span<const std::uint8_t>(safe_payload).first(size.ok() ? size.value() : 0);
  } else if (rule->type.id == dronecan::kType<dronecan::HardpointCommand>.id) {
    dronecan::HardpointCommand command;
    form = dronecan::decode(payload, command);
    if (form == Status::kOk && command.command == kRelease && (!release_allowed_ || killed_))
      form = Status::kInvalidArgument;
  }
  if (form != Status::kOk) {
    ++counters_.refused;
    return form;
  }

  dronecan::TransferHeader out = header;
  out.source_node_id = node_id_;
  if (!response) out.transfer_id = state.transfer_id;
  auto count = dronecan::split(out, rule->type.signature, payload, now, frames_);
  if (!count.ok()) {
    ++counters_.refused;
    return count.status();
  }
  // The id is spent even if the bus refuses, so that no receiver takes the next one for a repetition.
  state.transfer_id = static_cast<std::uint8_t>((state.transfer_id + 1U) % 32U);
  state.used = true;
  state.last = now;
  const Status status = bus_.send(std::span<const CanFrame>(frames_).first(count.value()));
  ++(status == Status::kOk ? counters_.sent : counters_.no_room);
  if (status == Status::kOk) std::ranges::copy(safe.cmd.view(), throttle_.begin());
  return status;
}

Status TransmitGate::make_throttles_safe(std::span<const std::uint8_t> payload, MonotonicTime now,
                                         dronecan::EscRawCommand& safe) noexcept {
  dronecan::EscRawCommand wanted;
  if (dronecan::decode(payload, wanted) != Status::kOk || wanted.cmd.count != config_.esc_count)
    return Status::kInvalidArgument;
  const RuleState& state = states_[0];
  static_assert(kTransmitRules[0].type.id == dronecan::kType<dronecan::EscRawCommand>.id);
  const Nanos elapsed = state.used ? std::min(now - state.last, kLongestRise) : Nanos{0};
  const std::int64_t rise = elapsed.count() * config_.rise_per_s / 1'000'000'000;
  const bool is_live = live(now);
  for (std::size_t i = 0; i < wanted.cmd.count; ++i) {
    const std::int64_t value = wanted.cmd.items[i];
    if (!is_live) {
      counters_.zeroed += value != 0 ? 1U : 0U;
      (void)safe.cmd.push_back(0);
      continue;
    }
    const std::int64_t most = std::min<std::int64_t>(config_.throttle_max, throttle_[i] + rise);
    const std::int64_t limited = std::clamp<std::int64_t>(value, 0, most);
    counters_.limited += limited != value ? 1U : 0U;
    (void)safe.cmd.push_back(static_cast<std::int16_t>(limited));
  }
  return Status::kOk;
}

}  // namespace roborun::firmware_if
