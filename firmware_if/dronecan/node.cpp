#include "firmware_if/dronecan/node.hpp"

#include <algorithm>

#include "firmware_if/assert.hpp"

namespace roborun::firmware_if::dronecan {
namespace {

constexpr Nanos kStatusPeriod{1'000'000'000};
constexpr Nanos kArmingPeriod{500'000'000};
constexpr std::uint8_t kFullyArmed = 255;
constexpr std::size_t kIdBytesAStage = 6;

// Only what we use reaches a parser: dangerous services (restart, parameters, firmware) are not compiled in.
constexpr std::array<DataType, 7> kSubscribed{
    kType<EscStatus>,     kType<BatteryInfo>, kType<HardpointStatus>,   kType<NodeStatus>,
    kType<EscRawCommand>, kType<Allocation>,  kType<GetNodeInfoRequest>};

}  // namespace

AllocationClient::AllocationClient(const std::array<std::uint8_t, 16>& unique_id,
                                   std::uint8_t preferred) noexcept
    : unique_id_(unique_id), preferred_(preferred), random_state_(crc16(unique_id)) {}

Nanos AllocationClient::random(Nanos from, Nanos to) noexcept {
  random_state_ = random_state_ * 6364136223846793005ULL + 1442695040888963407ULL;
  const auto thousandth = static_cast<std::int64_t>((random_state_ >> 33U) % 1000U);
  return from + (to - from) * thousandth / 1000;
}

bool AllocationClient::poll(MonotonicTime now, Allocation& request) noexcept {
  constexpr Nanos kPeriodShortest{600'000'000};
  constexpr Nanos kPeriodLongest{1'000'000'000};
  if (!scheduled_) {
    scheduled_ = true;
    next_ = now + random(kPeriodShortest, kPeriodLongest);
  }
  if (now < next_) return false;
  request = {};
  request.node_id = preferred_;
  request.first_part_of_unique_id = confirmed_bytes_ == 0;
  for (std::size_t i = confirmed_bytes_; i < std::min(confirmed_bytes_ + kIdBytesAStage, unique_id_.size());
       ++i)
    (void)request.unique_id.push_back(unique_id_[i]);
  // Without an answer it begins again with the first stage.
  confirmed_bytes_ = 0;
  next_ = now + random(kPeriodShortest, kPeriodLongest);
  return true;
}

std::uint8_t AllocationClient::take(const Allocation& answer, MonotonicTime now) noexcept {
  // The specification allows 0 .. 400 ms; the transmit gate takes one a 100 ms.
  constexpr Nanos kFollowUpShortest{100'000'000};
  constexpr Nanos kFollowUpLongest{400'000'000};
  // Whoever asks, all others wait: a period from now.
  scheduled_ = true;
  next_ = now + random(Nanos{600'000'000}, Nanos{1'000'000'000});
  confirmed_bytes_ = 0;
  const std::size_t known = answer.unique_id.count;
  if (known == 0 || !std::equal(unique_id_.begin(), unique_id_.begin() + static_cast<std::ptrdiff_t>(known),
                                answer.unique_id.items.begin()))
    return 0;
  if (known == unique_id_.size()) return answer.node_id;
  confirmed_bytes_ = static_cast<std::uint8_t>(known);
  next_ = now + random(kFollowUpShortest, kFollowUpLongest);
  return 0;
}

Node::Node(const Config& config, TransmitGate& gate, CanBus& bus,
           std::span<Reassembler::Session> sessions) noexcept
    : config_(config),
      gate_(gate),
      bus_(bus),
      reassembler_(kSubscribed, sessions, config.node_id),
      allocation_(config.unique_id, 0) {
  ROBORUN_ASSERT(config.validate() == Status::kOk);
  gate_.set_node_id(config.node_id);
}

Status Node::step(MonotonicTime now, const Input& in) noexcept {
  if (!started_) {
    started_ = true;
    start_ = next_command_ = next_status_ = next_arming_ = now;
  }
  const Status heard = hear(now);
  watch_neighbours(now);
  if (gate_.node_id() == 0) {
    allocate(now);
    return heard;
  }
  if (now >= next_command_) command(now, in);
  if (now >= next_arming_) {
    const bool live = in.armed && gate_.live(now);
    (void)gate_.send(ArmingStatus{.status = live ? kFullyArmed : std::uint8_t{0}}, now);
    next_arming_ = now + kArmingPeriod;
  }
  if (in.cycle_ok && now >= next_status_) {
    own_status_.uptime_sec = static_cast<std::uint32_t>((now - start_) / Nanos{1'000'000'000});
    own_status_.health = in.health;
    (void)gate_.send(own_status_, now);
    next_status_ = now + kStatusPeriod;
  }
  return heard;
}

Status Node::hear(MonotonicTime now) noexcept {
  CanFrame frame;
  Transfer transfer;
  for (std::uint16_t i = 0; i < config_.most_frames_a_step; ++i) {
    const Status status = bus_.receive(frame);
    if (status == Status::kNotReady) return Status::kOk;
    if (status != Status::kOk) {
      ++counters_.bus_errors;
      return status;
    }
    ++counters_.frames;
    const std::uint8_t source = from_can_id(frame.id).source_node_id;
    if (source != 0 && source == gate_.node_id()) {
      ++counters_.foreign_node_id;
      continue;
    }
    if (reassembler_.receive(frame, transfer) == FrameVerdict::kDelivered) take(transfer, now);
  }
  ++counters_.step_full;
  return Status::kOk;
}

template <typename T>
void Node::keep(const Transfer& transfer, Heard<T>& heard) noexcept {
  T message;
  if (decode(transfer.payload, message) != Status::kOk) {
    ++counters_.not_decoded;
    return;
  }
  heard = {message, transfer.stamp, transfer.header.source_node_id, heard.count + 1};
}

void Node::take(const Transfer& transfer, MonotonicTime now) noexcept {
  ++counters_.transfers;
  if (transfer.header.kind == TransferKind::kRequest) {
    answer_node_info(transfer, now);
    return;
  }
  switch (transfer.header.data_type_id) {
    case kType<EscStatus>.id: {
      Heard<EscStatus> heard;
      keep(transfer, heard);
      if (heard.count != 0 && heard.message.esc_index < inbox_.esc.size()) {
        Heard<EscStatus>& esc = inbox_.esc[heard.message.esc_index];
        heard.count = esc.count + 1;
        esc = heard;
      }
      return;
    }
    case kType<BatteryInfo>.id:
      return keep(transfer, inbox_.battery);
    case kType<HardpointStatus>.id:
      return keep(transfer, inbox_.hardpoint);
    case kType<NodeStatus>.id:
      if (transfer.header.source_node_id == 0) return;
      keep(transfer, nodes_[transfer.header.source_node_id].status);
      nodes_[transfer.header.source_node_id].offline = false;
      return;
    case kType<EscRawCommand>.id:
      ++counters_.foreign_command;
      return;
    case kType<Allocation>.id: {
      Allocation answer;
      // Anonymous: another node that asks, not an allocator.
      if (transfer.header.source_node_id == 0 || gate_.node_id() != 0) return;
      if (decode(transfer.payload, answer) != Status::kOk) {
        ++counters_.not_decoded;
        return;
      }
      const std::uint8_t granted = allocation_.take(answer, now);
      gate_.set_node_id(granted);
      reassembler_.set_local_node_id(granted);
      return;
    }
    default:
      return;
  }
}

void Node::answer_node_info(const Transfer& transfer, MonotonicTime now) noexcept {
  if (gate_.node_id() == 0 || !transfer.payload.empty()) return;
  GetNodeInfoResponse response;
  response.status = own_status_;
  response.software_version.major = 0;
  response.software_version.minor = 1;
  response.hardware_version.unique_id = config_.unique_id;
  for (const char c : config_.name) (void)response.name.push_back(static_cast<std::uint8_t>(c));
  std::array<std::uint8_t, kMaxPayload_bytes<GetNodeInfoResponse>> payload{};
  auto size = encode(response, payload);
  if (!size.ok()) return;
  (void)gate_.send({.kind = TransferKind::kResponse,
                    .data_type_id = kType<GetNodeInfoResponse>.id,
                    .destination_node_id = transfer.header.source_node_id,
                    .priority = 24,
                    .transfer_id = transfer.header.transfer_id},
                   std::span<const std::uint8_t>(payload).first(size.value()), now);
}

void Node::watch_neighbours(MonotonicTime now) noexcept {
  for (Neighbour& node : nodes_) {
    if (node.status.count == 0 || node.offline || now - node.status.stamp <= kOfflineAfter) continue;
    node.offline = true;
    ++counters_.went_offline;
  }
}

bool Node::online(std::uint8_t node_id, MonotonicTime now) const noexcept {
  const Heard<NodeStatus>& status = status_of(node_id);
  return status.count != 0 && now - status.stamp <= kOfflineAfter;
}

void Node::allocate(MonotonicTime now) noexcept {
  Allocation request;
  if (allocation_.poll(now, request)) (void)gate_.send(request, now);
}

void Node::command(MonotonicTime now, const Input& in) noexcept {
  EscRawCommand raw;
  const bool usable = in.armed && in.thrust_ratio.size() == config_.esc_count;
  for (std::size_t i = 0; i < config_.esc_count; ++i) {
    const double ratio = usable ? in.thrust_ratio[i] : 0.0;
    // The comparison is written so that NaN gives zero.
    const double clamped = ratio > 0.0 ? std::min(ratio, 1.0) : 0.0;
    const double rounded_up = clamped * kThrottleFull + 0.5;
    (void)raw.cmd.push_back(static_cast<std::int16_t>(rounded_up));
  }
  ++(gate_.send(raw, now) == Status::kOk ? counters_.commands : counters_.commands_refused);
  // The phase is kept; what was missed is not caught up.
  next_command_ += config_.command_period;
  if (next_command_ <= now) next_command_ = now + config_.command_period;
}

}  // namespace roborun::firmware_if::dronecan
