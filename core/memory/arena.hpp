/// All memory of the runtime is taken at start from arenas like this one; nothing is given back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <span>
#include <string_view>
#include <type_traits>

#include "core/memory/memory_plan.hpp"

namespace roborun::core {

/// A bump allocator over a block that somebody else owns.
/// take() is for start-up only; the spans live as long as the block. Not thread-safe. O(count) for
/// construction.
class Arena {
 public:
  explicit Arena(std::span<std::byte> block) noexcept : block_(block) {}

  /// `count` value-initialised elements, or an empty span when the block is too small (nothing is taken then,
  /// and exhausted() is true from then on, so that a caller may check once after all its takes).
  /// `name` is the pool's in the memory plan; a literal.
  template <typename T>
  [[nodiscard]] std::span<T> take(std::size_t count, const char* name = "unnamed") noexcept {
    static_assert(std::is_trivially_destructible_v<T>, "an arena never runs destructors");
    void* cursor = block_.data() + used_;
    std::size_t space = block_.size() - used_;
    if (count > space / sizeof(T) || std::align(alignof(T), count * sizeof(T), cursor, space) == nullptr) {
      exhausted_ = true;
      return {};
    }
    T* first = static_cast<T*>(cursor);
    for (std::size_t i = 0; i < count; ++i) ::new (static_cast<void*>(first + i)) T{};
    used_ = block_.size() - space + count * sizeof(T);
    (void)plan_.push_back({name, sizeof(T), count});
    return {first, count};
  }

  [[nodiscard]] std::size_t used_bytes() const noexcept { return used_; }
  [[nodiscard]] bool exhausted() const noexcept { return exhausted_; }
  [[nodiscard]] const MemoryPlan& plan() const noexcept { return plan_; }
  /// The first pool of that name, or null: where tests put their faults.
  [[nodiscard]] PoolRecord* find(std::string_view name) noexcept {
    for (PoolRecord& pool : plan_) {
      if (name == pool.name) return &pool;
    }
    return nullptr;
  }
  /// The pool last taken, for its owner to say how much of it is in use; lives as long as the arena. Nothing
  /// is recorded before the first take and beyond the plan's capacity.
  [[nodiscard]] PoolRecord& last_pool() noexcept {
    return plan_.empty() ? unplanned_ : plan_[plan_.size() - 1];
  }

 private:
  std::span<std::byte> block_;
  std::size_t used_{0};
  bool exhausted_{false};
  MemoryPlan plan_{};
  PoolRecord unplanned_{};
};

}  // namespace roborun::core
