#include "tests/support/no_alloc_scope.hpp"

#include <cstdlib>
#include <new>

namespace {

thread_local bool armed = false;
thread_local std::uint64_t calls = 0;

void note() noexcept {
  if (armed) ++calls;
}

}  // namespace

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
extern "C" {
void* __real_malloc(std::size_t size);                 // NOLINT: names fixed by the linker's --wrap
void* __real_calloc(std::size_t n, std::size_t size);  // NOLINT
void* __real_realloc(void* p, std::size_t size);       // NOLINT
void* __wrap_malloc(std::size_t size) {                // NOLINT
  note();
  return __real_malloc(size);
}
void* __wrap_calloc(std::size_t n, std::size_t size) {  // NOLINT
  note();
  return __real_calloc(n, size);
}
void* __wrap_realloc(void* p, std::size_t size) {  // NOLINT
  note();
  return __real_realloc(p, size);
}
}
#endif

void* operator new(std::size_t size) {
  note();
  if (void* p = std::malloc(size == 0 ? 1 : size)) return p;
  throw std::bad_alloc();
}
void* operator new[](std::size_t size) { return operator new(size); }
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  note();
  return std::malloc(size == 0 ? 1 : size);
}
void* operator new[](std::size_t size, const std::nothrow_t& tag) noexcept { return operator new(size, tag); }
void operator delete(void* p) noexcept { std::free(p); }
void operator delete[](void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
void operator delete[](void* p, std::size_t) noexcept { std::free(p); }

namespace roborun::test {

NoAllocScope::NoAllocScope() noexcept {
  calls = 0;
  armed = true;
}
NoAllocScope::~NoAllocScope() { armed = false; }
std::uint64_t NoAllocScope::count() const noexcept { return calls; }

}  // namespace roborun::test
