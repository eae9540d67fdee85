#include "platform/app/run_guard.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "platform/app/exit_code.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/stop_signal.hpp"
#include "platform/live/guard.hpp"
#include "platform/report/progress_line.hpp"
#include "platform/vehicle/vehicle_file.hpp"

namespace roborun::app {
namespace {

constexpr double kBesides_m = 0.3;  // of the body: what wind and pilot make of a height

void print(const live::GuardReport& r, bool json) {
  if (!json) {
    fmt::print(
        "{} messages in {:.1f} s, {} not sent; nearest {}{}\n", r.messages, r.time_s, r.not_sent,
        std::isfinite(r.nearest_m) ? fmt::format("{:.2f} m", r.nearest_m) : "nothing",
        r.limit_mps ? fmt::format("; {} speed limits, the last one {:.1f} m/s", r.limits, *r.limit_mps) : "");
    return;
  }
  nlohmann::ordered_json ports = nlohmann::ordered_json::array();
  for (const live::PortUse& port : r.ports)
    ports.push_back(
        {{"device", port.device}, {"frames", port.frames}, {"dropped", port.dropped}, {"stale", port.stale}});
  nlohmann::ordered_json j{{"time_s", r.time_s}, {"messages", r.messages}, {"not_sent", r.not_sent}};
  j["nearest_m"] = std::isfinite(r.nearest_m) ? nlohmann::ordered_json(r.nearest_m) : nullptr;
  if (r.limit_mps) j["speed_limit"] = {{"sent", r.limits}, {"last_mps", *r.limit_mps}};
  j["port"] = ports;
  fmt::print("{}\n", j.dump());
}

}  // namespace

int run_guard(const GuardOptions& options) {
  live::GuardConfig config;
  config.link = live::link_of(options.link, options.port);
  if (!config.link.mavlink)
    throw InputError(
        "--guard: goes with a MAVLink --link: udpin://[HOST]:PORT, serial:///dev/NAME:BAUD, ...");
  const vehicle::Vehicle vehicle = vehicle::load_vehicle(options.vehicle);
  config.rig = vehicle.rig;
  config.band_m = vehicle.model.radius_m + kBesides_m;
  if (options.limits_speed)
    config.limit = {stopping_model(vehicle.model), vehicle.model.radius_m, vehicle.model.speed_mps};
  config.seconds = options.seconds;
  config.wait_s = options.wait_s;
  const input::StopOnSignal stop;
  config.stop = &input::StopOnSignal::requested;
  std::optional<report::ProgressLine> line(std::in_place);
  const live::GuardReport report = live::run_guard(config, [&line](double time_s, double nearest_m) {
    if (line->due()) line->show(fmt::format("guard {:5.0f} s, nearest {:.1f} m", time_s, nearest_m));
  });
  line.reset();
  if (!report.ready) {
    for (const live::Need& need : report.needs)
      if (!need.lacks.empty()) throw InputError(fmt::format("{}: {}", need.device, need.lacks));
  }
  print(report, options.json);
  if (input::StopOnSignal::requested())
    throw input::Interrupted(fmt::format("after {:.1f} s", report.time_s));
  return kDone;
}

}  // namespace roborun::app
