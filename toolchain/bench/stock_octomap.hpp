/// Stock OctoMap as its documentation uses it: the peer that the benchmark measures against.
#pragma once

#include <octomap/octomap.h>

#include <memory>

#include "toolchain/bench/map_scans.hpp"

namespace roborun::bench {

enum class StockMode { kPlain, kLazy, kDiscretised, kBoth };
[[nodiscard]] const char* to_string(StockMode mode);

/// A scan as stock insertion wants it: the images' end points in the world frame.
struct StockScan {
  octomap::Pointcloud cloud;
  octomap::point3d origin;
  double range_m{};
};
[[nodiscard]] StockScan stock_scan(const Scan& scan, double cell_m);
/// insertPointCloud() and nothing else: lazily inserted trees are left without updateInnerOccupancy().
void insert(octomap::OcTree& tree, const StockScan& scan, StockMode mode);

/// How two maps of the same scan agree, counted in cells of the tree with pruned leaves expanded.
struct Agreement {
  double occupied_ratio{};        ///< Of stock's occupied cells: ours, or a face neighbour, is occupied.
  double free_ratio{};            ///< Of stock's free cells: ours is free.
  std::size_t own_false_free{};   ///< Solid cells (by their centre) that ours calls free ...
  std::size_t stock_false_free{};  ///< ... and that stock calls free, in the same space.
  std::size_t stock_occupied{}, stock_free{}, own_free{};
};
/// `view` at level 0. Space within `reach_m` of the scan is compared.
[[nodiscard]] Agreement compare(const octomap::OcTree& tree, const stages::MapView& view, const sitl::World& world,
                                const Vector3& center_W, double reach_m);

}  // namespace roborun::bench
