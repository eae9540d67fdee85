/// The autopilot's clock on ours, by TIMESYNC. Source: MAVLink developer guide, "Time synchronization".
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "firmware_if/time.hpp"

namespace roborun::firmware_if::mavlink {

/// offset = answer's time - (question + now) / 2, wrong by half of the round trip at most; of the newest kWindow good samples the one
/// with the shortest round trip counts. A sample that cannot be true beside it proves that a clock stood still, ran at another speed or
/// was set: what is older counts no more. RT-safe: O(kWindow), no allocation.
class ClockMatch {
 public:
  static constexpr std::size_t kWindow = 16;
  static constexpr std::size_t kLeast = 5;  ///< Samples before it is believed.
  static constexpr std::int64_t kMostTrip_ns = 10'000'000;
  static constexpr std::int64_t kGoodTrip_ns = 1'000'000;  ///< Shorter ones are never refused.
  static constexpr std::int64_t kDrift_ns =
      2'000'000;  ///< Of two quartz clocks within the window (8 s), and more.
  struct Counters {
    std::uint64_t good{}, foreign{}, slow{}, moved{};  ///< Never decrease.
  };

  /// When the next question is due.
  [[nodiscard]] bool due(MonotonicTime now) const noexcept {
    return now - asked_at_ >= (count_ - oldest_ < kWindow ? Nanos{100'000'000} : Nanos{500'000'000});
  }
  /// The time stamp of a question that leaves now: autopilots answer to nobody, so an answer is known by it.
  [[nodiscard]] std::int64_t question(MonotonicTime now) noexcept {
    asked_at_ = now;
    next_ = (next_ + 1) % asked_.size();
    asked_[next_] = now.time_since_epoch().count();
    return asked_[next_];
  }
  /// False: not an answer to us, or one that took too long.
  bool answer(MonotonicTime now, std::int64_t theirs_ns, std::int64_t asked_ns) noexcept {
    auto* const own = std::find(asked_.begin(), asked_.end(), asked_ns);
    if (own == asked_.end() || asked_ns == 0) {
      ++counters_.foreign;
      return false;
    }
    *own = 0;  // one answer each: a second one is not the autopilot's
    const std::int64_t trip_ns = now.time_since_epoch().count() - asked_ns;
    const std::int64_t limit_ns =
        count_ == 0 ? kMostTrip_ns : std::min(kMostTrip_ns, std::max(kGoodTrip_ns, 3 * best().trip_ns));
    // Nobody's clock is 250 years from ours: the sum below cannot overflow.
    constexpr std::int64_t kFar_ns = std::int64_t{1} << 61U;
    if (trip_ns < 0 || trip_ns > kMostTrip_ns || theirs_ns <= 0 || theirs_ns > kFar_ns) {
      ++counters_.slow;
      return false;
    }
    const Sample sample{theirs_ns - (asked_ns + trip_ns / 2), trip_ns};
    const bool moved = matched() && std::abs(sample.offset_ns - best().offset_ns) >
                                        (trip_ns + best().trip_ns) / 2 + kDrift_ns;
    if (!moved && trip_ns > limit_ns) {
      ++counters_.slow;
      return false;
    }
    if (moved) {
      ++counters_.moved;
      oldest_ = count_;
    }
    sample_[count_ % kWindow] = sample;
    ++count_;
    ++counters_.good;
    return true;
  }
  [[nodiscard]] bool matched() const noexcept { return count_ >= kLeast; }
  /// Precondition: matched().
  [[nodiscard]] MonotonicTime ours(std::int64_t theirs_ns) const noexcept {
    return MonotonicTime{Nanos{theirs_ns - best().offset_ns}};
  }
  [[nodiscard]] std::int64_t theirs_ns(MonotonicTime now) const noexcept {
    return now.time_since_epoch().count() + (matched() ? best().offset_ns : 0);
  }
  /// ours() is wrong by this at most. Precondition: matched().
  [[nodiscard]] Nanos uncertainty() const noexcept { return Nanos{best().trip_ns / 2}; }
  /// The autopilot restarted.
  void forget() noexcept {
    count_ = oldest_ = 0;
    asked_ = {};
  }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  struct Sample {
    std::int64_t offset_ns{}, trip_ns{};
  };
  [[nodiscard]] const Sample& best() const noexcept {
    const std::size_t used = std::min(count_ - oldest_, kWindow);
    std::size_t found = (count_ - 1) % kWindow;
    for (std::size_t i = 1; i < used; ++i) {
      const std::size_t at = (count_ - 1 - i) % kWindow;
      if (sample_[at].trip_ns < sample_[found].trip_ns) found = at;
    }
    return sample_[found];
  }

  std::array<std::int64_t, 4> asked_{};
  std::size_t next_{0};
  MonotonicTime asked_at_{Nanos{-1'000'000'000}};
  std::array<Sample, kWindow> sample_{};
  std::size_t count_{0};
  std::size_t oldest_{0};  ///< Count of the first sample that may still be true.
  Counters counters_{};
};

}  // namespace roborun::firmware_if::mavlink
