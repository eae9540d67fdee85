/// A bus that remembers what was sent and hands out what a test puts in.
#pragma once

#include <deque>
#include <vector>

#include "firmware_if/can.hpp"

namespace roborun::test {

class RecordingBus final : public firmware_if::CanBus {
 public:
  std::vector<firmware_if::CanFrame> sent;
  std::deque<firmware_if::CanFrame> incoming;
  Status answer{Status::kOk};
  Status hears{Status::kOk};  ///< Any other: what receive() answers.

  [[nodiscard]] Status send(std::span<const firmware_if::CanFrame> transfer) noexcept override {
    if (answer == Status::kOk) sent.insert(sent.end(), transfer.begin(), transfer.end());
    return answer;
  }
  [[nodiscard]] Status receive(firmware_if::CanFrame& frame) noexcept override {
    if (hears != Status::kOk) return hears;
    if (incoming.empty()) return Status::kNotReady;
    frame = incoming.front();
    incoming.pop_front();
    return Status::kOk;
  }
  [[nodiscard]] firmware_if::CanState state() const noexcept override {
    return firmware_if::CanState::kActive;
  }
  [[nodiscard]] const firmware_if::CanCounters& counters() const noexcept override { return counters_; }

 private:
  firmware_if::CanCounters counters_{};
};

}  // namespace roborun::test
