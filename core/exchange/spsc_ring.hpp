/// Every value from one writer to one reader, in order, wait-free. Source: L. Lamport, "Proving the
/// correctness of multiprocess programs" (1977), with the memory orders of C++11.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace roborun::core {

/// A bounded queue: a full ring refuses, counts, and loses nothing it has accepted. N is a power of two.
/// Exactly one writer thread and one reader thread. RT-safe: every call O(1), no allocation, no lock.
template <typename T, std::size_t N>
class SpscRing {
  static_assert(N >= 2 && (N & (N - 1)) == 0, "N must be a power of two");

 public:
  /// False: full, `value` is dropped and counted.
  bool push(const T& value) noexcept {
    const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
    if (tail - head_.load(std::memory_order_acquire) == N) {
      dropped_.store(dropped_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
      return false;
    }
    cell_[tail % N] = value;
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }
  /// False: empty, `value` is untouched.
  [[nodiscard]] bool pop(T& value) noexcept {
    const std::uint64_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_.load(std::memory_order_acquire)) return false;
    value = cell_[head % N];
    head_.store(head + 1, std::memory_order_release);
    return true;
  }
  /// Values refused so far; never decreases. Any thread.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

 private:
  static constexpr std::size_t kLine = 64;

  std::array<T, N> cell_{};
  alignas(kLine) std::atomic<std::uint64_t> tail_{0};
  std::atomic<std::uint64_t> dropped_{0};
  alignas(kLine) std::atomic<std::uint64_t> head_{0};
};

}  // namespace roborun::core
