/// Which points of a growing set are near another one: a uniform grid of linked lists in fixed memory.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "core/geometry/vector.hpp"
#include "core/memory/arena.hpp"

namespace roborun::stages {

/// Points are numbered in the order of insertion. Points outside the box belong to the cells on its border:
/// projection never lengthens a distance, so the bounds on which the search ends hold for them, too. RT-safe:
/// no call allocates; insert() is O(1), reset() O(cells), a search O(points) at worst, in practice the points
/// of a few cells.
class NodeGrid {
 public:
  struct Near {
    std::int32_t index;
    double distance_m;
  };
  static constexpr std::size_t kCells = 4096;
  [[nodiscard]] static constexpr std::size_t arena_bytes(std::size_t max_points) noexcept {
    return max_points * sizeof(Point) + kCells * sizeof(std::int32_t) + 64;
  }
  NodeGrid(std::size_t max_points, core::Arena& arena) noexcept
      : point_(arena.take<Point>(max_points, "planner grid points")),
        point_pool_(arena.last_pool()),
        head_(arena.take<std::int32_t>(kCells, "planner grid cells")),
        head_pool_(arena.last_pool()) {}

  /// Forgets all points. Precondition: a finite box that is not empty.
  void reset(const Aabb& box_W) noexcept;
  /// Precondition: fewer than max_points are held.
  void insert(const Vector3& p_W) noexcept;
  /// Precondition: at least one point. Ties go to whichever is met first, always the same one.
  [[nodiscard]] Near nearest(const Vector3& p_W) const noexcept;
  /// The nearest found.size() points within the radius, nearest first; returns how many.
  [[nodiscard]] std::size_t within(const Vector3& p_W, double radius_m, std::span<Near> found) const noexcept;

 private:
  struct Point {
    Vector3 p_W = Vector3::Zero();
    std::int32_t next{-1};
  };
  using Cell = std::array<std::int32_t, 3>;
  static constexpr std::size_t kFewPoints = 96;  ///< So many are searched faster one after the other.

  [[nodiscard]] Cell cell_of(const Vector3& p_W) const noexcept;
  [[nodiscard]] std::int32_t& head(std::int32_t x, std::int32_t y, std::int32_t z) const noexcept {
    const std::int64_t at = (std::int64_t{z} * size_[1] + y) * size_[0] + x;
    return head_[static_cast<std::size_t>(at)];
  }

  std::span<Point> point_;
  core::PoolRecord& point_pool_;
  std::span<std::int32_t> head_;
  core::PoolRecord& head_pool_;
  std::size_t count_{0};
  Vector3 corner_W_ = Vector3::Zero();
  double side_m_{1.0};
  Cell size_{1, 1, 1};
};

}  // namespace roborun::stages
