/// The shared clock of a bus, as one who follows it knows it.
/// Source: UAVCAN v0 specification, "Time synchronization".
#pragma once

#include <cstdint>
#include <optional>

#include "firmware_if/dronecan/transfer.hpp"

namespace roborun::firmware_if::dronecan {

/// A GlobalTimeSync says when the one before it was sent, on the master's clock; when that one came is known on ours. Of
/// several masters the one with the least node id counts; another one after 2.2 s of silence. RT-safe: O(1), no allocation.
class BusTime {
 public:
  static constexpr Nanos kLongestPeriod{1'100'000'000};
  static constexpr Nanos kSilent{2'200'000'000};

  /// `stamp`: the end of its frame, on our clock.
  void take(const TransferHeader& header, const GlobalTimeSync& sync, MonotonicTime stamp) noexcept {
    const bool other = header.source_node_id != master_;
    if (other && master_ != 0 && header.source_node_id > master_ && stamp - previous_ <= kSilent) return;
    const bool follows = !other && header.transfer_id == (transfer_id_ + 1U) % 32U && stamp > previous_ &&
                         stamp - previous_ <= kLongestPeriod;
    const std::uint64_t usec = sync.previous_transmission_timestamp_usec;
    if (other) offset_.reset();
    if (follows && usec != 0 && usec <= kMostUsec) offset_ = previous_.time_since_epoch() - nanos_of(usec);
    master_ = header.source_node_id;
    transfer_id_ = header.transfer_id;
    previous_ = stamp;
  }
  /// When that was, on our clock. None: 0 ("unknown"), no master, or none for 2.2 s before `now`.
  [[nodiscard]] std::optional<MonotonicTime> local(std::uint64_t usec, MonotonicTime now) const noexcept {
    if (!offset_ || usec == 0 || usec > kMostUsec || now - previous_ > kSilent) return std::nullopt;
    return MonotonicTime{nanos_of(usec) + *offset_};
  }

 private:
  static constexpr std::uint64_t kMostUsec = std::uint64_t{1} << 52U;  ///< 142 years: fits as nanoseconds.
  [[nodiscard]] static constexpr Nanos nanos_of(std::uint64_t usec) noexcept {
    return Nanos{static_cast<std::int64_t>(usec) * 1000};
  }

  std::uint8_t master_{0};  ///< 0: none yet.
  std::uint8_t transfer_id_{0};
  MonotonicTime previous_{};
  std::optional<Nanos> offset_;
};

}  // namespace roborun::firmware_if::dronecan
