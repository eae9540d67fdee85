/// Exchanges that look right and are not: what the tests of the real ones must be able to tell apart.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace roborun::core::broken {

/// Two cells instead of three: the writer returns to the cell that the reader still holds.
template <typename T>
class TwoCellMailbox {
 public:
  [[nodiscard]] T& draft() noexcept { return cell_[writer_]; }
  void publish() noexcept {
    newest_.store(writer_, std::memory_order_release);
    writer_ ^= 1U;
  }
  [[nodiscard]] bool take() noexcept {
    const std::uint8_t newest = newest_.load(std::memory_order_acquire);
    if (newest == kNone || newest == reader_) return false;
    reader_ = newest;
    return true;
  }
  [[nodiscard]] const T& read() const noexcept { return cell_[reader_ == kNone ? 0 : reader_]; }

 private:
  static constexpr std::uint8_t kNone = 9;
  std::array<T, 2> cell_{};
  std::uint8_t writer_{0};
  std::uint8_t reader_{kNone};
  std::atomic<std::uint8_t> newest_{kNone};
};

/// Hands over with relaxed order: the content may arrive after the index. Only ThreadSanitizer and weak
/// machines see it.
template <typename T>
class RelaxedMailbox {
 public:
  [[nodiscard]] T& draft() noexcept { return cell_[writer_]; }
  void publish() noexcept {
    writer_ = waiting_.exchange(static_cast<std::uint8_t>(writer_ | 4U), std::memory_order_relaxed) & 3U;
  }
  [[nodiscard]] bool take() noexcept {
    if ((waiting_.load(std::memory_order_relaxed) & 4U) == 0) return false;
    reader_ = waiting_.exchange(reader_, std::memory_order_relaxed) & 3U;
    return true;
  }
  [[nodiscard]] const T& read() const noexcept { return cell_[reader_]; }

 private:
  std::array<T, 3> cell_{};
  std::uint8_t writer_{0};
  std::uint8_t reader_{1};
  std::atomic<std::uint8_t> waiting_{2};
};

/// The push that tells of a value before it is there, and the pop that gives a cell back before it has read
/// it.
template <typename T, std::size_t N>
class HastyRing {
 public:
  bool push(const T& value) noexcept {
    const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
    if (tail - head_.load(std::memory_order_acquire) == N) return false;
    tail_.store(tail + 1, std::memory_order_release);
    cell_[tail % N] = value;
    return true;
  }
  [[nodiscard]] bool pop(T& value) noexcept {
    const std::uint64_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_.load(std::memory_order_acquire)) return false;
    head_.store(head + 1, std::memory_order_release);
    value = cell_[head % N];
    return true;
  }

 private:
  std::array<T, N> cell_{};
  std::atomic<std::uint64_t> tail_{0};
  std::atomic<std::uint64_t> head_{0};
};

/// Hands over with relaxed order, as RelaxedMailbox.
template <typename T, std::size_t N>
class RelaxedRing {
 public:
  bool push(const T& value) noexcept {
    const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
    if (tail - head_.load(std::memory_order_relaxed) == N) return false;
    cell_[tail % N] = value;
    tail_.store(tail + 1, std::memory_order_relaxed);
    return true;
  }
  [[nodiscard]] bool pop(T& value) noexcept {
    const std::uint64_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_.load(std::memory_order_relaxed)) return false;
    value = cell_[head % N];
    head_.store(head + 1, std::memory_order_relaxed);
    return true;
  }

 private:
  std::array<T, N> cell_{};
  std::atomic<std::uint64_t> tail_{0};
  std::atomic<std::uint64_t> head_{0};
};

}  // namespace roborun::core::broken
