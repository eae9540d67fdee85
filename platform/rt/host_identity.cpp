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
  return line.empty() ? empty : line;
}

std::string cpu_model() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const auto colon = line.find(": ");
    if (line.rfind("model name", 0) == 0 && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown";
}

}  // namespace

HostIdentity identify_host() {
  HostIdentity id;
  id.build = "g++ " __VERSION__;
#ifdef NDEBUG
  id.build += ", release";
#else
  id.build += ", assertions on";
#endif
  utsname name{};
  if (uname(&name) == 0) {
    id.kernel = std::string(name.release) + " " + name.version + " " + name.machine;
    id.preempt_rt = std::string(name.version).find("PREEMPT_RT") != std::string::npos;
  }
  id.cpu = cpu_model();
  cpu_set_t allowed;
  if (sched_getaffinity(0, sizeof allowed, &allowed) == 0) id.cpus = CPU_COUNT(&allowed);
  id.governor = first_line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "unknown");
  id.isolated = first_line("/sys/devices/system/cpu/isolated", "none");
  id.rt_runtime = first_line("/proc/sys/kernel/sched_rt_runtime_us", "unknown");
  return id;
}

}  // namespace roborun::rt
