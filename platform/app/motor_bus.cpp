#include "platform/app/motor_bus.hpp"

#include "platform/sitl/world/input_error.hpp"

namespace roborun::app {
namespace {

void open(can::SocketCan& socket, const std::string& interface, const rt::MonotonicClock& clock) {
  if (const std::string why = socket.open(interface, clock.epoch()); !why.empty())
    throw sitl::InputError("--can: " + why);
}

}  // namespace

KernelMotorBus::KernelMotorBus(const std::string& vehicle, const std::string& escs,
                               const rt::MonotonicClock& clock, Nanos late_after)
    : meter_(late_after), node_(vehicle_, meter_), first_esc_(esc_[0], meter_) {
  open(vehicle_, vehicle, clock);
  for (can::SocketCan& socket : esc_) open(socket, escs, clock);
}

firmware_if::CanBus& KernelMotorBus::esc(std::size_t index) noexcept {
  if (index == 0) return first_esc_;
  return esc_[index];
}

}  // namespace roborun::app
