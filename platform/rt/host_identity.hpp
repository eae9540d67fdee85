/// On what a measurement was made, so that nobody compares what cannot be compared.
#pragma once

#include <string>

namespace roborun::rt {

/// "unknown" where the machine does not say.
struct HostIdentity {
  std::string host;        ///< Its name.
  std::string kernel;      ///< Release, version and machine.
  bool preempt_rt{};       ///< The kernel is a PREEMPT_RT one.
  std::string cpu;         ///< Model name.
  int cpus{};              ///< That this process may use.
  std::string microcode;   ///< Revision.
  std::string firmware;    ///< Maker, version and date of the BIOS, or the board's model.
  std::string governor;    ///< Of the frequency of CPU 0.
  std::string frequency;   ///< Its limits, or what it is where it has none.
  std::string isolated;    ///< CPUs kept free by the kernel command line; "none".
  std::string nohz_full;   ///< CPUs without a timer tick; "none".
  std::string rt_runtime;  ///< sched_rt_runtime_us: -1 means that real-time threads are never throttled.
};

[[nodiscard]] HostIdentity identify_host();

}  // namespace roborun::rt
