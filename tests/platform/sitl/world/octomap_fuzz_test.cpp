// A million hostile files: refused or believed, never a crash.
#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include <sstream>
#include <string>

#include "core/random/counter_rng.hpp"
#include "platform/input/input_error.hpp"
#include "platform/sitl/world/octomap_file.hpp"

namespace roborun::sitl {
namespace {

std::string bytes_of(octomap::OcTree& tree, bool full) {
  std::stringstream stream;
  if (full) {
    tree.write(stream);
  } else {
    tree.writeBinary(stream);
  }
  return stream.str();
}

class OctomapFuzz : public testing::TestWithParam<bool> {};

/// Damage at random, lengths at random, and bytes of no meaning behind a good header.
TEST_P(OctomapFuzz, SurvivesHalfAMillionHostileFiles) {
  octomap::OcTree tree(0.25);
  core::CounterRng rng(10);
  for (int i = 0; i < 12; ++i)
    tree.updateNode(octomap::point3d(static_cast<float>(rng.uniform(-2, 2)),
                                     static_cast<float>(rng.uniform(-2, 2)), 0.1F),
                    i % 3 == 0);
  const std::string whole = bytes_of(tree, GetParam());
  const std::size_t header = whole.find("data\n") + 5;
  int refused = 0;
  int accepted = 0;
  for (int i = 0; i < 500000; ++i) {
    std::string bytes =
        whole.substr(0, i % 4 == 0 ? static_cast<std::size_t>(rng.below(whole.size() + 1)) : whole.size());
    if (i % 3 == 0) {
      for (std::size_t k = header; k < bytes.size(); ++k) bytes[k] = static_cast<char>(rng.below(256));
    }
    for (std::uint64_t k = rng.below(5); k > 0 && !bytes.empty(); --k)
      bytes[static_cast<std::size_t>(rng.below(bytes.size()))] = static_cast<char>(rng.below(256));
    try {
      const OctomapLeaves map = read_octomap(
          {reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()}, GetParam(), "memory");
      ++accepted;
      ASSERT_LE(map.leaves.size(), 8 * bytes.size());
      for (std::size_t k = 1; k < map.leaves.size(); ++k)
        ASSERT_LE(map.leaves[k - 1].end(), map.leaves[k].morton);
      // What is believed can be written and read again.
      const std::string again = write_octomap(map, true);
      ASSERT_TRUE(diff(map, read_octomap({reinterpret_cast<const unsigned char*>(again.data()), again.size()},
                                         true, "memory"))
                      .equal());
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 100000);
  EXPECT_GT(accepted, 1000);
}

INSTANTIATE_TEST_SUITE_P(BothFormats, OctomapFuzz, testing::Bool(),
                         [](const auto& format) { return format.param ? "Ot" : "Bt"; });

}  // namespace
}  // namespace roborun::sitl
