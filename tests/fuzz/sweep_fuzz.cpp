/// Folders of a sweep: the plan, an empty line, and lines of results, as a stopped run left them. Oracle: a plan that is accepted
/// opens its folder, with no more results than missions.
#include <fstream>

#include "platform/evaluation/sweep_store.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace roborun;
  const std::string all = fuzz::Choices(data, size).text();
  const std::size_t split = all.find("\n\n");
  const std::string folder = test::scratch("sweep");
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  std::ofstream(folder + "/request.json", std::ios::binary) << all.substr(0, split);
  if (split != std::string::npos)
    std::ofstream(folder + "/results.jsonl", std::ios::binary) << all.substr(split + 2);
  fuzz::refuse_or([&] {
    const evaluation::SweepStore store(folder, evaluation::plan_of_folder(folder));
    fuzz::require(store.results().size() <= store.missions().size(), "no more results than missions");
  });
  return 0;
}
