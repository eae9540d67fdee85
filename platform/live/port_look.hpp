/// A device behind a port: what is missing of it before the flight, and what it brought.
#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>

#include "platform/live/far_end.hpp"
#include "platform/sensor_port/port_devices.hpp"

namespace roborun::live {

/// A device, and where it is.
template <typename Device>
struct Port {
  std::string name, path;
  Device device{};
  bool is_open{false};
};

template <typename Device>
void prepare(Port<Device>& port, std::string name, std::string path, Nanos patience) {
  port.name = std::move(name);
  port.path = std::move(path);
  port.device.set_patience(patience);
}

/// Samples that were not taken because something in them is wrong.
[[nodiscard]] inline std::uint64_t refused_by(const sensor_port::PortDevice& device) {
  const sensor_port::PortRefusals& r = device.refusals();
  return device.reader().counters().refused + r.size + r.optics + r.values + r.backwards;
}

/// Opens it with `open` if it is not open, takes with `read` what came, and says what is missing.
template <typename Device, typename Open, typename Read>
[[nodiscard]] Need look_at(Port<Device>& port, MonotonicTime now, const Open& open, const Read& read) {
  constexpr double kOld_s = 0.5;     // of the newest sample
  constexpr double kAhead_s = 0.01;  // of this machine's clock
  // Before the flight a feeder that starts again may bring another file.
  const bool is_stale =
      port.device.newest() == MonotonicTime::min() || seconds(now - port.device.newest()) > kOld_s;
  if (!port.is_open || (is_stale && port.device.reader().is_replaced())) {
    const std::string wrong = open();
    port.is_open = wrong.empty();
    if (!port.is_open)
      return {port.name, fmt::format("{}: {}: start what writes it", port.path, wrong), false};
  }
  read();
  if (port.device.newest() == MonotonicTime::min()) {
    if (const std::uint64_t count = refused_by(port.device); count > 0)
      return {port.name, fmt::format("{}: all of its {} samples were refused: roborun port check {}",
                                     port.path, count, port.path)};
    return {port.name, fmt::format("{}: nothing is written to it: start what writes it", port.path)};
  }
  const double age_s = seconds(now - port.device.newest());
  if (age_s > kOld_s)
    return {port.name,
            fmt::format("{}: its newest sample is {:.1f} s old: is what writes it alive?", port.path, age_s)};
  if (age_s < -kAhead_s)
    return {port.name,
            fmt::format("{}: its stamps are {:.2f} s ahead of this machine's clock", port.path, -age_s)};
  return {port.name, {}};
}

template <typename Device>
[[nodiscard]] PortUse use_of(const Port<Device>& port, MonotonicTime now) {
  const sensor_port::PortCounters& c = port.device.reader().counters();
  return {port.name, c.read, c.dropped + refused_by(port.device), port.device.silences(now)};
}

}  // namespace roborun::live
