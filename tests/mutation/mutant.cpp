/// Which mutant counts, and which ones were reached. Linked by toolchain/mutation alone.
#include "tests/mutation/mutant.hpp"

#include <cstdio>
#include <cstdlib>

namespace rbm {

Choice::Choice() {
  const char* text = std::getenv("ROBORUN_MUTANT");
  id = text != nullptr ? std::atoi(text) : 0;
}

constexpr int kMost = 20000;
unsigned char state[kMost + 1];
// Tests may run before main().
__attribute__((init_priority(101))) extern const Choice active{};

/// One character per mutant, into the file that $ROBORUN_MUTANT_REACHED names.
__attribute__((destructor)) static void write_reached() {
  const char* path = std::getenv("ROBORUN_MUTANT_REACHED");
  std::FILE* file = path != nullptr ? std::fopen(path, "wb") : nullptr;
  if (file == nullptr) return;
  (void)std::fwrite(state, 1, sizeof state, file);
  (void)std::fclose(file);
}

}  // namespace rbm
