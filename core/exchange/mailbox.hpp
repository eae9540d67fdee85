/// The newest value from one writer to one reader, wait-free. Source: the triple buffer of D. Simpson,
/// "Four-slot fully asynchronous communication mechanism" (1990), in its three-cell form with one atomic
/// exchange.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace roborun::core {

/// Three cells: one belongs to the writer, one to the reader, the third waits between them. Handing over is
/// one atomic exchange, so neither side ever waits, retries, or sees a half-written value; a value that was
/// never taken is overwritten by a newer one. Exactly one writer thread and one reader thread. RT-safe: every
/// call O(1), no allocation, no lock.
template <typename T>
class Mailbox {
 public:
  /// The writer's cell: fill it, then publish(). Its old content is that of an earlier message.
  [[nodiscard]] T& draft() noexcept { return cell_[writer_]; }
  void publish() noexcept {
    writer_ =
        waiting_.exchange(static_cast<std::uint8_t>(writer_ | kFresh), std::memory_order_acq_rel) & kIndex;
  }

  /// True if a newer message than the last one taken is there: read() is it, until the next take().
  [[nodiscard]] bool take() noexcept {
    if ((waiting_.load(std::memory_order_relaxed) & kFresh) == 0) return false;
    reader_ = waiting_.exchange(reader_, std::memory_order_acq_rel) & kIndex;
    return true;
  }
  /// The message last taken; a value-initialised T before the first one.
  [[nodiscard]] const T& read() const noexcept { return cell_[reader_]; }

  /// Before the threads start: gives cell 0 .. 2 what it needs (memory to write into).
  [[nodiscard]] T& cell(std::size_t i) noexcept { return cell_[i]; }

 private:
  static constexpr std::uint8_t kFresh = 4;
  static constexpr std::uint8_t kIndex = 3;
  static constexpr std::size_t kLine = 64;  // of a cache, so that the two sides do not share one

  std::array<T, 3> cell_{};
  alignas(kLine) std::uint8_t writer_{0};
  alignas(kLine) std::uint8_t reader_{1};
  alignas(kLine) std::atomic<std::uint8_t> waiting_{2};
};

}  // namespace roborun::core
