#include "platform/rt/kernel_counters.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>

namespace roborun::rt {
namespace {

/// No stdio: its buffers would come from the heap that is sealed.
void read_migrations(KernelCounters& out) noexcept {
  const int file = open("/proc/thread-self/sched", O_RDONLY | O_CLOEXEC);
  if (file < 0) return;
  std::array<char, 8192> text{};
  const ssize_t size = read(file, text.data(), text.size() - 1);
  close(file);
  if (size <= 0) return;
  const char* line = std::strstr(text.data(), "nr_migrations");
  const char* colon = line != nullptr ? std::strchr(line, ':') : nullptr;
  if (colon == nullptr) return;
  out.migrations = std::strtoull(colon + 1, nullptr, 10);
  out.migrations_known = true;
}

}  // namespace

KernelCounters read_kernel_counters() noexcept {
  KernelCounters out;
  read_migrations(out);
  rusage usage{};
  if (getrusage(RUSAGE_THREAD, &usage) == 0) {
    out.minor_faults = static_cast<std::uint64_t>(usage.ru_minflt);
    out.major_faults = static_cast<std::uint64_t>(usage.ru_majflt);
    out.voluntary_switches = static_cast<std::uint64_t>(usage.ru_nvcsw);
    out.involuntary_switches = static_cast<std::uint64_t>(usage.ru_nivcsw);
  }
  return out;
}

KernelCounters operator-(const KernelCounters& after, const KernelCounters& before) noexcept {
  return {after.minor_faults - before.minor_faults,
          after.major_faults - before.major_faults,
          after.voluntary_switches - before.voluntary_switches,
          after.involuntary_switches - before.involuntary_switches,
          after.migrations - before.migrations,
          after.migrations_known && before.migrations_known};
}

}  // namespace roborun::rt
