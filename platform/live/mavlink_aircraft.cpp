#include "platform/live/mavlink_aircraft.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <utility>

namespace roborun::live {

using firmware_if::AutopilotReport;
using firmware_if::AutopilotStage;

void MavlinkAircraft::begin_frame(MonotonicTime now) noexcept {
  constexpr int kMost = 64;  // datagrams: a second of an autopilot's
  constexpr Nanos kPatience{500'000'000};
  if (signed_) signed_->tick(now);
  for (int i = 0; i < kMost; ++i) {
    const std::size_t count = link_.read(now, bytes_);
    if (count == 0) break;
    (void)companion_.receive(now, std::span<const std::uint8_t>(bytes_).first(count));
  }
  if (const std::uint32_t asked = releases_asked_.load(std::memory_order_relaxed); asked != releases_begun_) {
    releases_begun_ = asked;
    companion_.release_package();
  }
  if (const auto request = companion_.asked()) (void)asked_.push(*request);
  firmware_if::mavlink::CommandAck ack;
  while (answers_.pop(ack)) companion_.tell(ack);
  // One line in a frame: they are no reason to be late.
  firmware_if::mavlink::Statustext line;
  if (lines_.pop(line)) companion_.tell(line);
  const std::uint64_t states = companion_.counters().states;
  if (states != states_) {
    states_ = states;
    state_at_ = now;
    is_silent_ = false;
  } else if (states_ > 0 && !is_silent_ && now - state_at_ > kPatience) {
    is_silent_ = true;
    ++silences_;
  }
}

void MavlinkAircraft::end_frame(MonotonicTime now) noexcept {
  (void)link_.write(now, companion_.outgoing());
  const std::uint64_t set_points = companion_.counters().set_points;
  if (set_points != std::exchange(set_points_, set_points) &&
      companion_.report().stage == AutopilotStage::kOurs)
    latency_.add(clock_.now() - companion_.newest_state());
  companion_.sent(companion_.outgoing().size());
}

std::vector<Need> MavlinkAircraft::look(MonotonicTime now) {
  std::vector<Need> needs;
  pictures_.look(now, needs);
  begin_frame(now);
  companion_.step(now);
  end_frame(now);
  const AutopilotReport report = companion_.report();
  Need autopilot{"autopilot", {}, true};
  if (!link_.is_open() && link_.why() == 0)
    autopilot.lacks = "nobody answers at the far end of the link yet";
  else if (!link_.is_open())
    autopilot = {"autopilot", fmt::format("the link cannot be opened: {}", std::strerror(link_.why())),
                 false};
  else if (report.stage != AutopilotStage::kReady)
    autopilot.lacks =
        fmt::format("{}{}{}", report.reason, report.subject[0] == '\0' ? "" : ": ", report.subject);
  needs.push_back(autopilot);
  if (autopilot.lacks.empty())
    needs.push_back(battery_need(report.battery_ratio, "the autopilot says nothing about it"));
  if (autopilot.lacks.empty() && origin_) needs.push_back(look_at_origin());
  return needs;
}

std::optional<sensor_port::EarthPlace> MavlinkAircraft::origin() const {
  const auto& told = companion_.origin();
  if (!told) return std::nullopt;
  return sensor_port::EarthPlace{1e-7 * told->latitude, 1e-7 * told->longitude, 1e-3 * told->altitude};
}

Need MavlinkAircraft::look_at_origin() const {
  constexpr double kApart_m = 1.0;
  const auto told = origin();
  if (!told) return {"origin", "the autopilot does not say where its frame begins"};
  const sensor_port::EarthPlace& theirs = *told;
  const auto p_m = sensor_port::LocalFrame(*origin_).to_local_m(theirs);
  if (std::hypot(p_m[0], p_m[1]) < kApart_m) return {"origin", {}};
  return {
      "origin",
      fmt::format("the autopilot's frame begins {:.0f} m from where this mission does: must go with --origin "
                  "{:.7f},{:.7f},{:g}",
                  std::hypot(p_m[0], p_m[1]), theirs.latitude_deg, theirs.longitude_deg, theirs.height_m)};
}

std::vector<PortUse> MavlinkAircraft::use(MonotonicTime now) const {
  (void)now;
  std::vector<PortUse> all;
  pictures_.use(now, all);
  all.push_back({"autopilot", companion_.counters().states, companion_.counters().stale_states, silences_});
  return all;
}

}  // namespace roborun::live
