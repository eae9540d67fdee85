/// Not a test of ours but of the check: under ThreadSanitizer this program must be reported, for "mailbox"
/// and for "ring".
#include <cstdint>
#include <memory>
#include <string_view>
#include <thread>

#include "tests/core/exchange_twins.hpp"

namespace {

using namespace roborun::core::broken;

/// `give(n)` in one thread, `take()` (0: nothing there) in the other, until 2,000 were taken.
template <typename Give, typename Take>
int race(const Give& give, const Take& take) {
  std::atomic<bool> done{false};
  std::thread writer([&] {
    for (std::uint64_t n = 1; !done.load(std::memory_order_relaxed); ++n) {
      give(n);
      std::this_thread::yield();
    }
  });
  for (int got = 0; got < 2000;) {
    if (take() == 0)
      std::this_thread::yield();
    else
      ++got;
  }
  done.store(true, std::memory_order_relaxed);
  writer.join();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view which = argc == 2 ? argv[1] : "";
  if (which == "mailbox") {
    auto box = std::make_unique<RelaxedMailbox<std::uint64_t>>();
    return race(
        [&](std::uint64_t n) {
          box->draft() = n;
          box->publish();
        },
        [&] { return box->take() ? box->read() : 0; });
  }
  if (which == "ring") {
    auto ring = std::make_unique<RelaxedRing<std::uint64_t, 64>>();
    return race([&](std::uint64_t n) { ring->push(n); },
                [&] {
                  std::uint64_t n = 0;
                  return ring->pop(n) ? n : 0;
                });
  }
  return 2;
}
