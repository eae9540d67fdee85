/// A map view made of boxes, for tests of planners: free inside `free_W`, occupied inside `occupied`, unknown
/// elsewhere.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "stages/perception/map_view.hpp"

namespace roborun::test {

class BoxView final : public stages::MapView {
 public:
  Aabb free_W{};
  std::vector<Aabb> occupied;
  std::vector<Aabb> unsure;  ///< What is occupied in them was met once.
  std::vector<Aabb> vague;   ///< Unknown, and a surface is about.

  [[nodiscard]] bool is_free(const Aabb& box_W, std::uint64_t& lookups) const noexcept override {
    ++lookups;
    if (!(box_W.min_W.array() <= box_W.max_W.array()).all() || !free_W.contains(box_W.min_W) ||
        !free_W.contains(box_W.max_W))
      return false;
    for (const std::vector<Aabb>* boxes : {&occupied, &vague}) {
      for (const Aabb& o : *boxes)
        if ((box_W.min_W.array() <= o.max_W.array()).all() && (box_W.max_W.array() >= o.min_W.array()).all())
          return false;
    }
    return true;
  }
  [[nodiscard]] bool is_free_at_finest(const Aabb& box_W, std::uint64_t& lookups) const noexcept override {
    return is_free(box_W, lookups);
  }
  [[nodiscard]] stages::CellState at(const Vector3& p_W, std::uint64_t& lookups) const noexcept override {
    ++lookups;
    for (const Aabb& o : occupied) {
      if (o.contains(p_W)) return stages::CellState::kOccupied;
    }
    for (const Aabb& v : vague) {
      if (v.contains(p_W)) return stages::CellState::kUnknown;
    }
    return free_W.contains(p_W) ? stages::CellState::kFree : stages::CellState::kUnknown;
  }
  [[nodiscard]] double cell_m() const noexcept override { return 0.3; }
  [[nodiscard]] stages::BlockContent read(const Vector3& corner_W, double cell_m, stages::CellBlock& cells,
                                          std::uint64_t& lookups) const noexcept override {
    const stages::BlockContent content = stages::read_cell_by_cell(*this, corner_W, cell_m, cells, lookups);
    for (std::size_t i = 0; i < 16 * cells.sure.size() && !(unsure.empty() && vague.empty()); ++i) {
      const Vector3 cell(static_cast<double>(i % 16), static_cast<double>(i / 16 % 16),
                         static_cast<double>(i / 256));
      const Vector3 p_W = corner_W + cell_m * (cell + Vector3::Constant(0.5));
      const auto bit = static_cast<std::uint16_t>(1U << (i % 16));
      for (const Aabb& box : unsure)
        if (box.contains(p_W)) cells.sure[i / 16] = static_cast<std::uint16_t>(cells.sure[i / 16] & ~bit);
      for (const Aabb& box : vague)
        if (box.contains(p_W)) cells.vague[i / 16] = static_cast<std::uint16_t>(cells.vague[i / 16] | bit);
    }
    return content;
  }
};

}  // namespace roborun::test
