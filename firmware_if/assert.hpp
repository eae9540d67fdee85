/// ROBORUN_ASSERT: for our own bugs, never for data that came from outside. Armed in every build, NDEBUG or not.
#pragma once

#include <atomic>

namespace roborun {

/// What is called, once, before the program ends: the platform's way into its fail-safe. It may print and need
/// not return. It runs on the thread that failed, whatever that thread was doing.
using AssertionHandler = void (*)(const char* condition, const char* file, int line) noexcept;

namespace detail {
inline constinit std::atomic<AssertionHandler> assertion_handler{nullptr};
}  // namespace detail

/// Installs a handler; nullptr takes it away. To be called before the threads start. RT-safe: O(1).
inline void set_assertion_handler(AssertionHandler handler) noexcept {
  detail::assertion_handler.store(handler, std::memory_order_release);
}

/// Calls the handler, if there is one, and ends the program by a trap instruction. A second failure, inside the
/// handler or in another thread, traps at once. No heap, no exception, no I/O of its own.
[[noreturn, gnu::cold, gnu::noinline]] inline void assertion_failed(const char* condition, const char* file,
                                                                    int line) noexcept {
  const AssertionHandler handler = detail::assertion_handler.exchange(nullptr, std::memory_order_acq_rel);
  if (handler != nullptr) handler(condition, file, line);
  __builtin_trap();
}

}  // namespace roborun

/// Ends the program if the condition does not hold. In a constant expression that does not compile. RT-safe:
/// one branch.
#define ROBORUN_ASSERT(condition)                      \
  (static_cast<bool>(condition) ? static_cast<void>(0) \
                                : ::roborun::assertion_failed(#condition, __FILE__, __LINE__))
