/// Where a vehicle flew lately.
#pragma once

#include <array>
#include <cstddef>

#include "core/geometry/vector.hpp"

namespace roborun::flight {

/// The last places, at least kStep_m apart.
class Trail {
 public:
  static constexpr double kStep_m = 0.5;
  static constexpr std::size_t kPlaces = 32;

  /// RT-safe: O(1).
  void note(const Vector3& p_W) noexcept {
    if (noted_ > 0 && (p_W - back(0)).norm() < kStep_m) return;
    place_W_[noted_++ % kPlaces] = p_W;
  }
  [[nodiscard]] std::size_t size() const noexcept { return noted_ < kPlaces ? noted_ : kPlaces; }
  /// The newest is 0. Precondition: i < size().
  [[nodiscard]] const Vector3& back(std::size_t i) const noexcept {
    return place_W_[(noted_ - 1 - i) % kPlaces];
  }

 private:
  std::array<Vector3, kPlaces> place_W_{};
  std::size_t noted_{0};
};

}  // namespace roborun::flight
