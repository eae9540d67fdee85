/// Not a test of ours but of the check: under ThreadSanitizer this program must be reported.
#include <cstdint>
#include <memory>
#include <thread>

#include "tests/core/exchange_twins.hpp"

int main() {
  auto box = std::make_unique<roborun::core::broken::RelaxedMailbox<std::uint64_t>>();
  std::atomic<bool> done{false};
  std::thread writer([&] {
    for (std::uint64_t n = 1; !done.load(std::memory_order_relaxed); ++n) {
      box->draft() = n;
      box->publish();
      std::this_thread::yield();
    }
  });
  std::uint64_t sum = 0;
  for (int got = 0; got < 2000;) {
    if (!box->take()) {
      std::this_thread::yield();
      continue;
    }
    ++got;
    sum += box->read();
  }
  done.store(true, std::memory_order_relaxed);
  writer.join();
  return sum > 0 ? 0 : 1;
}
