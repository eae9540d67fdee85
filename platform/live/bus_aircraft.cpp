#include "platform/live/bus_aircraft.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "platform/input/input_error.hpp"

namespace roborun::live {
namespace {

std::unique_ptr<gpio::GpiodInput> open_line(const std::optional<gpio::LineConfig>& config) {
  if (!config) return nullptr;
  auto line = std::make_unique<gpio::GpiodInput>();
  if (const std::string why = line->open(*config); !why.empty()) throw InputError("--arm-line: " + why);
  return line;
}

}  // namespace

BusAircraft::BusAircraft(std::unique_ptr<BusWire> wire, const sensor_port::VehiclePorts& ports,
                         const SensorRig& rig, Nanos minor_frame, Nanos epoch,
                         const std::optional<sensor_port::EarthPlace>& origin, const BusLines& lines,
                         bool needs_hook)
    : clock_{epoch},
      origin_(origin),
      wire_(std::move(wire)),
      pictures_(ports, rig, clock_),
      kill_lines_(lines.kill ? std::make_unique<gpio::KernelKillLines>(*lines.kill) : nullptr),
      arm_line_(open_line(lines.arm)),
      sensors_(wire_->ear(), rig, origin),
      actuators_(
          minor_frame, wire_->node(),
          kill_lines_ ? static_cast<firmware_if::GpioInput&>(kill_lines_->open()) : lines_.device.kill_open(),
          kill_lines_ ? static_cast<firmware_if::GpioInput&>(kill_lines_->closed())
                      : lines_.device.kill_closed(),
          flight::Arming::kProven),
      hook_and_light_(actuators_, needs_hook) {
  if (rig.odometry != OdometryModel::kNone)
    prepare(odometry_.emplace(), "odometry", ports.odometry(), std::chrono::milliseconds(500));
  prepare(lines_, "lines", ports.lines(), sensor_port::PortLines::kGoneAfter);
}

Need BusAircraft::look_at_bus(MonotonicTime now) {
  constexpr double kSilent_s = 0.5;
  Need need{"bus", wire_->open()};
  if (!need.lacks.empty()) return need;
  sensors_.hear(now);
  const std::uint64_t frames = wire_->ear().counters().received;
  if (frames != frames_) heard_ = now;
  frames_ = frames;
  if (wire_->node().state() == firmware_if::CanState::kBusOff)
    need.lacks = "its controller is bus-off: look at bit rate, wires and terminators";
  else if (heard_ == MonotonicTime::min() || seconds(now - heard_) > kSilent_s)
    need.lacks = "nothing is heard on it: are its nodes powered, do bit rate and wires fit?";
  return need;
}

Need BusAircraft::look_at_kill_switch() {
  Need need{"kill switch", {}};
  const firmware_if::KillSwitch& kill = actuators_.kill_switch();
  const bool was_pressed = kill.counters().pressed > 0;
  // What was pressed before the flight was pressed to show that it works.
  if (kill.proven() && kill.killed() && actuators_.forget_proof() == Status::kOk) return need;
  if (!kill.released())
    need.lacks = was_pressed && kill.proven() ? "is pressed: release it"
                                              : "does not stand on run: release it, and look at both wires";
  else if (!kill.proven())
    need.lacks = "was not seen to work: press it, and release it";
  else if (kill.killed())
    need.lacks = "does not let go: start again";
  return need;
}

Need BusAircraft::look_at_arming(bool others) {
  const Result<bool> on = arm_line_ ? arm_line_->active() : lines_.device.arm().active();
  Need need{"arming switch", {}};
  if (!on.ok()) {
    need.lacks = "its line is not there";
  } else if (!on.value()) {
    was_safe_ = was_safe_ || others;
    need.lacks = others ? "stands on safe: switch it on to fly" : "stands on safe";
  } else if (!was_safe_) {
    need.lacks = "was on before all else was ready: switch it off, and on again";
  }
  return need;
}

std::vector<Need> BusAircraft::look(MonotonicTime now) {
  std::vector<Need> needs;
  pictures_.look(now, needs);
  if (odometry_)
    needs.push_back(look_at(
        *odometry_, now, [&] { return odometry_->device.open(odometry_->path, clock_); },
        [&] {
          firmware_if::OdometrySample sample;
          constexpr int kMost = 2048;  // twice what a port holds
          for (int i = 0; i < kMost && odometry_->device.read(sample) == Status::kOk; ++i) {
          }
        }));
  needs.push_back(look_at(
      lines_, now, [&] { return lines_.device.open(lines_.path, clock_); },
      [&] { lines_.device.update(now); }));
  const bool has_lines = needs.back().lacks.empty();
  if (!has_lines)
    needs.back().lacks += " (operator's link and switches: nothing of roborun reads a receiver)";
  needs.push_back(look_at_bus(now));
  if (!needs.back().lacks.empty()) return needs;
  sensors_.look(now, needs);
  // Lines that nobody writes yet are no pressed switch.
  if (!has_lines) return needs;
  // The node says that it is there, and hears who else is. Nothing is armed.
  end_frame(now);
  needs.push_back(
      {"operator", lines_.device.hears_operator() ? "" : "is not heard: switch the transmitter on"});
  needs.push_back(look_at_kill_switch());
  look_at_power(actuators_, now, needs);
  hook_and_light_.look(now, needs);
  const bool others =
      std::all_of(needs.begin(), needs.end(), [](const Need& need) { return need.lacks.empty(); });
  needs.push_back(look_at_arming(others));
  return needs;
}

std::vector<PortUse> BusAircraft::use(MonotonicTime now) const {
  std::vector<PortUse> all;
  pictures_.use(now, all);
  sensors_.use(now, all);
  if (odometry_) all.push_back(use_of(*odometry_, now));
  all.push_back(use_of(lines_, now));
  const firmware_if::CanCounters& bus = wire_->node().counters();
  all.push_back({"bus", bus.received, bus.lost_on_receive, bus.bus_off + bus.detached});
  return all;
}

}  // namespace roborun::live
