/// The way to the vehicle and back over sensor ports: a CAN bus, and lines.
#pragma once

#include <array>
#include <string>

#include "firmware_if/can.hpp"
#include "firmware_if/gpio.hpp"
#include "platform/sensor_port/port_devices.hpp"
#include "platform/sensor_port/port_writer.hpp"

namespace roborun::sensor_port {

/// A bus without a wire: what this node sends is written to one port, what it hears is read from another one. Nothing is ever
/// refused for lack of room: who reads too slowly loses frames (lost_on_receive).
class PortCan final : public firmware_if::CanBus, public PortDevice {
 public:
  static constexpr std::uint32_t kSlots = 1024;

  /// To be read. Empty, or what is wrong with it.
  [[nodiscard]] std::string listen(const std::string& path, const PortClock& clock);
  /// To be written; made if it is not there.
  [[nodiscard]] std::string speak(const std::string& path, const PortClock& clock);

  [[nodiscard]] Status send(std::span<const firmware_if::CanFrame> transfer) noexcept override;
  [[nodiscard]] Status receive(firmware_if::CanFrame& frame) noexcept override;
  /// Detached until both ports are open, and once that which is read was cut short.
  [[nodiscard]] firmware_if::CanState state() const noexcept override;
  [[nodiscard]] const firmware_if::CanCounters& counters() const noexcept override { return counters_; }

 private:
  PortWriter writer_;
  Nanos epoch_{};
  std::uint32_t sent_{0};
  bool listens_{false};
  firmware_if::CanCounters counters_{};
};

/// Lines whose levels another process writes.
class PortLines final : public PortDevice {
 public:
  /// So long without a word, every line is gone.
  static constexpr Nanos kGoneAfter{250'000'000};

  [[nodiscard]] std::string open(const std::string& path, const PortClock& clock);
  /// Takes the newest levels: once a minor frame.
  void update(MonotonicTime now) noexcept;
  /// `line`: enum roborun_port_line. Only its level is known, no edges.
  [[nodiscard]] firmware_if::GpioInput& kill_open() noexcept { return open_; }
  [[nodiscard]] firmware_if::GpioInput& kill_closed() noexcept { return closed_; }
  [[nodiscard]] firmware_if::GpioInput& arm() noexcept { return arm_; }
  [[nodiscard]] bool hears_operator() const noexcept;

 private:
  class Line final : public firmware_if::GpioInput {
   public:
    Line(const PortLines& lines, std::uint32_t bit) noexcept : lines_(lines), bit_(bit) {}
    [[nodiscard]] Result<bool> active() noexcept override { return lines_.level(bit_); }
    [[nodiscard]] Status next_edge(firmware_if::GpioEdge&) noexcept override {
      return lines_.is_gone_ ? Status::kIo : Status::kNotReady;
    }

   private:
    const PortLines& lines_;
    std::uint32_t bit_;
  };
  [[nodiscard]] Result<bool> level(std::uint32_t bit) const noexcept;

  bool is_gone_{true};
  std::uint32_t wired_{0}, active_{0};
  Line open_{*this, ROBORUN_PORT_KILL_OPEN};
  Line closed_{*this, ROBORUN_PORT_KILL_CLOSED};
  Line arm_{*this, ROBORUN_PORT_ARM};
};

}  // namespace roborun::sensor_port
