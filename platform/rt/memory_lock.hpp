/// All pages of the process in memory, and kept there.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace roborun::rt {

/// Before any other thread starts: one malloc arena only (another one would lock 64 MiB of address space),
/// and freed memory stays with the process.
void prepare_heap() noexcept;
/// Locks and prefaults what is mapped and what will be. Empty if done, otherwise one line: what is missing,
/// and what would help.
/// Sanitizer builds always refuse: their shadow is larger than any machine.
[[nodiscard]] std::string lock_memory();
/// Gives the pages of these shared libraries back: what the chosen configuration never calls need not stay. A
/// name fits every library whose file name begins with it.
void unlock_libraries(std::span<const char* const> names) noexcept;
void unlock_memory() noexcept;
/// VmLck of the process, 0 if nothing is locked.
[[nodiscard]] std::uint64_t locked_bytes();

}  // namespace roborun::rt
