#include "toolchain/bench/stock_octomap.hpp"

#include <cmath>

#include "core/precision.hpp"

namespace roborun::bench {
namespace {

using stages::CellState;

template <typename CellFunction>
void for_each_cell(const octomap::OcTree& tree, CellFunction&& on_cell) {
  for (auto it = tree.begin_leafs(), end = tree.end_leafs(); it != end; ++it) {
    const double edge_m = it.getSize();
    const int cells = static_cast<int>(std::lround(edge_m / kPublishedCell_m));
    const Vector3 corner_W(it.getX() - 0.5 * edge_m, it.getY() - 0.5 * edge_m, it.getZ() - 0.5 * edge_m);
    const bool occupied = tree.isNodeOccupied(*it);
    for (int z = 0; z < cells; ++z)
      for (int y = 0; y < cells; ++y)
        for (int x = 0; x < cells; ++x)
          on_cell(corner_W + kPublishedCell_m * Vector3(x + 0.5, y + 0.5, z + 0.5), occupied);
  }
}

bool occupied_near(const stages::MapView& view, const Vector3& p_W) {
  std::uint64_t lookups = 0;
  if (view.at(p_W, lookups) == CellState::kOccupied) return true;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-kPublishedCell_m, kPublishedCell_m}) {
      Vector3 neighbour_W = p_W;
      neighbour_W[axis] += side;
      if (view.at(neighbour_W, lookups) == CellState::kOccupied) return true;
    }
  }
  return false;
}

}  // namespace

const char* to_string(StockMode mode) {
  switch (mode) {
    case StockMode::kPlain:
      return "plain";
    case StockMode::kLazy:
      return "lazy";
    case StockMode::kDiscretised:
      return "discretised";
    case StockMode::kBoth:
      return "both";
  }
  return "unknown";
}

StockScan stock_scan(const Scan& scan, double cell_m) {
  StockScan result;
  for (const Vector3& p_W : scan.points_W(cell_m))
    result.cloud.push_back(static_cast<float>(p_W.x()), static_cast<float>(p_W.y()), static_cast<float>(p_W.z()));
  result.origin = {static_cast<float>(scan.p_WB().x()), static_cast<float>(scan.p_WB().y()),
                   static_cast<float>(scan.p_WB().z())};
  result.range_m = scan.range_m();
  return result;
}

void insert(octomap::OcTree& tree, const StockScan& scan, StockMode mode) {
  const bool lazy = mode == StockMode::kLazy || mode == StockMode::kBoth;
  const bool discretised = mode == StockMode::kDiscretised || mode == StockMode::kBoth;
  tree.insertPointCloud(scan.cloud, scan.origin, scan.range_m, lazy, discretised);
}

Agreement compare(const octomap::OcTree& tree, const stages::MapView& view, const sitl::World& world,
                  const Vector3& center_W, double reach_m) {
  Agreement result;
  std::size_t occupied_found = 0;
  std::size_t free_found = 0;
  std::uint64_t lookups = 0;
  for_each_cell(tree, [&](const Vector3& p_W, bool occupied) {
    if (occupied) {
      ++result.stock_occupied;
      occupied_found += occupied_near(view, p_W) ? 1U : 0U;
    } else {
      ++result.stock_free;
      free_found += view.at(p_W, lookups) == CellState::kFree ? 1U : 0U;
      result.stock_false_free += is_solid(world, p_W) ? 1U : 0U;
    }
  });
  const int reach = static_cast<int>(reach_m / kPublishedCell_m);
  const Vector3 middle_W(0.3 * std::floor(center_W.x() / 0.3) + 0.15, 0.3 * std::floor(center_W.y() / 0.3) + 0.15,
                         0.3 * std::floor(center_W.z() / 0.3) + 0.15);
  for (int z = -reach; z <= reach; ++z) {
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        const Vector3 p_W = middle_W + kPublishedCell_m * Vector3(x, y, z);
        if (view.at(p_W, lookups) != CellState::kFree) continue;
        ++result.own_free;
        result.own_false_free += is_solid(world, p_W) ? 1U : 0U;
      }
    }
  }
  result.occupied_ratio = static_cast<double>(occupied_found) / static_cast<double>(result.stock_occupied);
  result.free_ratio = static_cast<double>(free_found) / static_cast<double>(result.stock_free);
  return result;
}

}  // namespace roborun::bench
