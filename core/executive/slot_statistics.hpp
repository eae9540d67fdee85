/// How long something took, over a whole run, in fixed memory.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "core/executive/stage_budget.hpp"
#include "firmware_if/time.hpp"

namespace roborun::core {

/// Counts durations in buckets whose width is at most 1/64 of their value; exact below 64 ns, 18 minutes and
/// more share the last one. RT-safe: add() is O(1).
class DurationHistogram {
 public:
  void add(Nanos duration) noexcept;
  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  [[nodiscard]] Nanos min() const noexcept { return count_ == 0 ? Nanos{0} : min_; }
  [[nodiscard]] Nanos max() const noexcept { return max_; }
  /// The smallest duration that at least this share of all does not exceed: the upper end of its bucket,
  /// never beyond max(). 0 if empty; `ratio` is clamped to [0, 1], NaN reads as 1.
  [[nodiscard]] Nanos quantile(double ratio) const noexcept;

  static constexpr std::size_t kSub = 64;
  static constexpr std::size_t kBuckets = kSub * 35;
  /// How many durations lie in a bucket, and the longest that lies in it. Precondition: bucket < kBuckets.
  [[nodiscard]] std::uint32_t in_bucket(std::size_t bucket) const noexcept { return bucket_[bucket]; }
  [[nodiscard]] static std::uint64_t upper_end_ns(std::size_t bucket) noexcept;

 private:
  [[nodiscard]] static std::size_t bucket_of(std::uint64_t ns) noexcept;

  std::array<std::uint32_t, kBuckets> bucket_{};
  std::uint64_t count_{0};
  Nanos min_{std::numeric_limits<std::int64_t>::max()};
  Nanos max_{0};
};

/// The largest duration of each block of a run, for extreme-value statistics. When the table is full, blocks
/// are merged in pairs and twice as long from then on. RT-safe: add() is O(1), every 512 blocks O(512).
class BlockMaxima {
 public:
  static constexpr std::size_t kMost = 1024;
  static constexpr std::uint32_t kFirstBlock = 16;
  void add(Nanos duration) noexcept;
  [[nodiscard]] std::size_t count() const noexcept { return count_; }  ///< Complete blocks.
  [[nodiscard]] Nanos operator[](std::size_t i) const noexcept { return maximum_[i]; }
  [[nodiscard]] std::uint32_t block_length() const noexcept { return block_length_; }

 private:
  std::array<Nanos, kMost> maximum_{};
  std::size_t count_{0};
  std::uint32_t block_length_{kFirstBlock};
  std::uint32_t in_block_{0};
  Nanos running_{0};
};

/// What was going on in the frame that took longest.
struct Cause {
  std::uint64_t frame{};
  MonotonicTime at{};
  Work work{};
};

struct SlotStatistics {
  DurationHistogram time{};
  BlockMaxima maxima{};
  Nanos budget{};            ///< Of the frame with the least margin.
  double margin_ratio{1.0};  ///< Least (budget - time) / budget; negative after an overrun.
  Cause longest{};
  /// Never decrease.
  std::uint64_t overruns{0}, reactions{0}, skipped{0};
};

struct LaneStatistics {
  DurationHistogram jitter{};    ///< From release to wake-up.
  DurationHistogram overhead{};  ///< Of a frame, all that no stage used.
  DurationHistogram response{};  ///< From release to the end of the frame.
  /// Never decrease. slips: releases of the lane's grid that had no frame because the one before ran into
  /// them.
  std::uint64_t frames{0}, slips{0}, deadline_misses{0};
};

}  // namespace roborun::core
