/// A flight whose process is killed at a random moment, and what its log is worth then.
#pragma once

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <new>
#include <random>
#include <string>
#include <thread>

#include "platform/board/board_profile.hpp"
#include "platform/mission/logged_end.hpp"
#include "platform/mission/mission.hpp"
#include "platform/mission/replay.hpp"
#include "platform/sitl/world/world_file.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::mission::test {

/// Kills `count` flights of 20 s, each in a process of its own, at moments drawn from the time that a whole one takes. Of each
/// at most the last second is missing in the log, which replays to its end as the same flight.
inline void kill_flights(int count) {
  const sitl::World world = sitl::load_world(std::string(ROBORUN_TEST_DATA) + "/worlds/two_pillars.toml", {});
  MissionConfig config;
  config.flight.costs = board::paper().costs;
  config.flight.model = board::paper().model;
  config.simulator.camera.pixels = 32;
  config.judge.time_limit_s = 20.0;
  config.log = roborun::test::scratch("killed.mcap");

  // Where the flight is, for who kills it: the pages are shared with the child.
  void* const page = mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(page, MAP_FAILED);
  auto* const flown_ns = new (page) std::atomic<std::int64_t>(0);
  config.each_frame = [flown_ns](const FrameRecord& frame) {
    flown_ns->store(frame.now.time_since_epoch().count());
  };

  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  const report::MissionReport whole = fly_mission(world, config, {});
  const std::chrono::duration<double> takes = Clock::now() - begin;
  ASSERT_EQ(whole.log_error, "");
  ASSERT_GT(whole.result.mission_time_s, 15.0);

  std::mt19937 random(24);
  int killed = 0;
  int begun = 0;
  for (int i = 0; i < count; ++i) {
    flown_ns->store(0);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      (void)fly_mission(world, config, {});
      _exit(0);
    }
    const double wait_s = takes.count() * static_cast<double>(random()) / static_cast<double>(random.max());
    std::this_thread::sleep_for(std::chrono::duration<double>(wait_s));
    ASSERT_EQ(kill(child, SIGKILL), 0);
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    killed += WIFSIGNALED(status) ? 1 : 0;
    const double flown_s = 1e-9 * static_cast<double>(flown_ns->load());
    if (flown_s <= 1.0) continue;  // at most the last second: nothing need be there
    ++begun;
    const ReplayResult r = replay_flight(config.log, {});
    EXPECT_TRUE(r.same()) << "killed at " << flown_s << " s: " << (r.difference ? r.difference->what : "");
    EXPECT_GE(r.seconds, flown_s - 1.0) << "killed at " << flown_s << " s, log: " << r.damage;
    EXPECT_GE(end_of(config.log).recorded_s, flown_s - 1.0);
  }
  EXPECT_GE(killed, (count + 1) / 2) << "flights ended before they were killed";
  EXPECT_GE(begun, (count + 1) / 2) << "flights were killed before they began";
  (void)munmap(page, 4096);
}

}  // namespace roborun::mission::test
