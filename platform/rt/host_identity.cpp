#include "platform/rt/host_identity.hpp"

#include <sched.h>
#include <sys/utsname.h>

#include <fstream>

namespace roborun::rt {
namespace {

std::string first_line(const char* path, const char* empty) {
  std::ifstream file(path);
  std::string line;
  if (!file) return "unknown";
  std::getline(file, line);
  while (!line.empty() && line.back() == '\0') line.pop_back();  // as the device tree ends its texts
  return line.empty() ? empty : line;
}

/// Of the first CPU.
std::string cpu_info(const char* key) {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const auto colon = line.find(": ");
    if (line.rfind(key, 0) == 0 && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown";
}

std::string firmware() {
  const std::string dmi = "/sys/class/dmi/id/";
  const std::string version = first_line((dmi + "bios_version").c_str(), "unknown");
  if (version == "unknown") return first_line("/sys/firmware/devicetree/base/model", "unknown");
  return first_line((dmi + "bios_vendor").c_str(), "unknown") + " " + version + " " +
         first_line((dmi + "bios_date").c_str(), "unknown");
}

std::string frequency() {
  const std::string folder = "/sys/devices/system/cpu/cpu0/cpufreq/";
  const std::string most = first_line((folder + "scaling_max_freq").c_str(), "unknown");
  if (most != "unknown")
    return first_line((folder + "scaling_min_freq").c_str(), "unknown") + " to " + most + " kHz";
  const std::string now = cpu_info("cpu MHz");
  return now == "unknown" ? now : now + " MHz, without a governor";
}

}  // namespace

HostIdentity identify_host() {
  HostIdentity id;
  utsname name{};
  if (uname(&name) == 0) {
    id.host = name.nodename;
    id.kernel = std::string(name.release) + " " + name.version + " " + name.machine;
    id.preempt_rt = std::string(name.version).find("PREEMPT_RT") != std::string::npos;
  }
  id.cpu = cpu_info("model name");
  id.microcode = cpu_info("microcode");
  id.firmware = firmware();
  cpu_set_t allowed;
  if (sched_getaffinity(0, sizeof allowed, &allowed) == 0) id.cpus = CPU_COUNT(&allowed);
  id.governor = first_line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "unknown");
  id.frequency = frequency();
  id.nohz_full = first_line("/sys/devices/system/cpu/nohz_full", "none");
  id.isolated = first_line("/sys/devices/system/cpu/isolated", "none");
  id.rt_runtime = first_line("/proc/sys/kernel/sched_rt_runtime_us", "unknown");
  return id;
}

}  // namespace roborun::rt
