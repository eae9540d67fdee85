#include "platform/rt/interference.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <set>
#include <string>
#include <thread>

namespace roborun::rt {
namespace {

TEST(InterferenceWatch, NamesEachFigureOnceAndNoneDecreases) {
  InterferenceWatch sut({0, 0, -1});
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  sut.sample();
  std::set<std::string> names;
  bool interrupts = false;
  for (const Disturbance& d : sut.finish()) {
    EXPECT_TRUE(names.insert(d.name).second) << d.name;
    EXPECT_FALSE(d.unit.empty());
    EXPECT_GE(d.total.value_or(0.0), 0.0) << d.name;
    EXPECT_LE(d.worst_second.value_or(0.0), d.total.value_or(0.0)) << d.name;
    interrupts = interrupts || d.name.rfind("cpu 0: interrupt ", 0) == 0;
  }
  for (const char* name : {"cpu 0: stolen by the hypervisor", "cpu 0: in interrupts",
                           "cpu 0: in soft interrupts", "cpu 0: system management interrupts"})
    EXPECT_TRUE(names.count(name) == 1) << name;
  EXPECT_TRUE(interrupts) << "in 50 ms a machine has some";
}

TEST(InterferenceWatch, NamesTheProgramThatTookTheTime) {
  InterferenceWatch sut({});
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    prctl(PR_SET_NAME, "busy_neighbour");
    alarm(30);
    for (volatile bool busy = true; busy;) {
    }
  }
  bool found = false;
  for (int tries = 0; tries < 100 && !found; ++tries) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    for (const Disturbance& d : sut.finish())
      found = found || (d.name == "other program busy_neighbour" && d.total.value_or(0.0) >= 10.0);
  }
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  EXPECT_TRUE(found);
}

}  // namespace
}  // namespace roborun::rt
