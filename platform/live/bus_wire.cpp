#include "platform/live/bus_wire.hpp"

#include <fmt/format.h>

#include <array>

#include "platform/can/socket_can.hpp"
#include "platform/sensor_port/port_bus.hpp"

namespace roborun::live {
namespace {

class KernelWire final : public BusWire {
 public:
  KernelWire(const std::string& interface, Nanos epoch) : interface_(interface), epoch_(epoch) {}

  [[nodiscard]] std::string open() override {
    for (Socket& socket : sockets_) {
      if (!socket.is_open) {
        std::string wrong = socket.bus.open(interface_, epoch_);
        if (!wrong.empty()) return wrong;
        socket.is_open = true;
      } else if (socket.bus.state() == firmware_if::CanState::kDetached &&
                 socket.bus.reopen() != Status::kOk) {
        return fmt::format("{} is down or gone", interface_);
      }
    }
    return {};
  }
  [[nodiscard]] firmware_if::CanBus& node() noexcept override { return sockets_[0].bus; }
  [[nodiscard]] firmware_if::CanBus& ear() noexcept override { return sockets_[1].bus; }

 private:
  struct Socket {
    can::SocketCan bus;
    bool is_open{false};
  };
  std::string interface_;
  Nanos epoch_;
  std::array<Socket, 2> sockets_;
};

class PortWire final : public BusWire {
 public:
  PortWire(const sensor_port::VehiclePorts& ports, Nanos epoch) : ports_(ports), clock_{epoch} {}

  [[nodiscard]] std::string open() override {
    if (!speaks_) {
      const std::string wrong = ends_[0].bus.speak(ports_.bus_out(), clock_);
      if (!wrong.empty()) return fmt::format("{}: {}", ports_.bus_out(), wrong);
      speaks_ = true;
    }
    for (End& end : ends_) {
      if (end.is_open && !end.bus.reader().is_replaced()) continue;
      const std::string wrong = end.bus.listen(ports_.bus_in(), clock_);
      end.is_open = wrong.empty();
      if (!wrong.empty()) return fmt::format("{}: {}: start what writes it", ports_.bus_in(), wrong);
    }
    return {};
  }
  [[nodiscard]] firmware_if::CanBus& node() noexcept override { return ends_[0].bus; }
  [[nodiscard]] firmware_if::CanBus& ear() noexcept override { return ends_[1].bus; }

 private:
  struct End {
    sensor_port::PortCan bus;
    bool is_open{false};
  };
  sensor_port::VehiclePorts ports_;
  sensor_port::PortClock clock_;
  bool speaks_{false};
  std::array<End, 2> ends_;
};

}  // namespace

std::unique_ptr<BusWire> kernel_wire(const std::string& interface, Nanos epoch) {
  return std::make_unique<KernelWire>(interface, epoch);
}

std::unique_ptr<BusWire> port_wire(const sensor_port::VehiclePorts& ports, Nanos epoch) {
  return std::make_unique<PortWire>(ports, epoch);
}

}  // namespace roborun::live
