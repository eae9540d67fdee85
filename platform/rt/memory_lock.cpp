#include "platform/rt/memory_lock.hpp"

#include <malloc.h>
#include <sys/mman.h>
#include <sys/resource.h>

#include <cerrno>
#include <cstring>
#include <fstream>

namespace roborun::rt {

void prepare_heap() noexcept {
  mallopt(M_ARENA_MAX, 1);
  mallopt(M_TRIM_THRESHOLD, -1);
}

std::string lock_memory() {
  if (mlockall(MCL_CURRENT | MCL_FUTURE) == 0) return {};
  const int why = errno;
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  return "memory lock: " + std::string(std::strerror(why)) + ", the limit is " +
         std::to_string(limit.rlim_cur / 1024) +
         " KiB: run as root, grant CAP_IPC_LOCK, or raise 'memlock' in /etc/security/limits.conf";
}

void unlock_memory() noexcept { munlockall(); }

std::uint64_t locked_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string key; status >> key;) {
    std::uint64_t kilobytes = 0;
    if (key == "VmLck:" && status >> kilobytes) return 1024 * kilobytes;
  }
  return 0;
}

}  // namespace roborun::rt
