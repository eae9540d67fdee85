#include "platform/report/status_screen.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>

namespace roborun::report {
namespace {

/// What comes out of a pseudo terminal, after two rounds of two rows.
TEST(StatusScreen, RewritesItsLinesOnATerminalWithoutColours) {
  const int master = posix_openpt(O_RDWR | O_NOCTTY);
  ASSERT_GE(master, 0);
  ASSERT_EQ(grantpt(master) | unlockpt(master), 0);
  std::FILE* terminal = std::fopen(ptsname(master), "w");
  ASSERT_NE(terminal, nullptr);
  ASSERT_EQ(setenv("TERM", "xterm", 1), 0);
  {
    StatusScreen sut(terminal);
    for (const char* speed : {"1.0 m/s", "2.0 m/s"}) {
      while (!sut.due()) std::this_thread::sleep_for(std::chrono::milliseconds(10));
      sut.show({{"mission", "3 s"}, {"speed", speed}});
      sut.show({{"never", "so soon again"}});
    }
  }
  std::string text;
  while (text.find("\x1b[J") == std::string::npos) {
    std::array<char, 4096> part{};
    const ssize_t n = read(master, part.data(), part.size());
    ASSERT_GT(n, 0);
    text.append(part.data(), static_cast<std::size_t>(n));
  }
  EXPECT_EQ(text,
            "mission    3 s\x1b[K\r\nspeed      1.0 m/s\x1b[K\r\n"
            "\x1b[2Amission    3 s\x1b[K\r\nspeed      2.0 m/s\x1b[K\r\n"
            "\x1b[2A\x1b[J");
  (void)std::fclose(terminal);
  (void)close(master);
}

TEST(StatusScreen, IsSilentForTenSecondsWithoutATerminal) {
  std::FILE* file = std::tmpfile();
  ASSERT_NE(file, nullptr);
  {
    StatusScreen sut(file);
    EXPECT_FALSE(sut.due());
    sut.show({{"mission", "3 s"}});
  }
  EXPECT_EQ(std::ftell(file), 0);
  (void)std::fclose(file);
}

}  // namespace
}  // namespace roborun::report
