// Our reader of OctoMap files against OctoMap's own on the same hostile files. Ends with one line of JSON.
#include <fcntl.h>
#include <octomap/OcTree.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "core/random/counter_rng.hpp"
#include "platform/sitl/world/octomap_file.hpp"

namespace roborun::bench {
namespace {

double cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// As in octomap_fuzz_test.cpp: damage, truncation, and random bytes behind a good header, of a .bt file.
std::vector<std::string> hostile_files(std::size_t count) {
  octomap::OcTree tree(0.25);
  core::CounterRng rng(10);
  for (int i = 0; i < 400; ++i)
    tree.updateNode(octomap::point3d(static_cast<float>(rng.uniform(-8, 8)), static_cast<float>(rng.uniform(-8, 8)),
                                     static_cast<float>(rng.uniform(0, 5))),
                    i % 3 == 0);
  std::stringstream stream;
  tree.writeBinary(stream);
  const std::string whole = stream.str();
  const std::size_t header = whole.find("data\n") + 5;
  std::vector<std::string> files;
  for (std::size_t i = 0; i < count; ++i) {
    std::string bytes = whole.substr(0, i % 4 == 0 ? rng.below(whole.size() + 1) : whole.size());
    if (i % 3 == 0)
      for (std::size_t k = header; k < bytes.size(); ++k) bytes[k] = static_cast<char>(rng.below(256));
    for (std::uint64_t k = rng.below(5); k > 0 && !bytes.empty(); --k)
      bytes[rng.below(bytes.size())] = static_cast<char>(rng.below(256));
    files.push_back(std::move(bytes));
  }
  return files;
}

struct Tally {
  double cpu_s{};
  std::size_t read{}, accepted{}, crashed{}, hung{};
};

Tally own(const std::vector<std::string>& files) {
  Tally tally;
  const double begin_s = cpu_s();
  for (const std::string& file : files) {
    ++tally.read;
    sitl::OctomapLeaves map;
    const std::span bytes(reinterpret_cast<const unsigned char*>(file.data()), file.size());
    tally.accepted += sitl::try_read_octomap(bytes, false, map).empty() ? 1U : 0U;
  }
  tally.cpu_s = cpu_s() - begin_s;
  return tally;
}

/// In children, because it crashes; each goes on behind the file that killed the one before.
Tally stock(const std::vector<std::string>& files) {
  auto* tally = static_cast<Tally*>(mmap(nullptr, sizeof(Tally), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
  if (tally == MAP_FAILED) std::abort();
  *tally = {};
  while (tally->read < files.size()) {
    const pid_t child = fork();
    if (child < 0) std::abort();
    if (child == 0) {
      const rlimit memory{2UL << 30U, 2UL << 30U};
      (void)setrlimit(RLIMIT_AS, &memory);
      const int silence = open("/dev/null", O_WRONLY);
      (void)dup2(silence, STDERR_FILENO);
      (void)dup2(silence, STDOUT_FILENO);
      while (tally->read < files.size()) {
        const std::string& file = files[tally->read++];
        alarm(10);
        const double begin_s = cpu_s();
        std::istringstream stream(file);
        octomap::OcTree tree(0.1);
        tally->accepted += tree.readBinary(stream) ? 1U : 0U;
        tally->cpu_s += cpu_s() - begin_s;
      }
      _exit(0);
    }
    int status = 0;
    (void)waitpid(child, &status, 0);
    if (WIFSIGNALED(status)) ++(WTERMSIG(status) == SIGALRM ? tally->hung : tally->crashed);
  }
  return *tally;
}

}  // namespace
}  // namespace roborun::bench

int main(int argc, char** argv) {
  using namespace roborun::bench;
  const std::size_t count = argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 20000;
  const std::vector<std::string> files = hostile_files(count);
  if (files.empty()) return 2;
  const Tally mine = own(files), theirs = stock(files);
  const auto us = [](const Tally& t) {
    return 1e6 * t.cpu_s / static_cast<double>(std::max<std::size_t>(t.read - t.crashed - t.hung, 1));
  };
  std::printf("{\"files\":%zu,\"own_us\":%.2f,\"octomap_us\":%.2f,\"speedup\":%.1f,\"own_accepted\":%zu,"
              "\"octomap_accepted\":%zu,\"octomap_crashed\":%zu,\"octomap_hung\":%zu}\n",
              files.size(), us(mine), us(theirs), us(theirs) / us(mine), mine.accepted, theirs.accepted, theirs.crashed,
              theirs.hung);
  return 0;
}
