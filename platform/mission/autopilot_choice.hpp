/// A mission that an autopilot flies: which one, and what that means for the plans.
#pragma once

#include <optional>
#include <string>

#include "core/vehicle_model.hpp"
#include "firmware_if/mavlink/companion.hpp"

namespace roborun::mission {

using firmware_if::mavlink::AutopilotKind;

struct AutopilotChoice {
  AutopilotKind kind{AutopilotKind::kPx4};
  bool tuned{
      false};  ///< Its acceleration and jerk are set to the vehicle's before the take-off; else they stay its defaults.
};

/// "px4" or "arducopter"; "none": nothing. Throws InputError that names the option.
[[nodiscard]] std::optional<AutopilotKind> autopilot_of(const char* option, const std::string& name);
[[nodiscard]] const char* to_string(AutopilotKind kind) noexcept;

/// The vehicle as this autopilot flies and stops it, for the plans. Limits: the lesser of both. Its errors: those of the
/// autopilot's loops, or the vehicle's own if they are larger. Its stop: whichever of these is
/// longer, at every speed up to its fastest,
///  - the stop that its trajectories end in, within those limits;
///  - the autopilot's own after silence: v (silence + delay + a / 2j) + v^2 / 2a, the link's delay and the period of the
///  set-points included.
[[nodiscard]] VehicleModel as_flown_by(const VehicleModel& vehicle,
                                       const firmware_if::AutopilotLimits& limits) noexcept;

/// What the companion asks of it. It takes the mode and arms: the simulated operator has agreed.
[[nodiscard]] firmware_if::mavlink::Companion::Config companion_config(const AutopilotChoice& choice,
                                                                       const VehicleModel& vehicle) noexcept;

}  // namespace roborun::mission
