// Our reader against OctoMap's own library: what it wrote is read back equal, and nothing damaged is
// believed.
#include "platform/sitl/world/octomap_file.hpp"

#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include <memory>
#include <sstream>
#include <string>

#include "core/random/counter_rng.hpp"
#include "platform/input/input_error.hpp"
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
      damaged[static_cast<std::size_t>(rng.below(damaged.size()))] = static_cast<char>(rng.below(256));
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

OctomapLeaves leaves_of(octomap::OcTree& tree) {
  const std::string bytes = bytes_of(tree, false);
  return read_octomap({reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()}, false, "memory");
}

TEST_P(OctomapFile, TheLibraryReadsBackWhatWeWrite) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    octomap::OcTree tree = random_tree(seed);
    OctomapLeaves map = leaves_of(tree);
    ASSERT_GT(map.leaves.size(), 100U);
    map.prune();
    std::stringstream stream(write_octomap(map, GetParam()));
    octomap::OcTree copy(1.0);
    std::unique_ptr<octomap::AbstractOcTree> read;
    if (GetParam()) {
      read.reset(octomap::AbstractOcTree::read(stream));
    } else if (copy.readBinary(stream)) {
      read = std::make_unique<octomap::OcTree>(copy);
    }
    auto* back = dynamic_cast<octomap::OcTree*>(read.get());
    ASSERT_NE(back, nullptr);
    EXPECT_EQ(back->getResolution(), 0.25);
    EXPECT_EQ(back->size(), back->calcNumNodes()) << "the size in the header";
    std::size_t known = 0;
    for (double x = -9.125; x < 9.0; x += 0.25) {
      for (double y = -7.125; y < 7.0; y += 0.25) {
        for (double z = -0.125; z < 6.0; z += 0.25) {
          const auto* a = tree.search(x, y, z);
          const auto* b = back->search(x, y, z);
          ASSERT_EQ(a == nullptr, b == nullptr) << x << " " << y << " " << z;
          if (a == nullptr) continue;
          ++known;
          ASSERT_EQ(tree.isNodeOccupied(a), back->isNodeOccupied(b)) << x << " " << y << " " << z;
        }
      }
    }
    EXPECT_GT(known, 1000U);
    EXPECT_TRUE(diff(map, leaves_of(*back)).equal());
  }
}

TEST(OctomapLeaves, MortonAndCellAreInverse) {
  core::CounterRng rng(4);
  for (int i = 0; i < 1000; ++i) {
    const std::array<std::int32_t, 3> cell{static_cast<std::int32_t>(rng.below(65536)),
                                           static_cast<std::int32_t>(rng.below(65536)),
                                           static_cast<std::int32_t>(rng.below(65536))};
    ASSERT_EQ(octomap_cell(octomap_morton(cell)), cell);
  }
  EXPECT_EQ(octomap_morton({1, 0, 0}), 1U);
  EXPECT_EQ(octomap_morton({0, 0, 65535}), 0x924924924924U);
}

TEST(OctomapLeaves, PruneMergesEightEqualSiblingsOnly) {
  OctomapLeaves map{0.1, {}};
  for (std::uint64_t i = 0; i < 64; ++i) map.leaves.push_back({i, 1, i != 9});
  map.prune();
  // Seven of the eight parents are whole; the second keeps its cells.
  EXPECT_EQ(map.leaves.size(), 7U + 8U);
  map = {0.1, {}};
  for (std::uint64_t i = 0; i < 64; ++i) map.leaves.push_back({i, 1, true});
  map.prune();
  ASSERT_EQ(map.leaves.size(), 1U);
  EXPECT_EQ(map.leaves[0].size, 4);
}

TEST(OctomapLeaves, DiffCountsCellsWhateverTheLeaves) {
  const OctomapLeaves whole{0.1, {{0, 2, false}}};
  const OctomapLeaves parts{0.1, {{0, 1, false}, {1, 1, true}, {8, 1, true}}};
  const OctomapDifference d = diff(whole, parts);
  EXPECT_EQ(d.same, 1U);
  EXPECT_EQ(d.free_to_occupied, 1U);
  EXPECT_EQ(d.occupied_to_free, 0U);
  EXPECT_EQ(d.only_first, 6U);
  EXPECT_EQ(d.only_second, 1U);
  EXPECT_FALSE(d.equal());
  EXPECT_TRUE(diff(parts, parts).equal());
  EXPECT_EQ(diff(parts, whole).occupied_to_free, 1U);
}

TEST_P(OctomapFile, AnEqualMapHasNoDifference) {
  octomap::OcTree tree = random_tree(3);
  const std::string bytes = bytes_of(tree, GetParam());
  const OctomapLeaves map = read_octomap({reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()},
                                         GetParam(), "memory");
  EXPECT_TRUE(diff(map, leaves_of(tree)).equal());
  const Aabb box = map.bounds_W();
  double x = 0, y = 0, z = 0;
  tree.getMetricMin(x, y, z);
  EXPECT_NEAR((box.min_W - Vector3(x, y, z)).norm(), 0.0, 1e-9);
  tree.getMetricMax(x, y, z);
  EXPECT_NEAR((box.max_W - Vector3(x, y, z)).norm(), 0.0, 1e-9);
}

INSTANTIATE_TEST_SUITE_P(BothFormats, OctomapFile, testing::Bool(),
                         [](const auto& format) { return format.param ? "Ot" : "Bt"; });

}  // namespace
}  // namespace roborun::sitl
