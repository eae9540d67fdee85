/// A way through known free space on a lattice: best-first from both ends, on the coarsest lattice that has one. What
/// it finds is not tight: others pull it.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/memory/least_first.hpp"
#include "core/precision.hpp"
#include "stages/planning/planner.hpp"

namespace roborun::stages {

/// Nodes lie a step apart, where a box of the vehicle's radius touches as few cells as it can. A node is free if that box is, or,
/// with steps of one and two cells, if the three boxes are that hold the ball (as in WayShape); moves go along the axes: the boxes
/// at their two ends cover what the ball sweeps. (Where all corners of a diagonal move are free, moves along axes lead there, too.) A
/// coarse lattice misses what is narrow; the last one is that of the finest cells, and complete for these shapes but for its memory:
/// where that is too little, within a window around the start.
/// Source: Pohl, "Bi-directional search" (1971), and for the weight "Heuristic search viewed as path finding" (1970).
class LatticeSearch {
 public:
  [[nodiscard]] static constexpr std::size_t arena_bytes(std::size_t max_nodes) noexcept {
    return max_nodes * (sizeof(std::uint32_t) + sizeof(std::uint8_t)) + 2 * kHeap * sizeof(std::uint64_t) +
           256;
  }
  /// A lattice with more nodes than that is not searched. [4096, 2^22]
  LatticeSearch(std::size_t max_nodes, core::Arena& arena) noexcept;

  /// From start to goal, around both of which known space is free, within the horizon: kOk with the way; kNoPath: the
  /// finest lattice that fits has none; kBudgetSpent: of time or memory.
  [[nodiscard]] Status connect(const PlanRequest& request, const MapView& view, core::StageBudget& budget,
                               core::Work& work, Path& path_W) noexcept;

 private:
  static constexpr std::size_t kHeap = 1U << 18U;
  static constexpr std::array<int, 6> kSteps{12, 8, 6, 4, 2, 1};  ///< Finest cells.
  struct Cell {
    std::int32_t x, y, z;
  };
  struct Task {
    const PlanRequest& request;
    const MapView& view;
    core::StageBudget& budget;
    core::Work& work;
  };
  /// One of the two ends: what it has opened and not yet closed, least promise first.
  struct Side {
    core::LeastFirst opened{};
    Vector3 from_W = Vector3::Zero(), to_W = Vector3::Zero();
  };

  /// False if the lattice of this step does not fit.
  [[nodiscard]] bool lay_out(const PlanRequest& request, double finest_m, int cells) noexcept;
  /// False if the nodes within `reach_m` of the start are too many, or none.
  [[nodiscard]] bool fit(const PlanRequest& request, double finest_m, double reach_m) noexcept;
  void seed(const Task& task, int side) noexcept;
  [[nodiscard]] Status run(const Task& task) noexcept;
  [[nodiscard]] bool is_free(const Task& task, const Vector3& p_W) const noexcept;
  /// Closes the most promising node of a side; true if it met the other one.
  [[nodiscard]] bool step(const Task& task, int side) noexcept;
  void push(int side, std::uint32_t index, std::uint32_t cost, std::uint8_t move) noexcept;
  void extract(const Task& task, Path& path_W) noexcept;
  /// So many moves back towards its end.
  [[nodiscard]] std::uint32_t before(std::uint32_t index, int moves) const noexcept;
  /// From a closed node back to its end: the nodes on the way, greedily straightened.
  [[nodiscard]] bool walk_back(const Task& task, std::uint32_t at, int side, Path& path_W) const noexcept;
  [[nodiscard]] bool inside(const Cell& c) const noexcept {
    return c.x >= 0 && c.y >= 0 && c.z >= 0 && c.x < size_.x && c.y < size_.y && c.z < size_.z;
  }
  [[nodiscard]] std::uint32_t index_of(const Cell& c) const noexcept {
    return static_cast<std::uint32_t>((c.z * size_.y + c.y) * size_.x + c.x);
  }
  [[nodiscard]] Cell cell_of(std::uint32_t index) const noexcept {
    const auto i = static_cast<std::int32_t>(index);
    return {i % size_.x, (i / size_.x) % size_.y, i / (size_.x * size_.y)};
  }
  [[nodiscard]] Vector3 at_W(std::uint32_t index) const noexcept {
    const Cell c = cell_of(index);
    return corner_W_ + step_m_ * Vector3(c.x, c.y, c.z);
  }

  std::span<std::uint8_t> state_;
  core::PoolRecord& state_pool_;
  std::span<std::uint32_t> cost_;  ///< Millimetres from its end, of closed nodes.
  core::PoolRecord& cost_pool_;
  std::array<Side, 2> side_{};
  Vector3 corner_W_ = Vector3::Zero();
  double step_m_{};
  Cell size_{1, 1, 1};
  std::array<std::uint32_t, 2> met_{};  ///< Neighbours, one closed by each side.
  bool overflown_{false};
};

}  // namespace roborun::stages
