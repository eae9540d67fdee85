/// What else a machine did while lanes ran on it, by name: what may explain a late frame.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace roborun::rt {

/// Nothing: this machine does not say.
struct Disturbance {
  std::string name;
  std::string unit;
  std::optional<double> total;
  std::optional<double> worst_second;  ///< Of what sample() reads.
};

/// From its construction to finish(). Reads /proc, /sys and, where they are there, the processor's counters of system
/// management interrupts; allocates: on an ordinary thread, never on a lane's.
class InterferenceWatch {
 public:
  /// `cpus`: those on which lanes run.
  explicit InterferenceWatch(const std::vector<int>& cpus);
  /// To be called about once a second: time stolen by a hypervisor, in interrupts and in soft interrupts, and frequencies.
  void sample();
  /// For each CPU: stolen, interrupt and soft interrupt time (the kernel's resolution is 10 ms), interrupts by
  /// name (the five most frequent ones), lowest and highest frequency and its changes, thermal throttlings, system
  /// management interrupts. For the process: involuntary switches of each thread. For the machine: CPU time of the five
  /// other programs, of those that still run, that took most of it.
  [[nodiscard]] std::vector<Disturbance> finish();

 private:
  /// Of one CPU since the machine started, ms.
  struct CpuTime {
    double stolen{}, interrupts{}, soft_interrupts{};
  };
  struct Cpu {
    int number{};
    CpuTime before, last, worst;
    std::optional<double> lowest_MHz, highest_MHz, last_MHz;
    std::uint64_t changes{};
    std::optional<std::uint64_t> throttled, managed;
    std::map<std::string, std::uint64_t> interrupts;
  };
  struct Program {
    std::string name;
    double ms{};
  };
  [[nodiscard]] static std::optional<CpuTime> time_of(int cpu);
  [[nodiscard]] static std::map<std::string, std::uint64_t> interrupts_of(int cpu);
  [[nodiscard]] static std::map<int, Program> programs();
  [[nodiscard]] static std::map<std::string, std::uint64_t> switches_of_threads();

  std::vector<Cpu> cpu_;
  std::map<int, Program> program_;
  std::map<std::string, std::uint64_t> switches_;
};

}  // namespace roborun::rt
