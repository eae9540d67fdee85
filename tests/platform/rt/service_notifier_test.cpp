#include "platform/rt/service_notifier.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <string>

#include "tests/support/scratch.hpp"

namespace roborun::rt {
namespace {

TEST(ServiceNotifier, TellsTheSocketThatTheServiceManagerNamed) {
  const std::string path = test::scratch("notify");
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  ASSERT_LT(path.size(), sizeof(address.sun_path));
  std::memcpy(address.sun_path, path.data(), path.size());
  const int manager = socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0);
  ASSERT_EQ(bind(manager, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  ASSERT_EQ(setenv("NOTIFY_SOCKET", path.c_str(), 1), 0);
  {
    ServiceNotifier sut;
    EXPECT_TRUE(sut.tell("READY=1"));
    EXPECT_TRUE(sut.tell("WATCHDOG=1"));
  }
  char got[32]{};
  ASSERT_EQ(recv(manager, got, sizeof(got), 0), 7);
  EXPECT_STREQ(got, "READY=1");
  ASSERT_EQ(recv(manager, got, sizeof(got), 0), 10);
  EXPECT_STREQ(got, "WATCHDOG=1");
  (void)close(manager);
  (void)unsetenv("NOTIFY_SOCKET");
}

TEST(ServiceNotifier, IsSilentWithoutAServiceManager) {
  (void)unsetenv("NOTIFY_SOCKET");
  EXPECT_FALSE(ServiceNotifier().tell("READY=1"));
  (void)setenv("NOTIFY_SOCKET", "/nonexistent/notify", 1);
  EXPECT_FALSE(ServiceNotifier().tell("READY=1"));
  (void)unsetenv("NOTIFY_SOCKET");
}

}  // namespace
}  // namespace roborun::rt
