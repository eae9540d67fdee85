/// Scenario files; they name worlds and vehicles, of which this folder has none. Oracle: no more faults than a flight takes.

#include "platform/mission/scenario_file.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace roborun;
  const std::string path = fuzz::file("scenario.toml", {data, size});
  fuzz::refuse_or([&] { (void)mission::is_scenario(path); });
  fuzz::refuse_or([&] {
    const mission::Scenario s = mission::load_scenario(path);
    fuzz::require(s.config.faults.size() <= sitl::FaultLine::kMost, "at most so many faults");
    for (const auto& fault : s.config.faults) fuzz::require(fault.for_s > 0.0, "a fault lasts");
  });
  return 0;
}
