/// Cells in one array, and what planner and smoother may ask of them.
#pragma once

#include <algorithm>
#include <vector>

#include "core/record/state_hash.hpp"
#include "stages/perception/map_view.hpp"

namespace example {

inline constexpr double kCell_m = 0.3;

using roborun::Aabb, roborun::Vector3, roborun::stages::CellState;

/// Unknown is not free, and what lies outside of the array or of the window is unknown.
class VoxelArray final : public roborun::stages::MapView {
 public:
  explicit VoxelArray(const Aabb& bounds_W)
      : min_W_(bounds_W.min_W),
        size_(index_of(bounds_W.max_W) + 1),
        cell_(static_cast<std::size_t>(size_.prod()), CellState::kUnknown) {}

  void set(const Vector3& p_W, CellState to) noexcept {
    const Index at = index_of(p_W);
    if (!holds(at)) return;
    known_m3_ += state(at) == CellState::kUnknown ? kCell_m * kCell_m * kCell_m : 0.0;
    cell_[flat(at)] = to;
  }
  void forget() noexcept {
    std::fill(cell_.begin(), cell_.end(), CellState::kUnknown);
    known_m3_ = 0.0;
  }
  void show(const Aabb& window_W) noexcept { window_W_ = window_W; }
  [[nodiscard]] double known_volume_m3() const noexcept { return known_m3_; }
  [[nodiscard]] std::size_t bytes() const noexcept { return cell_.size(); }
  [[nodiscard]] std::uint64_t digest() const noexcept {
    roborun::core::StateHash hash;
    for (const CellState cell : cell_) hash.add(static_cast<std::uint64_t>(cell));
    return hash.value();
  }

  [[nodiscard]] bool is_free(const Aabb& box_W, std::uint64_t& lookups) const noexcept override {
    const bool inside = window_W_.contains(box_W.min_W) && window_W_.contains(box_W.max_W);
    return inside && is_free_at_finest(box_W, lookups);
  }
  [[nodiscard]] bool is_free_at_finest(const Aabb& box_W, std::uint64_t& lookups) const noexcept override {
    if (!(box_W.size().array() >= 0.0).all()) return false;  // NaN too
    const Index low = index_of(box_W.min_W), high = index_of(box_W.max_W);
    bool free = true;
    for (Index at = low; free && at.z() <= high.z(); ++at.z()) {
      for (at.y() = low.y(); free && at.y() <= high.y(); ++at.y()) {
        for (at.x() = low.x(); free && at.x() <= high.x(); ++at.x(), ++lookups)
          free = state(at) == CellState::kFree;
      }
    }
    return free;
  }
  [[nodiscard]] CellState at(const Vector3& p_W, std::uint64_t& lookups) const noexcept override {
    ++lookups;
    return window_W_.contains(p_W) ? state(index_of(p_W)) : CellState::kUnknown;
  }
  [[nodiscard]] double cell_m() const noexcept override { return kCell_m; }

 private:
  using Index = Eigen::Array<long, 3, 1>;
  /// Clamped before it becomes an integer; outside stays outside.
  [[nodiscard]] Index index_of(const Vector3& p_W) const noexcept {
    return ((p_W - min_W_).array() / kCell_m).floor().max(-1.0).min(1e6).cast<long>();
  }
  [[nodiscard]] bool holds(const Index& at) const noexcept { return (at >= 0).all() && (at < size_).all(); }
  [[nodiscard]] CellState state(const Index& at) const noexcept {
    return holds(at) ? cell_[flat(at)] : CellState::kUnknown;
  }
  [[nodiscard]] std::size_t flat(const Index& at) const noexcept {
    return static_cast<std::size_t>((at.z() * size_.y() + at.y()) * size_.x() + at.x());
  }

  Vector3 min_W_;
  Index size_;  ///< Before cell_, which is made from it.
  std::vector<CellState> cell_;
  double known_m3_{0.0};
  Aabb window_W_{Vector3::Constant(1.0), Vector3::Constant(-1.0)};  ///< Empty: nothing is exported yet.
};

}  // namespace example
