/// The flight system under the real clock: pinned threads, locked memory, a sealed heap, simulated
/// sensors.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>

#include "core/executive/frame_table.hpp"
#include "platform/gpio/kill_lines.hpp"
#include "platform/mission/mission.hpp"
#include "platform/report/audit_report.hpp"
#include "platform/rt/heap_seal.hpp"

namespace roborun::mission {

/// A fault put in on purpose, for tests and demonstrations.
struct Injection {
  core::SlotId slot{};
  Nanos spin{};              ///< Busy for so long each time, or until the run is over.
  std::uint64_t from_run{};  ///< Of the slot, counted from the first.
  std::uint64_t runs{};      ///< So many of them.
  bool heap_call{false};     ///< And one malloc and free.
};

struct RealTimeConfig {
  MissionConfig mission{};
  double seconds{60.0};
  bool best_effort{false};  ///< Run without what is missing, and say so in the report.
  rt::HeapSeal seal{rt::HeapSeal::kCount};
  bool load{false};   ///< stress-ng on all CPUs meanwhile.
  bool trace{false};  ///< Keep every frame and slot: traced_bytes(), at most kMostTraced_bytes.
  std::optional<Injection> inject{};
  std::function<std::string()> confine{};  ///< As rt::LaneSetConfig.
  std::function<bool()> stop{};  ///< Asked twenty times a second: true ends the run early. May be empty.
  /// CAN interfaces of the kernel for the motors' bus: the vehicle's and the ESCs' (KernelMotorBus).
  std::optional<std::array<std::string, 2>> can{};
  std::optional<gpio::KillWiring> kill{};  ///< A kill switch on lines of the kernel.
};

/// Memory for a trace is taken before the flight.
inline constexpr std::size_t kMostTraced_bytes = std::size_t{1} << 30U;
[[nodiscard]] std::size_t traced_bytes(const RealTimeConfig& config);

/// Takes off in `world` and flies on towards its goal for so many seconds, hovering once it is there. Throws
/// InputError if this machine cannot run it in real time (one line that names all that is missing) and
/// best_effort is off, if stress-ng is wanted and not there, if bus or kill lines cannot be had, and as
/// fly_mission(). `progress` (may be empty) is called about once a second with the seconds done. Under
/// systemd it says READY=1 once the lanes run, and WATCHDOG=1 twenty times a second for as long as the flight
/// lane keeps its releases.
[[nodiscard]] report::AuditReport run_real_time(const sitl::World& world, const RealTimeConfig& config,
                                                const std::function<void(double)>& progress);

/// The pools of the flight system for a world, without a flight.
[[nodiscard]] std::vector<report::PoolUse> memory_plan_of(const sitl::World& world,
                                                          const MissionConfig& config);

}  // namespace roborun::mission
