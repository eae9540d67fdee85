/// Numbers of which the least comes out first: a binary heap in memory that somebody else owns.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/memory/arena.hpp"

namespace roborun::core {

class LeastFirst {
 public:
  LeastFirst() noexcept = default;
  LeastFirst(std::size_t count, const char* name, Arena& arena) noexcept
      : slot_(arena.take<std::uint64_t>(count, name)), pool_(&arena.last_pool()) {
    pool_->use(0);
  }
  void clear() noexcept { count_ = 0; }
  [[nodiscard]] bool empty() const noexcept { return count_ == 0; }
  /// False: there is no room for it. RT-safe: O(log count).
  [[nodiscard]] bool push(std::uint64_t value) noexcept {
    if (count_ == slot_.size()) return false;
    slot_[count_++] = value;
    pool_->use(count_);
    std::push_heap(slot_.begin(), end(), kGreater);
    return true;
  }
  /// Precondition: not empty. RT-safe: O(log count).
  std::uint64_t pop() noexcept {
    std::pop_heap(slot_.begin(), end(), kGreater);
    return slot_[--count_];
  }

 private:
  static constexpr auto kGreater = [](std::uint64_t a, std::uint64_t b) noexcept { return a > b; };
  [[nodiscard]] std::span<std::uint64_t>::iterator end() const noexcept {
    return slot_.begin() + static_cast<std::ptrdiff_t>(count_);
  }
  std::span<std::uint64_t> slot_{};
  PoolRecord* pool_{};
  std::size_t count_{0};
};

}  // namespace roborun::core
