#include "platform/rt/interference.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

namespace roborun::rt {
namespace {

constexpr std::size_t kMost = 5;  // of interrupts and programs

double ms_per_tick() {
  static const double ms = 1000.0 / static_cast<double>(std::max(sysconf(_SC_CLK_TCK), 1L));
  return ms;
}

std::string cpu_folder(int cpu) { return "/sys/devices/system/cpu/cpu" + std::to_string(cpu) + "/"; }

std::optional<double> number_in(const std::string& path) {
  std::ifstream file(path);
  double value = 0.0;
  return file >> value ? std::optional<double>(value) : std::nullopt;
}

std::optional<std::uint64_t> throttlings(int cpu) {
  const auto count = number_in(cpu_folder(cpu) + "thermal_throttle/core_throttle_count");
  return count ? std::optional<std::uint64_t>(static_cast<std::uint64_t>(*count)) : std::nullopt;
}

/// MSR_SMI_COUNT of Intel's processors (Software Developer's Manual, volume 4).
std::optional<std::uint64_t> management_interrupts(int cpu) {
  constexpr off_t kSmiCount = 0x34;
  const int file = open(("/dev/cpu/" + std::to_string(cpu) + "/msr").c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return std::nullopt;
  std::uint64_t count = 0;
  const bool read = pread(file, &count, sizeof count, kSmiCount) == sizeof count;
  (void)close(file);
  return read ? std::optional<std::uint64_t>(count & 0xFFFFFFFFU) : std::nullopt;
}

std::optional<double> since(const std::optional<std::uint64_t>& before,
                            const std::optional<std::uint64_t>& now) {
  if (!before || !now || *now < *before) return std::nullopt;
  return static_cast<double>(*now - *before);
}

/// The largest first, at most kMost.
template <typename Named>
void keep_largest(std::vector<Named>& all) {
  std::stable_sort(all.begin(), all.end(),
                   [](const Named& a, const Named& b) { return *a.total > *b.total; });
  if (all.size() > kMost) all.resize(kMost);
}

}  // namespace

std::optional<InterferenceWatch::CpuTime> InterferenceWatch::time_of(int cpu) {
  std::ifstream file("/proc/stat");
  const std::string wanted = "cpu" + std::to_string(cpu);
  for (std::string line; std::getline(file, line);) {
    std::istringstream fields(line);
    std::string name;
    double user = 0, nice = 0, system = 0, idle = 0, waiting = 0, interrupts = 0, soft = 0, stolen = 0;
    fields >> name;
    if (name == wanted && fields >> user >> nice >> system >> idle >> waiting >> interrupts >> soft >> stolen)
      return CpuTime{ms_per_tick() * stolen, ms_per_tick() * interrupts, ms_per_tick() * soft};
  }
  return std::nullopt;
}

std::map<std::string, std::uint64_t> InterferenceWatch::interrupts_of(int cpu) {
  std::map<std::string, std::uint64_t> counts;
  std::ifstream file("/proc/interrupts");
  std::string line;
  if (!std::getline(file, line)) return counts;
  std::istringstream head(line);
  std::size_t columns = 0, column = 0;
  for (std::string name; head >> name; ++columns)
    if (name == "CPU" + std::to_string(cpu)) column = columns + 1;
  while (column > 0 && std::getline(file, line)) {
    std::istringstream fields(line);
    std::string number, rest;
    fields >> number;
    std::uint64_t count = 0, ours = 0;
    std::size_t read = 0;
    while (read < columns && fields >> count) {
      if (++read == column) ours = count;
    }
    if (read < columns) continue;  // ERR and MIS are no CPU's
    std::getline(fields >> std::ws, rest);
    std::string text = number + " ";
    for (const char c : rest)
      if (c != ' ' || text.back() != ' ') text += c;
    counts[text] = ours;
  }
  return counts;
}

std::map<int, InterferenceWatch::Program> InterferenceWatch::programs() {
  std::map<int, Program> all;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc", error)) {
    const std::string id = entry.path().filename();
    if (id.find_first_not_of("0123456789") != std::string::npos) continue;
    std::ifstream file(entry.path() / "stat");
    std::string line;
    std::getline(file, line);
    const std::size_t open = line.find('('), close = line.rfind(')');
    if (open == std::string::npos || close == std::string::npos) continue;  // it has just ended
    std::istringstream fields(line.substr(close + 1));
    std::string skipped;
    for (int i = 0; i < 11; ++i) fields >> skipped;
    double user = 0, system = 0;
    if (fields >> user >> system)
      all[std::stoi(id)] = {line.substr(open + 1, close - open - 1), ms_per_tick() * (user + system)};
  }
  return all;
}

std::map<std::string, std::uint64_t> InterferenceWatch::switches_of_threads() {
  std::map<std::string, std::uint64_t> all;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task", error)) {
    std::ifstream file(entry.path() / "status");
    std::string name;
    for (std::string line; std::getline(file, line);) {
      if (line.rfind("Name:\t", 0) == 0) name = line.substr(6);
      if (line.rfind("nonvoluntary_ctxt_switches:\t", 0) == 0)
        all[name] += std::strtoull(&line[28], nullptr, 10);
    }
  }
  return all;
}

InterferenceWatch::InterferenceWatch(const std::vector<int>& cpus)
    : program_(programs()), switches_(switches_of_threads()) {
  for (const int number : std::set<int>(cpus.begin(), cpus.end())) {
    if (number < 0) continue;
    Cpu& cpu = cpu_.emplace_back();
    cpu.number = number;
    cpu.before = cpu.last = time_of(number).value_or(CpuTime{});
    cpu.throttled = throttlings(number);
    cpu.managed = management_interrupts(number);
    cpu.interrupts = interrupts_of(number);
  }
  sample();
}

void InterferenceWatch::sample() {
  for (Cpu& cpu : cpu_) {
    if (const auto now = time_of(cpu.number)) {
      cpu.worst.stolen = std::max(cpu.worst.stolen, now->stolen - cpu.last.stolen);
      cpu.worst.interrupts = std::max(cpu.worst.interrupts, now->interrupts - cpu.last.interrupts);
      cpu.worst.soft_interrupts =
          std::max(cpu.worst.soft_interrupts, now->soft_interrupts - cpu.last.soft_interrupts);
      cpu.last = *now;
    }
    if (const auto kHz = number_in(cpu_folder(cpu.number) + "cpufreq/scaling_cur_freq")) {
      const double MHz = 1e-3 * *kHz;
      cpu.lowest_MHz = std::min(cpu.lowest_MHz.value_or(MHz), MHz);
      cpu.highest_MHz = std::max(cpu.highest_MHz.value_or(MHz), MHz);
      if (cpu.last_MHz && std::abs(*cpu.last_MHz - MHz) > 1.0) ++cpu.changes;
      cpu.last_MHz = MHz;
    }
  }
}

std::vector<Disturbance> InterferenceWatch::finish() {
  sample();
  std::vector<Disturbance> all;
  for (const Cpu& cpu : cpu_) {
    const std::string on = "cpu " + std::to_string(cpu.number) + ": ";
    all.push_back(
        {on + "stolen by the hypervisor", "ms", cpu.last.stolen - cpu.before.stolen, cpu.worst.stolen});
    all.push_back(
        {on + "in interrupts", "ms", cpu.last.interrupts - cpu.before.interrupts, cpu.worst.interrupts});
    all.push_back({on + "in soft interrupts", "ms", cpu.last.soft_interrupts - cpu.before.soft_interrupts,
                   cpu.worst.soft_interrupts});
    const std::string interrupt = on + "interrupt ";
    std::vector<Disturbance> interrupts;
    for (const auto& [name, count] : interrupts_of(cpu.number)) {
      const auto before = cpu.interrupts.find(name);
      const std::uint64_t then = before == cpu.interrupts.end() ? 0 : before->second;
      if (count > then)
        interrupts.push_back({interrupt + name, "times", static_cast<double>(count - then), {}});
    }
    keep_largest(interrupts);
    all.insert(all.end(), interrupts.begin(), interrupts.end());
    const std::optional<double> changes =
        cpu.last_MHz ? std::optional<double>(static_cast<double>(cpu.changes)) : std::nullopt;
    all.push_back({on + "changes of frequency from second to second", "times", changes, {}});
    all.push_back({on + "lowest frequency", "MHz", cpu.lowest_MHz, {}});
    all.push_back({on + "highest frequency", "MHz", cpu.highest_MHz, {}});
    all.push_back({on + "thermal throttlings", "times", since(cpu.throttled, throttlings(cpu.number)), {}});
    all.push_back({on + "system management interrupts",
                   "times",
                   since(cpu.managed, management_interrupts(cpu.number)),
                   {}});
  }
  for (const auto& [name, count] : switches_of_threads()) {
    const auto before = switches_.find(name);
    const std::uint64_t then = before == switches_.end() ? 0 : before->second;
    all.push_back({"thread " + name + ": switched out against its will",
                   "times",
                   static_cast<double>(count - std::min(then, count)),
                   {}});
  }
  std::map<std::string, double> by_name;
  for (const auto& [id, program] : programs()) {
    const auto before = program_.find(id);
    const double ms = program.ms - (before == program_.end() ? 0.0 : before->second.ms);
    if (id != getpid() && ms > 0.0) by_name[program.name] += ms;
  }
  std::vector<Disturbance> others;
  others.reserve(by_name.size());
  for (const auto& [name, ms] : by_name) others.push_back({"other program " + name, "ms", ms, {}});
  keep_largest(others);
  all.insert(all.end(), others.begin(), others.end());
  return all;
}

}  // namespace roborun::rt
