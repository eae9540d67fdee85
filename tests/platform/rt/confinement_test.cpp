#include "platform/rt/confinement.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/capability.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <thread>

namespace roborun::rt {
namespace {

/// Each in a process of its own: what is given up stays so. The exit code is the line of the first check that fails.
#define CHECK_OR_EXIT(condition) \
  if (!(condition)) _exit(1 + __LINE__ % 250)

bool runs_memory() {
  void* page = mmap(nullptr, 4096, PROT_READ | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (page != MAP_FAILED) munmap(page, 4096);
  return page != MAP_FAILED;
}
bool starts_a_process() {
  const pid_t pid = fork();
  if (pid == 0) _exit(0);
  if (pid > 0) waitpid(pid, nullptr, 0);
  return pid > 0;
}
bool opens_a_socket(int family, int type) {
  const int file = socket(family, type, 0);
  if (file >= 0) close(file);
  return file >= 0;
}
std::uint64_t effective_capabilities() {
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3> sets{};
  syscall(SYS_capget, &header, sets.data());
  return sets[0].effective | static_cast<std::uint64_t>(sets[1].effective) << 32U;
}

[[noreturn]] void try_what_is_denied() {
  std::atomic<int> step{0};  // of a thread that was there before: the filter is for it, too
  bool other_runs_memory = true;
  std::thread other([&] {
    while (step.load() == 0) std::this_thread::yield();
    other_runs_memory = runs_memory();
  });
  CHECK_OR_EXIT(runs_memory());
  CHECK_OR_EXIT(starts_a_process());
  CHECK_OR_EXIT(opens_a_socket(AF_NETLINK, SOCK_RAW));
  CHECK_OR_EXIT(confine().empty());
  step.store(1);
  other.join();
  CHECK_OR_EXIT(!other_runs_memory);
  CHECK_OR_EXIT(!runs_memory() && errno == EPERM);
  CHECK_OR_EXIT(!starts_a_process() && errno == EPERM);
  CHECK_OR_EXIT(!opens_a_socket(AF_NETLINK, SOCK_RAW) && errno == EPERM);
  char name[] = "/bin/true";
  std::array<char*, 2> arguments{name, nullptr};
  CHECK_OR_EXIT(execv(name, arguments.data()) == -1 && errno == EPERM);
  // With bits above the 32 of a command, too, which the kernel does not look at.
  char typed = 'x';
  for (const unsigned long above : {0UL, 1UL << 32U})
    CHECK_OR_EXIT(syscall(SYS_ioctl, 0, above | TIOCSTI, &typed) == -1 && errno == EPERM);
  CHECK_OR_EXIT(syscall(SYS_ptrace, 0, 0, nullptr, nullptr) == -1 && errno == EPERM);
  CHECK_OR_EXIT(syscall(SYS_unshare, 0) == -1 && errno == EPERM);
  _exit(0);
}

[[noreturn]] void do_what_a_flight_does() {
  CHECK_OR_EXIT(confine().empty());
  int ran = 0;
  std::thread([&] { ran = 1; }).join();
  CHECK_OR_EXIT(ran == 1);
  CHECK_OR_EXIT(opens_a_socket(AF_INET, SOCK_DGRAM) && opens_a_socket(AF_UNIX, SOCK_STREAM));
  int waiting = -1;
  std::array<int, 2> ends{};
  CHECK_OR_EXIT(pipe2(ends.data(), O_CLOEXEC) == 0 && ioctl(ends[0], FIONREAD, &waiting) == 0 &&
                waiting == 0);
  std::FILE* file = std::tmpfile();
  CHECK_OR_EXIT(file != nullptr && std::fputs("log", file) >= 0 && std::fflush(file) == 0 &&
                fsync(fileno(file)) == 0);
  CHECK_OR_EXIT(std::fclose(file) == 0);
  std::free(
      std::malloc(std::size_t{64} << 20U));  // NOLINT(cppcoreguidelines-no-malloc): a mapping of its own
  _exit(0);
}

/// Whether this process may lock all its memory and run at a priority.
bool is_real_time() {
  sched_param fifo{};
  fifo.sched_priority = 60;
  const bool can = sched_setscheduler(0, SCHED_FIFO, &fifo) == 0 && mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  sched_param other{};
  sched_setscheduler(0, SCHED_OTHER, &other);
  munlockall();
  return can;
}

[[noreturn]] void drop() {
  const bool was_real_time = is_real_time();
  CHECK_OR_EXIT(drop_capabilities().empty());
  std::uint64_t may_stay = 0;
  for (const int capability : {CAP_CHOWN, CAP_DAC_OVERRIDE, CAP_FOWNER, CAP_IPC_LOCK, CAP_SYS_NICE})
    may_stay |= std::uint64_t{1} << capability;
  CHECK_OR_EXIT((effective_capabilities() & ~may_stay) == 0);
  CHECK_OR_EXIT(prctl(PR_GET_NO_NEW_PRIVS, 0, 0, 0, 0) == 1);
  CHECK_OR_EXIT(is_real_time() == was_real_time);
  CHECK_OR_EXIT(confine().empty());  // which needs no capability
  _exit(0);
}

class Confinement : public testing::Test {
 protected:
  void SetUp() override {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "nothing is confined in a sanitizer build";
#endif
    if (prctl(PR_GET_SECCOMP, 0, 0, 0, 0) < 0)
      GTEST_SKIP() << "no filter of system calls here, as under qemu-user";
  }
};

TEST_F(Confinement, DeniesInAllThreadsWhatNoFlightNeeds) {
  EXPECT_EXIT(try_what_is_denied(), testing::ExitedWithCode(0), "");
}
TEST_F(Confinement, LeavesWhatAFlightNeeds) {
  EXPECT_EXIT(do_what_a_flight_does(), testing::ExitedWithCode(0), "");
}
TEST_F(Confinement, DropsCapabilitiesAndKeepsRealTime) {
  EXPECT_EXIT(drop(), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace roborun::rt
