#include "platform/dataset/map_leaves.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "platform/input/input_error.hpp"

namespace roborun::dataset {
namespace {

constexpr std::int32_t kOrigin = 1 << (sitl::kOctomapDepth - 1);
constexpr std::int32_t kCells = stages::kBlockCells;

void add_cells(const stages::CellBlock& cells, std::uint64_t first, std::vector<sitl::OctomapLeaf>& leaves) {
  for (std::uint64_t morton = 0; morton < std::uint64_t{kCells} * kCells * kCells; ++morton) {
    const std::array<std::int32_t, 3> cell = sitl::octomap_cell(morton);
    const std::size_t row =
        std::size_t{kCells} * static_cast<std::size_t>(cell[2]) + static_cast<std::size_t>(cell[1]);
    const bool free = ((cells.free[row] >> cell[0]) & 1) != 0,
               occupied = ((cells.occupied[row] >> cell[0]) & 1) != 0;
    if (free || occupied) leaves.push_back({first + morton, 1, occupied});
  }
}

}  // namespace

sitl::OctomapLeaves leaves_of(const stages::MapView& view, const Aabb& box_W) {
  const double cell_m = view.finest_m(), block_m = stages::block_m(cell_m);
  std::array<std::int32_t, 3> low{}, high{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    low[i] = static_cast<std::int32_t>(std::floor(std::clamp(box_W.min_W[axis] / block_m, -1e6, 1e6)));
    high[i] = static_cast<std::int32_t>(std::floor(std::clamp(box_W.max_W[axis] / block_m, -1e6, 1e6)));
    if (low[i] < -kOrigin / kCells || high[i] >= kOrigin / kCells)
      throw InputError(
          fmt::format("map from {} to {} m: must be within {} m of the origin in an OctoMap file",
                      box_W.min_W[axis], box_W.max_W[axis], kOrigin * cell_m));
  }
  std::vector<std::pair<std::uint64_t, std::array<std::int32_t, 3>>> blocks;
  for (std::int32_t z = low[2]; z <= high[2]; ++z)
    for (std::int32_t y = low[1]; y <= high[1]; ++y)
      for (std::int32_t x = low[0]; x <= high[0]; ++x)
        blocks.push_back(
            {sitl::octomap_morton({kCells * x + kOrigin, kCells * y + kOrigin, kCells * z + kOrigin}),
             {x, y, z}});
  std::sort(blocks.begin(), blocks.end());
  sitl::OctomapLeaves map{cell_m, {}};
  stages::CellBlock cells;
  std::uint64_t lookups = 0;
  for (const auto& [morton, at] : blocks) {
    switch (view.read(block_m * Vector3(at[0], at[1], at[2]), cell_m, cells, lookups)) {
      case stages::BlockContent::kUnknown:
        break;
      case stages::BlockContent::kFree:
        map.leaves.push_back({morton, kCells, false});
        break;
      case stages::BlockContent::kMixed:
        add_cells(cells, morton, map.leaves);
    }
  }
  map.prune();
  return map;
}

}  // namespace roborun::dataset
