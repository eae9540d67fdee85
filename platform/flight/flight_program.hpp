/// What runs in the slots of the flight lane, whether time is real or virtual.
#pragma once

#include <cstdint>

#include "core/executive/frame_table.hpp"
#include "core/executive/lane_executive.hpp"
#include "platform/flight/failsafe_pilot.hpp"
#include "platform/flight/near_watch.hpp"

namespace roborun::flight {

class FlightProgram final : public core::LaneProgram {
 public:
  FlightProgram(const FailsafePilot::Config& config, FlightControl& control, Aircraft& aircraft,
                LaneMail& mail, const NearWatch& watch) noexcept
      : control_(control),
        aircraft_(aircraft),
        mail_(mail),
        pilot_(config, control, aircraft),
        watch_(watch) {}
  /// A frame belongs to the instant of its release, however late it begins.
  void run(core::SlotId slot, core::LaneExecutive& lane) noexcept override;
  /// Offers refused because an overrun or the failsafe has the vehicle brake, or because they begin elsewhere
  /// than the committed trajectory will be; never decreases.
  [[nodiscard]] std::uint64_t offers_refused() const noexcept { return offers_refused_; }
  /// As if its own look had shown something near in the way; between two frames.
  void brake_for_near() noexcept;
  /// Times that it braked for what its own look showed, between two decisions; never decreases.
  [[nodiscard]] std::uint64_t near_brakes() const noexcept { return near_brakes_; }
  [[nodiscard]] const FailsafePilot& pilot() const noexcept { return pilot_; }
  /// FailsafePilot::ask_to_land(). Any thread.
  void ask_to_land() noexcept { pilot_.ask_to_land(); }

 private:
  void look(MonotonicTime now) noexcept;
  void take_offers(MonotonicTime now, const core::LaneExecutive& lane) noexcept;
  void publish(MonotonicTime now) noexcept;

  FlightControl& control_;
  Aircraft& aircraft_;
  LaneMail& mail_;
  FailsafePilot pilot_;
  NearWatch watch_;
  std::uint64_t offers_refused_{0};
  std::uint64_t near_brakes_{0};
};

}  // namespace roborun::flight
