/// Digital lines in virtual time, with the 16-event buffer of the Linux kernel.
#pragma once

#include "firmware_if/gpio.hpp"
#include "platform/sitl/bus/ring.hpp"

namespace roborun::sitl {

class FakeGpioInput final : public firmware_if::GpioInput {
 public:
  [[nodiscard]] Result<bool> active() noexcept override {
    if (gone_) return Status::kIo;
    return active_;
  }
  [[nodiscard]] Status next_edge(firmware_if::GpioEdge& edge) noexcept override {
    if (gone_) return Status::kIo;
    if (edges_.empty()) return Status::kNotReady;
    edge = edges_.front();
    edges_.pop();
    return Status::kOk;
  }
  /// The world's side of the wire.
  void drive(bool active, MonotonicTime now) noexcept {
    if (active == active_) return;
    active_ = active;
    (void)edges_.push({now, active});  // Lost when full, as in the kernel.
  }
  void remove() noexcept { gone_ = true; }

 private:
  bool active_{false};
  bool gone_{false};
  Ring<firmware_if::GpioEdge, 16> edges_;
};

class FakeGpioOutput final : public firmware_if::GpioOutput {
 public:
  [[nodiscard]] Status set(bool active) noexcept override {
    if (gone_) return Status::kIo;
    active_ = active;
    return Status::kOk;
  }
  [[nodiscard]] bool active() const noexcept { return active_; }
  void remove() noexcept {
    gone_ = true;
    active_ = false;
  }

 private:
  bool active_{false};
  bool gone_{false};
};

}  // namespace roborun::sitl
