/// OctoMap files: the first byte says whether .bt or .ot. Oracle: leaves in order that do not overlap, no more of them than the
/// bytes justify, and the same map after it was written and read again. As a world, in which a large leaf is filled cell by cell, only small ones.
#include "platform/sitl/world/octomap_file.hpp"
#include "platform/sitl/world/world_file.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace roborun;
  fuzz::Choices choices(data, size);
  const bool full = choices.byte() % 2U == 1;
  const auto bytes = choices.rest();
  sitl::OctomapLeaves map;
  bool is_small = true;
  if (sitl::try_read_octomap(bytes, full, map).empty()) {
    fuzz::require(map.leaves.size() <= 8 * bytes.size(), "memory follows the bytes");
    for (std::size_t i = 1; i < map.leaves.size(); ++i)
      fuzz::require(map.leaves[i - 1].end() <= map.leaves[i].morton, "leaves are in order");
    const std::string again = sitl::write_octomap(map, full);
    const sitl::OctomapLeaves second = sitl::read_octomap(
        {reinterpret_cast<const unsigned char*>(again.data()), again.size()}, full, "memory");
    fuzz::require(sitl::diff(map, second).equal(), "a map is the same behind its file");
    const Vector3 cells = map.bounds_W().size() / map.resolution_m;
    is_small = cells.prod() < 1e7;
    map.prune();
    fuzz::require(sitl::diff(map, second).equal(), "pruning changes no cell");
  }
  if (is_small) fuzz::refuse_or([&] { (void)sitl::parse_octomap(bytes, full, "memory"); });
  return 0;
}
