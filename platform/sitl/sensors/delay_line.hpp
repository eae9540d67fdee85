/// Measurements on their way from the sensor to whoever reads it.
#pragma once

#include <array>
#include <cstdint>

#include "firmware_if/status.hpp"
#include "firmware_if/time.hpp"

namespace roborun::sitl {

/// A ring of T with arrival times, oldest first. A full ring loses the oldest, as a driver's buffer does.
template <typename T, std::size_t N>
class DelayLine {
 public:
  void push(const T& item, MonotonicTime arrival) noexcept {
    if (tail_ - head_ == N) ++head_;
    ring_[tail_ % N] = {item, arrival};
    ++tail_;
  }
  [[nodiscard]] Status pop(T& item, MonotonicTime now) noexcept {
    if (head_ == tail_ || ring_[head_ % N].arrival > now) return Status::kNotReady;
    item = ring_[head_ % N].item;
    ++head_;
    return Status::kOk;
  }

 private:
  struct Entry {
    T item{};
    MonotonicTime arrival{};
  };
  std::array<Entry, N> ring_{};
  std::size_t head_{0};
  std::size_t tail_{0};
};

}  // namespace roborun::sitl
