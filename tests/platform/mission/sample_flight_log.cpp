// usage: sample_flight_log FILE.mcap SECONDS
#include "tests/platform/mission/sample_flight_log.hpp"

#include <cstdlib>

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  roborun::test::write_sample_log(argv[1], std::strtod(argv[2], nullptr));
  return 0;
}
