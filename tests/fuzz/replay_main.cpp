/// Runs a fuzz target on files: what the fuzzer once found, in every build and with every compiler.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "tests/fuzz/fuzz.hpp"

namespace {

bool replay(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  const std::vector<char> bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (!in) return false;
  (void)std::printf("%s\n", path.filename().c_str());  // the last line tells which one ended the process
  (void)std::fflush(stdout);
  return LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()) == 0;
}

}  // namespace

int main(int argc, char** argv) {
  std::size_t inputs = 0;
  for (int i = 1; i < argc; ++i) {
    for (const auto& entry : std::filesystem::directory_iterator(argv[i])) {
      if (!replay(entry.path())) {
        (void)std::fprintf(stderr, "%s: cannot be read, or not accepted\n", entry.path().c_str());
        return 1;
      }
      ++inputs;
    }
  }
  if (inputs == 0) {
    (void)std::fprintf(stderr, "no input: nothing was checked\n");
    return 1;
  }
  (void)std::printf("%zu inputs\n", inputs);
  return 0;
}
