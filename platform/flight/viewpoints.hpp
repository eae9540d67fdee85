/// From where a vehicle that does not see all around looks at a place that too little is known of.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/geometry/vector.hpp"
#include "core/memory/static_vector.hpp"
#include "stages/perception/polled_view.hpp"

namespace roborun::flight {

/// Finds known free places that unknown cells are seen from, the best one first, and then from other sides.
/// Source of the idea: Connolly, "The determination of next best views" (1985).
class Viewpoints {
 public:
  struct Question {
    Vector3 place_W{};          ///< What is unknown around it stands in the way.
    double radius_m{};          ///< Of the vehicle with its room.
    double level_view_ratio{};  ///< Tangent of the elevation, up and down, that it sees.
    Aabb bounds_W{};            ///< Its centre stays inside.
  };

  /// Of 240 places around it, to which the vehicle can go straight, the one with free lines to most of the unknown cells that have a
  /// free one beside them. What the last kRemembered answers showed from about the same side does not count. Empty: none is left,
  /// or the view's budget is spent. RT-safe: at most kMostCells lines for each place.
  [[nodiscard]] std::optional<Vector3> next(const stages::PolledView& view, const Question& question,
                                            std::uint64_t& lookups) noexcept;

  static constexpr std::size_t kMostCells = 128;
  static constexpr std::size_t kRemembered = 8;

 private:
  using Cells = core::StaticVector<Vector3, kMostCells>;
  [[nodiscard]] static Cells unknown_around(const stages::PolledView& view, const Question& question,
                                            std::uint64_t& lookups) noexcept;
  [[nodiscard]] bool was_looked_at(const Vector3& cell_W, const Vector3& from_W) const noexcept;

  core::StaticVector<Vector3, kRemembered> answered_W_;
  std::size_t oldest_{0};
};

}  // namespace roborun::flight
