#include "platform/can/motor_bus.hpp"

#include "platform/input/input_error.hpp"

namespace roborun::can {
namespace {

void open(can::SocketCan& socket, const std::string& interface, Nanos epoch) {
  if (const std::string why = socket.open(interface, epoch); !why.empty()) throw InputError("--can: " + why);
}

}  // namespace

KernelMotorBus::KernelMotorBus(const std::string& vehicle, const std::string& escs, Nanos epoch,
                               Nanos late_after)
    : meter_(late_after), node_(vehicle_, meter_), first_esc_(esc_[0], meter_) {
  open(vehicle_, vehicle, epoch);
  for (can::SocketCan& socket : esc_) open(socket, escs, epoch);
}

firmware_if::CanBus& KernelMotorBus::esc(std::size_t index) noexcept {
  if (index == 0) return first_esc_;
  return esc_[index];
}

}  // namespace roborun::can
