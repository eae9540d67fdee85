#include "tests/firmware_if/mavlink/vectors.hpp"

#include <fstream>

namespace roborun::firmware_if::mavlink::test {

const Json& vectors() {
  static const Json kAll = [] {
    std::ifstream in(ROBORUN_TEST_DATA "/mavlink_vectors.json");
    return Json::parse(in);
  }();
  return kAll;
}

}  // namespace roborun::firmware_if::mavlink::test
