#include "platform/sitl/bus/fake_can.hpp"

#include <algorithm>

namespace roborun::sitl {

using firmware_if::CanFrame;
using firmware_if::CanState;

Status FakeCanPort::send(std::span<const CanFrame> transfer) noexcept {
  if (transfer.empty() || transfer.size() > kMostFrames) return Status::kInvalidArgument;
  for (const CanFrame& frame : transfer) {
    if (frame.id > 0x1fffffff || frame.size > 8) return Status::kInvalidArgument;
  }
  if (state_ == CanState::kDetached) return Status::kIo;
  if (state_ == CanState::kBusOff || to_send_.room() < transfer.size()) {
    counters_.refused += transfer.size();
    return Status::kNotReady;
  }
  for (const CanFrame& frame : transfer) (void)to_send_.push(frame);
  counters_.sent += transfer.size();
  return Status::kOk;
}

Status FakeCanPort::receive(CanFrame& frame) noexcept {
  if (state_ == CanState::kDetached) return Status::kIo;
  if (received_.empty()) return Status::kNotReady;
  frame = received_.front();
  received_.pop();
  ++counters_.received;
  return Status::kOk;
}

void FakeCanPort::go_bus_off() noexcept {
  state_ = CanState::kBusOff;
  ++counters_.bus_off;
  counters_.flushed += to_send_.size();
  to_send_.clear();
}

void FakeCanPort::recover() noexcept {
  if (state_ == CanState::kBusOff) state_ = CanState::kActive;
}

void FakeCanPort::detach() noexcept {
  state_ = CanState::kDetached;
  ++counters_.detached;
  counters_.flushed += to_send_.size();
  to_send_.clear();
  received_.clear();
}

void FakeCanPort::attach() noexcept {
  if (state_ == CanState::kDetached) state_ = CanState::kActive;
}

void FakeCanPort::put(const CanFrame& frame) noexcept {
  if (!received_.push(frame)) ++counters_.lost_on_receive;
}

void FakeCanPort::deliver(const CanFrame& frame, const CanFaults& faults, core::CounterRng& rng) noexcept {
  const bool lost = rng.uniform() < faults.loss_ratio;
  const bool twice = rng.uniform() < faults.duplicate_ratio;
  const bool late = rng.uniform() < faults.reorder_ratio;
  CanFrame copy = frame;
  if (rng.uniform() < faults.corrupt_ratio && copy.size > 0) {
    const auto bit = static_cast<unsigned>(rng.uniform() * 8.0 * copy.size);
    std::uint8_t& byte = copy.data[bit / 8U];
    byte = static_cast<std::uint8_t>(byte ^ (1U << (bit % 8U)));
  }
  if (lost) return;
  if (late && held_back_.push(copy)) return;
  put(copy);
  if (twice) put(copy);
  if (!held_back_.empty()) {
    put(held_back_.front());
    held_back_.pop();
  }
}

FakeCanPort& FakeCan::port(std::size_t index) noexcept {
  ports_[index].connected_ = true;
  return ports_[index];
}

FakeCanPort* FakeCan::next_sender() noexcept {
  FakeCanPort* winner = nullptr;
  for (FakeCanPort& port : ports_) {
    if (port.to_send_.empty()) continue;
    if (winner == nullptr || port.to_send_.front().id < winner->to_send_.front().id) winner = &port;
  }
  return winner;
}

void FakeCan::advance(MonotonicTime to) noexcept {
  const auto listening = [](const FakeCanPort& port) {
    return port.connected_ && (port.state_ == CanState::kActive || port.state_ == CanState::kPassive);
  };
  const auto listeners = std::ranges::count_if(ports_, listening);
  while (FakeCanPort* sender = next_sender()) {
    const CanFrame& frame = sender->to_send_.front();
    if (listeners < 2) {
      if (sender->state_ == CanState::kActive) ++sender->counters_.error_passive;
      sender->state_ = CanState::kPassive;
      ++sender->counters_.no_acknowledge;
      break;
    }
    sender->state_ = CanState::kActive;
    const Nanos length{(67 + 8 * std::int64_t{frame.size}) * 1'000'000'000 / bitrate_bps_};
    const MonotonicTime end = std::max(free_at_, frame.stamp) + length;
    if (end > to) return;
    CanFrame copy = frame;
    copy.stamp = end;
    sender->to_send_.pop();
    for (FakeCanPort& port : ports_) {
      if (&port != sender && listening(port)) port.deliver(copy, faults_, rng_);
    }
    free_at_ = end;
    busy_ += length;
    ++frames_;
  }
  free_at_ = std::max(free_at_, to);
}

}  // namespace roborun::sitl
