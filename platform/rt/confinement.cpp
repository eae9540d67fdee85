#include "platform/rt/confinement.hpp"

#include <linux/capability.h>
#include <sched.h>
#include <seccomp.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <memory>

namespace roborun::rt {
namespace {

// Sorted by what needs them. Names that this kernel or architecture does not have are left out.
constexpr std::array kAllowed{
    // Lanes, their clocks and what wakes them.
    "clock_getres", "clock_gettime", "clock_gettime64", "clock_nanosleep", "clock_nanosleep_time64", "futex",
    "futex_time64", "gettimeofday", "nanosleep", "restart_syscall", "sched_yield", "time",
    // Devices, ports and links.
    "accept", "accept4", "bind", "connect", "epoll_create1", "epoll_ctl", "epoll_pwait", "epoll_wait",
    "eventfd2", "getpeername", "getsockname", "getsockopt", "listen", "pipe2", "poll", "ppoll",
    "ppoll_time64", "pselect6", "pselect6_time64", "recv", "recvfrom", "recvmmsg", "recvmmsg_time64",
    "recvmsg", "select", "_newselect", "send", "sendmmsg", "sendmsg", "sendto", "setsockopt", "shutdown",
    // Logs and reports: files that are written whole, under another name first.
    "_llseek", "access", "chmod", "close", "dup", "faccessat", "faccessat2", "fadvise64", "fchmod", "fchown",
    "fchown32", "fcntl", "fcntl64", "fdatasync", "flock", "fstat", "fstat64", "fstatat64", "fstatfs", "fsync",
    "ftruncate", "ftruncate64", "getcwd", "getdents64", "link", "linkat", "lseek", "lstat", "lstat64",
    "newfstatat", "open", "openat", "pread64", "pwrite64", "pwritev", "read", "readlink", "readlinkat",
    "readv", "rename", "renameat", "renameat2", "stat", "stat64", "statfs", "statx", "umask", "unlink",
    "unlinkat", "write", "writev",
    // Memory; mapping is below.
    "brk", "madvise", "mincore", "mlock", "mlock2", "mlockall", "mremap", "munlock", "munlockall", "munmap",
    // Threads; clone is below.
    "arm_set_tls", "cacheflush", "exit", "exit_group", "get_robust_list", "getpriority", "gettid",
    "membarrier", "prctl", "rseq", "sched_getaffinity", "sched_getparam", "sched_getscheduler",
    "sched_setaffinity", "sched_setscheduler", "set_robust_list", "set_tid_address", "set_tls",
    // Signals, and the end of the load that an audit started.
    "kill", "rt_sigaction", "rt_sigpending", "rt_sigprocmask", "rt_sigreturn", "rt_sigtimedwait",
    "sigaltstack", "sigreturn", "tgkill", "wait4", "waitid",
    // What is told about the process and the machine.
    "getegid", "getegid32", "geteuid", "geteuid32", "getgid", "getgid32", "getpid", "getppid", "getrandom",
    "getrlimit", "getrusage", "getuid", "getuid32", "prlimit64", "sysinfo", "times", "ugetrlimit", "uname"};

// ioctl: the kinds of commands of sockets and GPIO lines, and what a serial link and a terminal are asked.
constexpr scmp_datum_t kSockets = 0x89, kGpioLines = 0xB4;
constexpr std::array<scmp_datum_t, 16> kTerminal{TCGETS,   TCSETS,   TCSETSW,  TCSETSF,  TCSBRK,     TCFLSH,
                                                 TIOCEXCL, TIOCNXCL, FIONREAD, TIOCOUTQ, TIOCGWINSZ, TIOCMGET,
                                                 TIOCMBIS, TIOCMBIC, TIOCMSET, FIONBIO};

using Filter = std::unique_ptr<void, decltype(&seccomp_release)>;

/// 0, or an error number below 0.
template <typename... Conditions>
int allow(const Filter& filter, std::uint32_t action, const char* name, Conditions... conditions) {
  const int number = seccomp_syscall_resolve_name(name);
  if (number == __NR_SCMP_ERROR) return 0;  // not on this architecture
  const std::array<scmp_arg_cmp, sizeof...(conditions)> all{conditions...};
  const int error = seccomp_rule_add_array(filter.get(), action, number, all.size(), all.data());
  return error == -EDOM ? 0 : error;  // likewise
}

/// Everything that is allowed; 0, or an error number below 0.
int fill(const Filter& filter) {
  int error = 0;
  const auto add = [&](std::uint32_t action, const char* name, auto... conditions) {
    if (error == 0) error = allow(filter, action, name, conditions...);
  };
  for (const char* name : kAllowed) add(SCMP_ACT_ALLOW, name);
  // Commands have 32 bits, whatever stands above them. Not TIOCSTI, which types into the terminal of who started this.
  for (const scmp_datum_t type : {kSockets, kGpioLines})
    add(SCMP_ACT_ALLOW, "ioctl", scmp_arg_cmp{1, SCMP_CMP_MASKED_EQ, 0xFF00, type << 8U});
  for (const scmp_datum_t command : kTerminal)
    add(SCMP_ACT_ALLOW, "ioctl", scmp_arg_cmp{1, SCMP_CMP_MASKED_EQ, 0xFFFFFFFF, command});
  // Its flags are behind a pointer, which a filter cannot read; the C library asks clone for it then.
  add(SCMP_ACT_ERRNO(ENOSYS), "clone3");
  add(SCMP_ACT_ALLOW, "clone", scmp_arg_cmp{0, SCMP_CMP_MASKED_EQ, CLONE_THREAD, CLONE_THREAD});
  for (const char* name : {"mmap", "mmap2", "mprotect"})
    add(SCMP_ACT_ALLOW, name, scmp_arg_cmp{2, SCMP_CMP_MASKED_EQ, PROT_EXEC, 0});
  for (const int family : {AF_UNIX, AF_INET, AF_INET6, AF_CAN})
    add(SCMP_ACT_ALLOW, "socket", scmp_arg_cmp{0, SCMP_CMP_EQ, static_cast<scmp_datum_t>(family), 0});
  return error;
}

/// Raised as far as it goes; false: it stays below `enough`.
bool raise(__rlimit_resource resource, rlim_t enough) {
  const rlimit wanted{enough, enough};
  rlimit now{};
  getrlimit(resource, &now);
  return now.rlim_cur >= enough || setrlimit(resource, &wanted) == 0;
}

}  // namespace

std::string drop_capabilities() {
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3> sets{};
  std::uint32_t kept = 1U << CAP_DAC_OVERRIDE | 1U << CAP_CHOWN | 1U << CAP_FOWNER;
  if (!raise(RLIMIT_RTPRIO, 99)) kept |= 1U << CAP_SYS_NICE;
  if (!raise(RLIMIT_MEMLOCK, RLIM_INFINITY)) kept |= 1U << CAP_IPC_LOCK;
  if (syscall(SYS_capget, &header, sets.data()) == 0) {
    kept &= sets[0].permitted;
    sets = {};
    sets[0].effective = sets[0].permitted = kept;
    if (syscall(SYS_capset, &header, sets.data()) == 0 && prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0)
      return {};
  }
  return std::string("capabilities: ") + std::strerror(errno);
}

std::string confine() {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return {};  // the search for leaks at the end traces its own process
#endif
  const Filter filter(seccomp_init(SCMP_ACT_ERRNO(EPERM)), &seccomp_release);
  int error = filter ? 0 : -ENOMEM;
  if (error == 0) error = seccomp_attr_set(filter.get(), SCMP_FLTATR_CTL_TSYNC, 1);
  if (error == 0) error = seccomp_attr_set(filter.get(), SCMP_FLTATR_CTL_OPTIMIZE, 2);
  if (error == 0) error = fill(filter);
  if (error == 0) error = seccomp_load(filter.get());
  return error == 0 ? std::string() : std::string("filter of system calls: ") + std::strerror(-error);
}

}  // namespace roborun::rt
