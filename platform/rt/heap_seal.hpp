/// The heap closed after start: every later call is counted, and named by who made it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace roborun::rt {

/// A program that links this has its malloc, calloc, realloc, free and aligned_alloc families counted, those
/// made inside shared libraries and by operator new and delete included. Not in sanitizer builds, which own
/// them.
enum class HeapSeal : std::uint8_t {
  kOpen,
  kCount,  ///< Counted and let through.
  kFatal,  ///< One line on standard error, then abort: for tests.
};

/// Only threads that have called this are watched; the others (the audit's own report) are not.
void watch_this_thread(bool on) noexcept;
/// For all watched threads, from now on.
void seal_heap(HeapSeal seal) noexcept;
/// Heap calls of watched threads while sealed; never decreases.
[[nodiscard]] std::uint64_t sealed_heap_calls() noexcept;
/// Where they came from: function or library + offset, and how often; at most 32 call sites, the rest
/// together.
struct HeapCallSite {
  std::string name;
  std::uint64_t count{};
};
[[nodiscard]] std::vector<HeapCallSite> heap_call_sites();
/// False in sanitizer builds: nothing is counted.
[[nodiscard]] bool heap_seal_works() noexcept;

}  // namespace roborun::rt
