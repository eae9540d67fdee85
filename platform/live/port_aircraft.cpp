#include "platform/live/port_aircraft.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace roborun::live {
PortAircraft::PortAircraft(const std::string& name, const SensorRig& rig, Nanos minor_frame, Nanos epoch,
                           const std::optional<sensor_port::EarthPlace>& origin, bool needs_hook)
    : clock_{epoch},
      origin_(origin),
      bus_out_(sensor_port::VehiclePorts(name).bus_out()),
      pictures_(sensor_port::VehiclePorts(name), rig, clock_),
      lines_(lines_port_.device),
      actuators_(minor_frame, bus_.device, lines_port_.device.kill_open(), lines_port_.device.kill_closed()),
      hook_and_light_(actuators_, needs_hook) {
  using std::chrono::milliseconds;
  const sensor_port::VehiclePorts ports(name);
  prepare(imu_, "imu", ports.imu(), milliseconds(25));
  if (rig.gnss != GnssModel::kNone) prepare(gnss_.emplace(), "gnss", ports.gnss(), milliseconds(1000));
  if (rig.odometry != OdometryModel::kNone)
    prepare(odometry_.emplace(), "odometry", ports.odometry(), milliseconds(500));
  prepare(pressure_, "pressure", ports.pressure(), milliseconds(500));
  prepare(lines_port_, "lines", ports.lines(), sensor_port::PortLines::kGoneAfter);
  prepare(bus_, "bus", ports.bus_in(), milliseconds(500));
}

void PortAircraft::look_at_navigation(MonotonicTime now, std::vector<Need>& needs) {
  const auto drain = [](auto& device, auto sample, const auto& take) {
    constexpr int kMost = 2048;  // twice what a port holds
    for (int i = 0; i < kMost && device.read(sample) == Status::kOk; ++i) take(sample);
  };
  const auto nothing = [](const auto&) {};
  const auto plain = [&](auto& port, auto sample) {
    needs.push_back(look_at(
        port, now, [&] { return port.device.open(port.path, clock_); },
        [&] { drain(port.device, sample, nothing); }));
  };
  plain(imu_, firmware_if::ImuSample{});
  if (gnss_)
    needs.push_back(look_at(
        *gnss_, now, [&] { return gnss_->device.open(gnss_->path, clock_, origin_); },
        [&] {
          drain(gnss_->device, firmware_if::GnssFix{},
                [&](const firmware_if::GnssFix& fix) { pressure_.device.stands_at(fix.p_WB_m[2]); });
        }));
  if (odometry_) plain(*odometry_, firmware_if::OdometrySample{});
  plain(pressure_, firmware_if::BarometerSample{});
}

void PortAircraft::look_at_bus(MonotonicTime now, std::vector<Need>& needs) {
  if (bus_.device.state() != firmware_if::CanState::kActive) speaks_ = bus_.device.speak(bus_out_, clock_);
  needs.push_back(look_at(
      bus_, now, [&] { return bus_.device.listen(bus_.path, clock_); }, [] {}));
  if (!speaks_.empty()) needs.back().lacks = fmt::format("{}: {}", bus_out_, speaks_);
  needs.push_back(look_at(
      lines_port_, now, [&] { return lines_.open(lines_port_.path, clock_); }, [&] { lines_.update(now); }));
  // The node says that it is there, and hears who else is. Nothing is armed.
  // Lines that nobody writes yet are no pressed switch.
  if (bus_.is_open && lines_.kill_closed().active().ok()) end_frame(now);
}

void PortAircraft::look_at_vehicle(MonotonicTime now, std::vector<Need>& needs) const {
  Need kill{"kill switch", {}};
  if (actuators_.kill_switch().killed())
    kill.lacks = "was pressed, or its lines were lost, since the start: release it, and start again";
  else if (!actuators_.kill_switch().released())
    kill.lacks = "does not stand on run: release it, and look at both wires";
  needs.push_back(kill);
  needs.push_back({"operator", lines_.hears_operator() ? "" : "is not heard: switch the transmitter on"});
  look_at_power(actuators_, now, needs);
  hook_and_light_.look(now, needs);
}

std::vector<Need> PortAircraft::look(MonotonicTime now) {
  std::vector<Need> needs;
  pictures_.look(now, needs);
  look_at_navigation(now, needs);
  const std::size_t bus = needs.size();
  look_at_bus(now, needs);
  // Without bus and lines, what hangs on them is not asked for.
  if (needs[bus].lacks.empty() && needs[bus + 1].lacks.empty()) look_at_vehicle(now, needs);
  return needs;
}

std::vector<PortUse> PortAircraft::use(MonotonicTime now) const {
  std::vector<PortUse> all;
  pictures_.use(now, all);
  all.push_back(use_of(imu_, now));
  if (gnss_) all.push_back(use_of(*gnss_, now));
  if (odometry_) all.push_back(use_of(*odometry_, now));
  for (const PortUse& use : {use_of(pressure_, now), use_of(lines_port_, now), use_of(bus_, now)})
    all.push_back(use);
  return all;
}

}  // namespace roborun::live
