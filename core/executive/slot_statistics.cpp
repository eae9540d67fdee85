#include "core/executive/slot_statistics.hpp"

#include <algorithm>
#include <bit>

namespace roborun::core {

std::size_t DurationHistogram::bucket_of(std::uint64_t ns) noexcept {
  if (ns < kSub) return static_cast<std::size_t>(ns);
  const auto shift = static_cast<std::size_t>(std::bit_width(ns)) - 7;
  return std::min((shift + 1) * kSub + static_cast<std::size_t>((ns >> shift) - kSub), kBuckets - 1);
}

std::uint64_t DurationHistogram::upper_end_ns(std::size_t bucket) noexcept {
  if (bucket < kSub) return bucket;
  const std::size_t shift = bucket / kSub - 1;
  return (std::uint64_t{bucket % kSub + kSub + 1} << shift) - 1;
}

void DurationHistogram::add(Nanos duration) noexcept {
  const Nanos d = std::max(duration, Nanos{0});
  ++bucket_[bucket_of(static_cast<std::uint64_t>(d.count()))];
  ++count_;
  min_ = std::min(min_, d);
  max_ = std::max(max_, d);
}

Nanos DurationHistogram::quantile(double ratio) const noexcept {
  if (count_ == 0) return Nanos{0};
  const double share = ratio >= 0.0 ? std::min(ratio, 1.0) : (ratio < 0.0 ? 0.0 : 1.0);
  const double wanted = share * static_cast<double>(count_);
  std::uint64_t below = 0;
  for (std::size_t i = 0; i < kBuckets; ++i) {
    below += bucket_[i];
    if (below > 0 && static_cast<double>(below) >= wanted)
      return std::clamp(Nanos{static_cast<std::int64_t>(upper_end_ns(i))}, min_, max_);
  }
  return max_;
}

void BlockMaxima::add(Nanos duration) noexcept {
  running_ = std::max(running_, duration);
  if (++in_block_ < block_length_) return;
  maximum_[count_++] = running_;
  running_ = Nanos{0};
  in_block_ = 0;
  if (count_ < kMost) return;
  for (std::size_t i = 0; i < kMost / 2; ++i) maximum_[i] = std::max(maximum_[2 * i], maximum_[2 * i + 1]);
  count_ = kMost / 2;
  block_length_ *= 2;
}

}  // namespace roborun::core
