#include "platform/rt/heap_seal.hpp"

#include <dlfcn.h>
#include <execinfo.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace roborun::rt {
namespace {

constexpr std::size_t kDepth = 8;
constexpr std::size_t kSites = 32;

struct Site {
  std::atomic<std::uint64_t> count{0};
  std::array<void*, kDepth> stack{};
  int depth{0};
};

std::atomic<HeapSeal> seal_state{HeapSeal::kOpen};
std::atomic<std::uint64_t> calls{0};
std::atomic<std::uint64_t> elsewhere{0};
std::array<Site, kSites> sites;
std::atomic_flag sites_busy = ATOMIC_FLAG_INIT;
thread_local bool watched = false;
thread_local bool inside = false;

/// Frames 0 and 1 are this file's; what follows is the caller, perhaps by way of operator new.
void keep_site(void* const* stack, int depth) noexcept {
  if (sites_busy.test_and_set(std::memory_order_acquire)) {
    elsewhere.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  bool kept = false;
  for (Site& site : sites) {
    if (site.depth == 0) {
      site.depth = depth;
      std::memcpy(site.stack.data(), stack, sizeof(void*) * static_cast<std::size_t>(depth));
    }
    const auto bytes = sizeof(void*) * static_cast<std::size_t>(depth);
    if (site.depth == depth && std::memcmp(site.stack.data(), stack, bytes) == 0) {
      site.count.fetch_add(1, std::memory_order_relaxed);
      kept = true;
      break;
    }
  }
  if (!kept) elsewhere.fetch_add(1, std::memory_order_relaxed);
  sites_busy.clear(std::memory_order_release);
}

[[maybe_unused]] void note() noexcept {
  if (!watched || inside) return;
  const HeapSeal state = seal_state.load(std::memory_order_relaxed);
  if (state == HeapSeal::kOpen) return;
  inside = true;
  calls.fetch_add(1, std::memory_order_relaxed);
  std::array<void*, kDepth> stack{};
  const int depth = backtrace(stack.data(), static_cast<int>(kDepth));
  if (state == HeapSeal::kFatal) {
    constexpr char kLine[] = "roborun: heap call in a real-time lane after start\n";
    (void)!write(STDERR_FILENO, kLine, sizeof kLine - 1);
    backtrace_symbols_fd(stack.data(), depth, STDERR_FILENO);
    std::abort();
  }
  keep_site(stack.data(), depth);
  inside = false;
}

std::string name_of(void* address) {
  Dl_info info{};
  std::array<char, 512> text{};
  if (dladdr(address, &info) == 0 || info.dli_fname == nullptr) {
    std::snprintf(text.data(), text.size(), "%p", address);
  } else if (info.dli_sname != nullptr) {
    std::snprintf(text.data(), text.size(), "%s", info.dli_sname);
  } else {
    const auto offset = static_cast<const char*>(address) - static_cast<const char*>(info.dli_fbase);
    std::snprintf(text.data(), text.size(), "%s+0x%lx", info.dli_fname, static_cast<unsigned long>(offset));
  }
  return text.data();
}

/// The first frame that is neither the interposer nor the C++ library's operator new or delete.
std::string caller_of(const Site& site) {
  for (int i = 0; i < site.depth; ++i) {
    std::string name = name_of(site.stack[static_cast<std::size_t>(i)]);
    const bool ours = name.find("note") != std::string::npos || name == "malloc" || name == "calloc" ||
                      name == "realloc" || name == "free" || name == "aligned_alloc" ||
                      name == "posix_memalign" || name.rfind("_Znw", 0) == 0 || name.rfind("_Zna", 0) == 0 ||
                      name.rfind("_ZdlPv", 0) == 0 || name.rfind("_ZdaPv", 0) == 0 || (i == 0);
    if (!ours) return name;
  }
  return "unknown";
}

}  // namespace

void watch_this_thread(bool on) noexcept { watched = on; }

void seal_heap(HeapSeal seal) noexcept {
  // The first backtrace() loads a library, which allocates: here, not in a lane.
  std::array<void*, kDepth> stack{};
  (void)backtrace(stack.data(), static_cast<int>(kDepth));
  seal_state.store(seal, std::memory_order_release);
}

std::uint64_t sealed_heap_calls() noexcept { return calls.load(std::memory_order_relaxed); }

std::vector<HeapCallSite> heap_call_sites() {
  std::vector<HeapCallSite> all;
  for (const Site& site : sites) {
    const std::uint64_t count = site.count.load(std::memory_order_relaxed);
    if (count > 0) all.push_back({caller_of(site), count});
  }
  if (const std::uint64_t rest = elsewhere.load(std::memory_order_relaxed); rest > 0)
    all.push_back({"elsewhere", rest});
  return all;
}

}  // namespace roborun::rt

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
bool roborun::rt::heap_seal_works() noexcept { return false; }
#else
bool roborun::rt::heap_seal_works() noexcept { return true; }

// The C library's own entry points, under the names that it keeps for interposers.
extern "C" {
void* __libc_malloc(std::size_t size);                           // NOLINT
void* __libc_calloc(std::size_t count, std::size_t size);        // NOLINT
void* __libc_realloc(void* block, std::size_t size);             // NOLINT
void* __libc_memalign(std::size_t alignment, std::size_t size);  // NOLINT
void __libc_free(void* block);                                   // NOLINT

void* malloc(std::size_t size) noexcept {
  roborun::rt::note();
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) noexcept {
  roborun::rt::note();
  return __libc_calloc(count, size);
}
void* realloc(void* block, std::size_t size) noexcept {
  roborun::rt::note();
  return __libc_realloc(block, size);
}
void free(void* block) noexcept {
  if (block != nullptr) roborun::rt::note();
  __libc_free(block);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  roborun::rt::note();
  return __libc_memalign(alignment, size);
}
void* memalign(std::size_t alignment, std::size_t size) noexcept {
  roborun::rt::note();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** block, std::size_t alignment, std::size_t size) noexcept {
  roborun::rt::note();
  if (alignment % sizeof(void*) != 0 || (alignment & (alignment - 1)) != 0) return EINVAL;
  void* got = __libc_memalign(alignment, size);
  if (got == nullptr) return ENOMEM;
  *block = got;
  return 0;
}
}
#endif
