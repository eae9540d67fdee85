/// Counts instructions by stepping a child process one by one.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/ptrace.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>

#include "firmware_if/dronecan/transfer.hpp"

namespace roborun::firmware_if::dronecan {
namespace {

/// Instructions of `work` (and of the two calls around it) in a child that stops itself before and after. -1:
/// not possible here (qemu-user, or ptrace is forbidden).
template <typename Work>
long count_instructions(Work&& work) {
  const pid_t child = fork();
  if (child == 0) {
    if (ptrace(PTRACE_TRACEME, 0, nullptr, nullptr) != 0) _exit(1);
    (void)raise(SIGSTOP);
    work();
    (void)raise(SIGSTOP);
    _exit(0);
  }
  int status = 0;
  if (waitpid(child, &status, 0) != child || !WIFSTOPPED(status)) return -1;
  long steps = 0;
  for (;;) {
    if (ptrace(PTRACE_SINGLESTEP, child, nullptr, nullptr) != 0) break;
    if (waitpid(child, &status, 0) != child || !WIFSTOPPED(status)) break;
    if (WSTOPSIG(status) == SIGSTOP) {
      (void)ptrace(PTRACE_CONT, child, nullptr, nullptr);
      (void)waitpid(child, &status, 0);
      return steps;
    }
    ++steps;
  }
  (void)kill(child, SIGKILL);
  (void)waitpid(child, &status, 0);
  return -1;
}

TEST(Instructions, OfEncodingARawCommandAreAtMost200) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(__OPTIMIZE__)
  GTEST_SKIP() << "the figure is that of the release build";
#endif
  EscRawCommand command;
  for (std::int16_t i = 1; i <= 4; ++i)
    ASSERT_TRUE(command.cmd.push_back(static_cast<std::int16_t>(1000 * i)));
  std::array<std::uint8_t, kMaxPayload_bytes<EscRawCommand>> payload{};
  const auto encode_once = [&] {
    auto size = encode(command, payload);
    asm volatile("" : : "r"(&size), "r"(payload.data()) : "memory");
  };
  encode_once();
  const long nothing = count_instructions([] { asm volatile("" : : : "memory"); });
  if (nothing < 0) GTEST_SKIP() << "no single-stepping here";
  const long instructions = count_instructions(encode_once) - nothing;
  EXPECT_EQ(payload[0], 1000 & 0xff);
  RecordProperty("instructions", static_cast<int>(instructions));
  EXPECT_GT(instructions, 20);
  EXPECT_LE(instructions, 200);
  std::printf("encoding a RawCommand of four throttles: %ld instructions\n", instructions);
}

}  // namespace
}  // namespace roborun::firmware_if::dronecan
