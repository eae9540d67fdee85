#include "platform/live/plant_faults.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "platform/input/input_error.hpp"

namespace roborun::live {

using governor::Phase;

void check_plant_faults(const std::string& file, const mission::MissionConfig& config) {
  using sitl::Component;
  constexpr std::array kOfTheRuntime{Component::kPlanner, Component::kMap, Component::kCpu};
  constexpr std::array kSeen{Phase::kGround, Phase::kTakeOff, Phase::kMission};
  const auto is_in = [](const auto& all, auto one) {
    return std::find(all.begin(), all.end(), one) != all.end();
  };
  for (std::size_t i = 0; i < config.faults.size(); ++i) {
    const mission::TimedFault& f = config.faults[i];
    const auto refuse = [&](const std::string& why) {
      throw InputError(fmt::format("--scenario: {}: fault {}: {}", file, i + 1, why));
    };
    const char* name = sitl::kComponents.at(static_cast<std::size_t>(f.fault.component)).name;
    if (is_in(kOfTheRuntime, f.fault.component))
      refuse(
          fmt::format("component '{}' is the runtime's own: must be one of the plant's (roborun scenario run "
                      "flies this one)",
                      name));
    if (f.phase && !is_in(kSeen, *f.phase))
      refuse(fmt::format("phase '{}' cannot be seen from outside: must be ground, take_off or mission",
                         governor::to_string(*f.phase)));
  }
}

void PlantFaults::advance(MonotonicTime now, double height_m) noexcept {
  constexpr double kOffGround_m = 0.1, kAtHeight_m = 0.3;
  if (faults_.empty()) return;
  if (!stood_m_) stood_m_ = height_m;
  if (phase_ == Phase::kGround && height_m > *stood_m_ + kOffGround_m) {
    phase_ = Phase::kTakeOff;
    faults_.count_from(now);
  }
  if (phase_ == Phase::kTakeOff && height_m > cruise_m_ - kAtHeight_m) phase_ = Phase::kMission;
  (void)faults_.advance(now, phase_);
}

}  // namespace roborun::live
