/// Settings files. Oracle: what is accepted once is accepted again, and all numbers of a flight are finite.
#include <cmath>

#include "platform/mission/settings_file.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace roborun;
  const std::string path = fuzz::file("settings.toml", {data, size});
  fuzz::refuse_or([&] {
    mission::MissionConfig first, second;
    mission::load_settings(path, first);
    mission::load_settings(path, second);
    fuzz::require(std::isfinite(first.judge.time_limit_s) && first.judge.time_limit_s > 0.0,
                  "the time limit is positive");
    fuzz::require(first.judge.time_limit_s == second.judge.time_limit_s, "the same file means the same");
  });
  return 0;
}
