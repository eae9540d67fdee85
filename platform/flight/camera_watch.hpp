/// Compares what cameras see with what the map knows, before the map gets it: a camera that was turned by a bump puts everything
/// where it is not.
#pragma once

#include <cstdint>

#include "stages/perception/map_view.hpp"
#include "stages/perception/occupancy_map.hpp"

namespace roborun::flight {

enum class Agreement : std::uint8_t {
  kUnknown,  ///< Too few surfaces nearby, or in space of which nothing is known; or what looks turned lies within 2 x 2 m, as a body that passes does.
  kAgrees,
  kDisagrees,  ///< In every part of the image that shows surfaces, many lie where the map knows free space.
  kTurned,  ///< Many do, and turned by one angle nearly all of them end known free space: the mount was bumped.
};

/// 256 pixels in four parts of the image, those that show a surface within 10 m: it contradicts the map if all within 0.6 m
/// of it, and three sigma of its depth, is known to be free. What moves fills a part of the image, a turned camera errs in all of
/// them: at least three, and a quarter of the image in all; an eighth of each part's surfaces, and a third of all.
///
/// Turned: a sixteenth of the surfaces contradicts, and one of 24 turns (8 and 16 degrees, in twelve directions) leaves at most
/// half of these contradictions, lets half as many surfaces more lie where the map's free space ends, and at least half of all.
/// Fog, bodies, noise and an error of the place have no such turn. Precondition: check_shape(posed) is kOk. RT-safe: O(1).
[[nodiscard]] Agreement agreement_of(const stages::PosedDepthFrame& posed,
                                     const stages::MapView& known) noexcept;

}  // namespace roborun::flight
