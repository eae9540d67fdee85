// Our reader against OctoMap's own library: what it wrote is read back equal, and nothing damaged is
// believed.
#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include <sstream>
#include <string>

#include "core/random/counter_rng.hpp"
#include "platform/sitl/world/input_error.hpp"
#include "platform/sitl/world/world_file.hpp"

namespace roborun::sitl {
namespace {

octomap::OcTree random_tree(std::uint64_t seed) {
  octomap::OcTree tree(0.25);
  core::CounterRng rng(seed);
  for (int i = 0; i < 400; ++i) {
    const octomap::point3d p(static_cast<float>(rng.uniform(-8.0, 8.0)),
                             static_cast<float>(rng.uniform(-6.0, 6.0)),
                             static_cast<float>(rng.uniform(0.0, 5.0)));
    tree.updateNode(p, rng.uniform() < 0.5);
  }
  // A solid block, so that pruning makes large leaves.
  for (double x = 0.125; x < 4.0; x += 0.25)
    for (double y = 0.125; y < 4.0; y += 0.25)
      for (double z = 0.125; z < 4.0; z += 0.25)
        tree.updateNode(octomap::point3d(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)),
                        true);
  tree.updateInnerOccupancy();
  tree.prune();
  return tree;
}

std::string bytes_of(octomap::OcTree& tree, bool full) {
  std::stringstream stream;
  if (full) {
    tree.write(stream);
  } else {
    tree.writeBinary(stream);
  }
  return stream.str();
}

VoxelGrid parse(const std::string& bytes, bool full) {
  return parse_octomap({reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()}, full, "memory");
}

class OctomapFile : public testing::TestWithParam<bool> {};

TEST_P(OctomapFile, ReadsWhatTheLibraryWrote) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    octomap::OcTree tree = random_tree(seed);
    const VoxelGrid grid = parse(bytes_of(tree, GetParam()), GetParam());
    EXPECT_EQ(grid.cell_m(), 0.25);
    for (double x = -9.125; x < 9.0; x += 0.25) {
      for (double y = -7.125; y < 7.0; y += 0.25) {
        for (double z = -0.125; z < 6.0; z += 0.25) {
          const auto* node = tree.search(x, y, z);
          const bool occupied = node != nullptr && tree.isNodeOccupied(node);
          ASSERT_EQ(grid.occupied(Vector3(x, y, z)), occupied) << x << " " << y << " " << z;
        }
      }
    }
  }
}

TEST_P(OctomapFile, RefusesEveryTruncation) {
  octomap::OcTree tree = random_tree(1);
  const std::string whole = bytes_of(tree, GetParam());
  for (std::size_t size = 0; size < whole.size(); ++size)
    ASSERT_THROW((void)parse(whole.substr(0, size), GetParam()), InputError) << size;
  EXPECT_THROW((void)parse(whole + "x", GetParam()), InputError) << "bytes after the end";
}

TEST_P(OctomapFile, SurvivesAnyDamage) {
  octomap::OcTree tree = random_tree(2);
  const std::string whole = bytes_of(tree, GetParam());
  core::CounterRng rng(9);
  int refused = 0;
  for (int i = 0; i < 3000; ++i) {
    std::string damaged = whole;
    for (std::uint64_t k = 0; k <= rng.below(4); ++k)
      damaged[rng.below(damaged.size())] = static_cast<char>(rng.below(256));
    try {
      const VoxelGrid grid = parse(damaged, GetParam());
      ASSERT_LE(grid.count()[0], 1 << 16);
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 100);
}

TEST_P(OctomapFile, RefusesATreeThatNeverEnds) {
  const std::string head = GetParam() ? "# Octomap OcTree file\nid OcTree\nsize 1\nres 0.1\ndata\n"
                                      : "# Octomap OcTree binary file\nid OcTree\nsize 1\nres 0.1\ndata\n";
  // Every node claims eight children, for ever.
  std::string bytes = head;
  for (int i = 0; i < 100000; ++i)
    bytes += GetParam() ? std::string("\0\0\0\0\xff", 5) : std::string("\xff\xff", 2);
  EXPECT_THROW((void)parse(bytes, GetParam()), InputError);
  EXPECT_THROW((void)parse(head, GetParam()), InputError) << "empty tree";
}

INSTANTIATE_TEST_SUITE_P(BothFormats, OctomapFile, testing::Bool(),
                         [](const auto& format) { return format.param ? "Ot" : "Bt"; });

}  // namespace
}  // namespace roborun::sitl
