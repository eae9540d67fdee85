/// What the pixels of a row show, by their neighbours: a surface, something thin, or nothing that is there.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/depth_error.hpp"
#include "firmware_if/depth_camera.hpp"
#include "stages/perception/depth_steps.hpp"

namespace roborun::stages {

/// Between two pixels is a step if they differ by more than constant_m + quadratic_per_m z^2.
struct PixelRules {
  float constant_m{}, quadratic_per_m{};
  bool mixes{};  ///< DepthError.
  /// Two pixels share a surface if there is no step between them. Those of a camera that mixes must not differ by more than
  /// same_m + slope z + quadratic_per_m z^2, either.
  float same_m{}, slope{};
};
/// Those of a camera with this error.
[[nodiscard]] PixelRules pixel_rules(const firmware_if::DepthFrame& frame, const DepthError& error) noexcept;

/// Some pixels of a row.
struct PixelRow {
  static constexpr std::size_t kPad = 8;  ///< Room for whole vectors.
  /// 0: no surface, or, of a camera that mixes, a pixel that is not thin, beside one that is nearer or, to the left or right, has
  /// no information, and shares its surface with one neighbour at most: it saw a bit of what is in front and a bit of what is
  /// behind, and nothing is where it ends.
  alignas(32) std::array<float, kMaxImageSide + kPad> depth_m{};
  /// Bit i of all words: pixel i is nearer than both pixels beside it, or above and below it, by a step. (One of them may have
  /// no information.) Of a camera that mixes it must not be alone, nor beside one that is nearer: such pixels lie anywhere
  /// between what is in front and what is behind.
  std::array<std::uint64_t, kMaxImageSide / 64 + 1> thin{};
  /// Of these, pixels of which both neighbours are known to be farther.
  std::array<std::uint64_t, kMaxImageSide / 64 + 1> surely_thin{};
  bool any_thin{};
};

/// Fills `row` with the pixels [u0, u1) of row v. Preconditions: a good shape (check_shape()), u0 < u1. RT-safe: O(pixels).
void tell_pixels(const firmware_if::DepthFrame& frame, std::size_t v, std::size_t u0, std::size_t u1,
                 const PixelRules& rules, PixelRow& row) noexcept;

}  // namespace roborun::stages
