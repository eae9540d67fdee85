/// What memory was taken at start, for what, and how much of it was ever used.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include "core/memory/static_vector.hpp"

namespace roborun::core {

/// One pool of equal elements.
struct PoolRecord {
  const char* name{"unnamed"};
  std::size_t element_bytes{};
  std::size_t count{};
  std::size_t high_water{};  ///< Most elements in use at once; 0 if its owner does not say.
  bool tells_use{};          ///< Its owner says how much is in use.
  /// To be called by the owner whenever its use grows. RT-safe: O(1).
  void use(std::size_t elements) noexcept {
    tells_use = true;
    if (elements > high_water) high_water = elements;
  }
  /// Exhaustion on purpose: from this allocation on (0: the first), so many are refused.
  struct Fault {
    std::uint64_t from{std::numeric_limits<std::uint64_t>::max()};
    std::uint64_t count{0};
  };
  Fault fault{};
  std::uint64_t allocations{0};  ///< Asked for so far, refused ones included.
  /// To be asked by the owner before it hands out an element: true if it is to behave as if there were none.
  /// RT-safe: O(1).
  [[nodiscard]] bool exhausted() noexcept {
    const std::uint64_t n = allocations++;
    return n >= fault.from && n - fault.from < fault.count;
  }
  [[nodiscard]] std::size_t bytes() const noexcept { return element_bytes * count; }
};

/// The pools of an arena in the order in which they were taken. Records never move.
using MemoryPlan = StaticVector<PoolRecord, 96>;

}  // namespace roborun::core
