/// Counts the heap calls of the calling thread while it lives. Linking roborun_test_support replaces operator
/// new.
#pragma once

#include <cstdint>

namespace roborun::test {

/// operator new in all its forms is counted in every build; malloc, calloc and realloc as well where no
/// sanitizer owns them.
class NoAllocScope {
 public:
  NoAllocScope() noexcept;
  ~NoAllocScope();
  NoAllocScope(const NoAllocScope&) = delete;
  NoAllocScope& operator=(const NoAllocScope&) = delete;
  [[nodiscard]] std::uint64_t count() const noexcept;
};

}  // namespace roborun::test
