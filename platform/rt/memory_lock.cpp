#include "platform/rt/memory_lock.hpp"

#include <link.h>
#include <malloc.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

namespace roborun::rt {

void prepare_heap() noexcept {
  mallopt(M_ARENA_MAX, 1);
  mallopt(M_TRIM_THRESHOLD, -1);
}

std::string lock_memory() {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return "memory lock: not in a sanitizer build";
#endif
  if (mlockall(MCL_CURRENT | MCL_FUTURE) == 0) return {};
  const int why = errno;
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  return "memory lock: " + std::string(std::strerror(why)) + ", the limit is " +
         std::to_string(limit.rlim_cur / 1024) +
         " KiB: run as root, grant CAP_IPC_LOCK, or raise 'memlock' in /etc/security/limits.conf";
}

void unlock_libraries(std::span<const char* const> names) noexcept {
  dl_iterate_phdr(
      [](dl_phdr_info* info, std::size_t, void* wanted) {
        const char* slash = std::strrchr(info->dlpi_name, '/');
        const char* file = slash != nullptr ? slash + 1 : info->dlpi_name;
        bool fits = false;
        for (const char* name : *static_cast<const std::span<const char* const>*>(wanted))
          fits = fits || std::strncmp(file, name, std::strlen(name)) == 0;
        const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
        for (int i = 0; fits && i < info->dlpi_phnum; ++i) {
          const ElfW(Phdr)& segment = info->dlpi_phdr[i];
          if (segment.p_type != PT_LOAD) continue;
          const std::uintptr_t begin = (info->dlpi_addr + segment.p_vaddr) / page * page;
          const std::uintptr_t end = info->dlpi_addr + segment.p_vaddr + segment.p_memsz;
          // NOLINTNEXTLINE(performance-no-int-to-ptr): the loader gives addresses as numbers
          munlock(reinterpret_cast<const void*>(begin), end - begin);
        }
        return 0;
      },
      &names);
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
