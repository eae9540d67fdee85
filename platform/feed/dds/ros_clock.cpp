#include "platform/feed/dds/ros_clock.hpp"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <utility>

namespace roborun::feed {

ClockPair clocks_now() {
  const auto read = [](clockid_t clock) {
    timespec t{};
    (void)clock_gettime(clock, &t);
    return std::chrono::seconds(t.tv_sec) + Nanos{t.tv_nsec};
  };
  return {read(CLOCK_REALTIME), read(CLOCK_MONOTONIC)};
}

std::optional<Refused> RosClock::take(std::int32_t sec, std::uint32_t nanosec, const ClockPair& now,
                                      std::int64_t& stamp_ns) {
  const Nanos offset = now.monotonic - now.wall;
  const Nanos before = std::exchange(offset_, offset).value_or(offset);
  if (const Nanos jump = before - offset; jump > kMostJump || jump < -kMostJump) {
    jump_ = jump;
    settled_ = now.monotonic + kSettle;
  }
  if (now.monotonic < settled_)
    return Refused{"clock", fmt::format("the wall clock was set by {:+.3f} s", seconds(jump_))};
  if (nanosec >= 1'000'000'000U)
    return Refused{"stamp", fmt::format("its stamp has {} nanoseconds", nanosec)};
  const Nanos stamp = std::chrono::seconds(sec) + Nanos{nanosec};
  const Nanos age = now.wall - stamp;
  if (age > kMostAge || age < -kMostAhead)
    return Refused{"stamp",
                   fmt::format("its stamp is {:.3f} s {} this machine's clock: must be of the same clock "
                               "(no use_sim_time; other machines synchronised)",
                               seconds(age > Nanos{0} ? age : -age), age > Nanos{0} ? "behind" : "ahead of")};
  stamp_ns = std::min(stamp + offset, now.monotonic).count();  // of the future nothing is known
  return std::nullopt;
}

}  // namespace roborun::feed
