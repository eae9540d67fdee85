/// What several sensor models draw.
#pragma once

#include "core/geometry/vector.hpp"
#include "core/random/counter_rng.hpp"

namespace roborun::sitl {

/// Three normal numbers. One draw a statement: the order of evaluation of arguments is not fixed.
[[nodiscard]] inline Vector3 normal3(core::CounterRng& rng, double sigma = 1.0) noexcept {
  Vector3 v;
  for (int i = 0; i < 3; ++i) v[i] = sigma * rng.normal();
  return v;
}

}  // namespace roborun::sitl
