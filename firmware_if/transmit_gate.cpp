#include "firmware_if/transmit_gate.hpp"

#include <algorithm>

namespace roborun::firmware_if {
namespace {

constexpr std::uint16_t kRelease = 0;
/// A pause does not earn a jump: the rise is counted over at most this long.
constexpr Nanos kLongestRise{10'000'000};

}  // namespace

Status TransmitGate::arm(const KillSwitch& kill_switch) noexcept {
  if (!kill_switch.proven() || !kill_switch.released()) return Status::kNotReady;
  return kill_switch.killed() ? Status::kInvalidArgument : arm_unproven();
}

Status TransmitGate::arm_unproven() noexcept {
  if (killed_) return Status::kInvalidArgument;
  armed_ = true;
  return Status::kOk;
}

void TransmitGate::kill() noexcept {
  killed_ = true;
  armed_ = false;
}

Status TransmitGate::reset_kill(const KillSwitch& kill_switch) noexcept {
  if (kill_switch.killed() || !kill_switch.released()) return Status::kNotReady;
  killed_ = false;
  return Status::kOk;
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

const TransmitRule* TransmitGate::rule_for(const dronecan::TransferHeader& header,
                                           std::size_t payload_bytes) const noexcept {
  const auto rule = std::ranges::find_if(kTransmitRules, [&](const TransmitRule& r) {
    return r.type.kind == header.kind && r.type.id == header.data_type_id && r.priority == header.priority;
  });
  const bool response = header.kind == dronecan::TransferKind::kResponse;
  const bool anonymous = header.data_type_id == dronecan::kType<dronecan::Allocation>.id && !response;
  // An allocation request leaves only without a node id, everything else only with one.
  const bool allowed = rule != kTransmitRules.end() && anonymous == (node_id_ == 0) &&
                       response == (header.destination_node_id != 0) &&
                       payload_bytes <= rule->type.max_payload_bytes;
  return allowed ? &*rule : nullptr;
}

Status TransmitGate::make_safe(const TransmitRule& rule, MonotonicTime now, Outgoing& out) noexcept {
  if (rule.type.id == dronecan::kType<dronecan::EscRawCommand>.id) {
    const Status status = make_throttles_safe(out.payload, now, out.throttles);
    auto size = dronecan::encode(out.throttles, out.throttle_payload);
    out.payload = std::span<const std::uint8_t>(out.throttle_payload).first(size.ok() ? size.value() : 0);
    return status;
  }
  if (rule.type.id != dronecan::kType<dronecan::HardpointCommand>.id) return Status::kOk;
  dronecan::HardpointCommand command;
  const Status status = dronecan::decode(out.payload, command);
  if (status != Status::kOk) return status;
  const bool drops = command.command == kRelease && (!release_allowed_ || killed_);
  return drops ? Status::kInvalidArgument : Status::kOk;
}

Status TransmitGate::refuse(Status why) noexcept {
  ++counters_.refused;
  return why;
}

Status TransmitGate::send(const dronecan::TransferHeader& header, std::span<const std::uint8_t> payload,
                          MonotonicTime now) noexcept {
  // 1. On the list, and not too soon.
  const TransmitRule* rule = rule_for(header, payload.size());
  if (rule == nullptr) return refuse(Status::kInvalidArgument);
  RuleState& state = states_[static_cast<std::size_t>(rule - kTransmitRules.data())];
  if (state.used && now - state.last < rule->shortest_interval) {
    ++counters_.too_soon;
    return Status::kNotReady;
  }

  // 2. Of its form, and safe.
  Outgoing safe{payload, {}, {}};
  const Status form = make_safe(*rule, now, safe);
  if (form != Status::kOk) return refuse(form);

  // 3. Into frames.
  dronecan::TransferHeader out = header;
  out.source_node_id = node_id_;
  if (header.kind != dronecan::TransferKind::kResponse) out.transfer_id = state.transfer_id;
  auto count = dronecan::split(out, rule->type.signature, safe.payload, now, frames_);
  if (!count.ok()) return refuse(count.status());

  // 4. Onto the bus. The id is spent even if the bus refuses, so that no receiver takes the next one for a
  // repetition.
  state.transfer_id = static_cast<std::uint8_t>((state.transfer_id + 1U) % 32U);
  state.used = true;
  state.last = now;
  const Status status = bus_.send(std::span<const CanFrame>(frames_).first(count.value()));
  ++(status == Status::kOk ? counters_.sent : counters_.no_room);
  if (status == Status::kOk) std::ranges::copy(safe.throttles.cmd.view(), throttle_.begin());
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
